"""22 Gallery: signatures of processes, and deviations that come from outside.

Each model lies on a freeform face, a plane and a cylinder. `main` returns the number of models that do.
"""

from __future__ import annotations

import sys

import gallery
import numpy as np

import cadskin as cs
from cadskin.deviation import clamped_plate, drilled, ground, milled, printed, turned


def models(part: cs.NominalModel) -> dict[str, cs.DeviationModel]:
    moved = 0.07 * np.sin(part.surface.points[:, [2, 0, 1]] / 6.0)
    return {
        "Waviness": cs.Waviness(0.1, wavelength=12),
        "Lobing": cs.Lobing(0.1, lobes=5),
        "FromSpectrum": cs.FromSpectrum(np.linspace(0.03, 0.2, 20), np.full(20, 2e-3), angle=0.3),
        "turned": turned(feed=6.0, nose_radius=45.0, ovality=0.05),
        "milled": milled(feed_per_tooth=6.0, diameter=90.0, angle=0.4),
        "ground": ground(sigma=0.03, length=5.0, ratio=5.0, lay=(1.0, 1.0, 0.0)),
        "drilled": drilled(lobing=0.1, taper=0.05),
        # Layers of 4 mm that this mesh can show, with the heights of layers of 0.1 mm.
        "printed (LayerSteps) / 40": printed(layer=4.0, direction=(1.0, 0.5, 1.0)) * (1 / 40),
        "clamped_plate (ClampedBow)": clamped_plate(bow=0.1),
        "FromFunction": cs.FromFunction(lambda p, n: 0.05 * np.sin(p[:, 0] / 4.0) * (0.5 + n[:, 2])),
        "FromArray": cs.FromArray(moved[part.samples.vertex_ids, 1]),
        "FromFE": cs.FromFE(moved),
        "FromScan": cs.FromScan(part.surface.points + moved, reach=0.5),
    }


def main() -> int:
    part = gallery.part()
    return gallery.covered(gallery.skins(part, models(part)))


if __name__ == "__main__":
    part = gallery.part()
    made = gallery.skins(part, models(part))
    gallery.draw(sys.argv[1] if len(sys.argv) > 1 else "processes.png", made, columns=5, tile=(400, 300))
