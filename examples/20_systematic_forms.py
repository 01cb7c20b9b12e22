"""20 Gallery: systematic deviations, each with about 0.1 mm from peak to valley.

Each model lies on a freeform face, a plane and a cylinder. `main` returns the number of models.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import cadskin as cs

PART = Path(__file__).resolve().parent / "parts" / "gallery.step"


def models() -> dict[str, cs.DeviationModel]:
    return {
        "SizeOffset": cs.SizeOffset(0.05),
        "Shift": cs.Shift((0.0, 0.03, 0.05)),
        "Tilt": cs.Tilt(2e-3, axis=(0.0, 1.0, 0.0)),
        "Torsor": cs.Torsor((0.0, 0.0, 0.02), (1e-3, 1e-3, 0.0)),
        "Taper": cs.Taper(0.1),
        "Bend": cs.Bend(0.1),
        "Twist": cs.Twist(4e-3, axis=(1.0, 0.0, 0.0)),
        "Thermal": cs.Thermal(100.0),
        "Paraboloid": cs.Paraboloid(0.1),
        "Saddle": cs.Saddle(0.1),
        "Cone": cs.Cone(0.1),
        "Sphere": cs.Sphere(-0.1),
        "Cylinder": cs.Cylinder(0.1, rotation=0.5),
        "Ellipsoid": cs.Ellipsoid(0.1),
        "Quadric": cs.Quadric(2e-4, -1e-4, angle=0.4),
        "morph": cs.morph(cs.Cone(0.1), cs.Saddle(0.1), 0.5),
    }


def make() -> dict[str, cs.SkinModel]:
    part = cs.nominal(PART, edge_length=1.5)
    shown = [f for f in part.features if f.kind != "plane" or 1600 < f.area < 1700]
    skins = {}
    for title, model in models().items():
        kind = {}.get(title)
        chosen = [f for f in shown if kind in (None, f.kind)]
        skins[title] = cs.simulate(part, model.on(chosen), rng=4, check=False)
    return skins


def main() -> int:
    skins = make().values()
    return sum(skin.closed and np.ptp(skin.deviation) > 0 for skin in skins)


if __name__ == "__main__":
    skins, path = make(), sys.argv[1] if len(sys.argv) > 1 else "systematic.png"
    cs.sheet(path, list(skins.values()), list(skins), columns=4, tile=(480, 360), edges=False, clim=0.1)
