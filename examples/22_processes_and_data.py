"""22 Gallery: signatures of processes, and deviations that come from outside.

Each model lies on a freeform face, a plane and a cylinder. `main` returns the number of models.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import cadskin as cs
from cadskin.deviation import clamped_plate, drilled, ground, milled, printed, turned
from cadskin.shape import Cylinder

PART = Path(__file__).resolve().parent / "parts" / "gallery.step"
ONLY = dict.fromkeys(["Lobing", "turned", "drilled", "Towards"], "cylinder")


def models(part: cs.NominalModel) -> dict[str, cs.DeviationModel]:
    moved = 0.07 * np.sin(part.surface.points[:, [2, 0, 1]] / 6.0)
    return {
        "Waviness": cs.Waviness(0.1, wavelength=12),
        "Lobing": cs.Lobing(0.1, lobes=5),
        "FromSpectrum": cs.FromSpectrum(np.linspace(0.03, 0.2, 20), np.full(20, 2e-3), angle=0.3),
        "Fractal": cs.Fractal(0.03, hurst=0.5, longest=24, shortest=6),
        "turned": turned(feed=6.0, nose_radius=45.0, ovality=0.05),
        "milled": milled(feed_per_tooth=6.0, diameter=90.0, angle=0.4).on(kind="plane"),
        "ground": ground(sigma=0.03, length=5.0, ratio=5.0, lay=(1.0, 1.0, 0.0)),
        "drilled": drilled(lobing=0.1, taper=0.05),
        "printed": printed(layer=0.1, direction=(0.01, 0.0, 1.0)).on(kind="plane"),
        "clamped plate": clamped_plate(bow=0.1),
        "FromFunction": cs.FromFunction(lambda p, n: 0.05 * np.sin(p[:, 0] / 4.0) * n[:, 2]),
        "FromArray": cs.FromArray(moved[part.samples.vertex_ids, 1]),
        "FromFE": cs.FromFE(moved),
        "FromScan": cs.FromScan(part.surface.points + moved, reach=0.5),
        "Towards": cs.Towards(Cylinder([20, 0, 0], [0, 0, 1], 10.1)),
    }


def make() -> dict[str, cs.SkinModel]:
    part = cs.nominal(PART, edge_length=1.5)
    shown = [f for f in part.features if f.kind != "plane" or 1600 < f.area < 1700]
    skins = {}
    for title, model in models(part).items():
        chosen = [f for f in shown if ONLY.get(title) in (None, f.kind)]
        skins[title] = cs.simulate(part, model.on(chosen), rng=4, check=False)
    return skins


def main() -> int:
    skins = make().values()
    return sum(skin.closed and np.ptp(skin.deviation) > 0 for skin in skins)


if __name__ == "__main__":
    skins, path = make(), sys.argv[1] if len(sys.argv) > 1 else "processes.png"
    cs.sheet(path, list(skins.values()), list(skins), columns=5, tile=(480, 360), edges=False, clim=0.1)
