"""21 Gallery: random fields and modes, each with a standard deviation of about 0.03 mm.

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
        "WhiteNoise": cs.WhiteNoise(0.02),
        "GaussianField": cs.GaussianField(0.03, length=8),
        "... rough": cs.GaussianField(0.03, length=8, kernel="exponential"),
        "... marks": cs.GaussianField(0.03, length=5, anisotropy=5.0, direction=(1.0, 1.0, 0.0)),
        "... length varies": cs.GaussianField(0.03, lambda points: 6 + 0.1 * abs(points[:, 1])),
        "Gibbs": cs.Gibbs(0.03, length=3, sweeps=200, lower=-0.04, upper=0.04),
        "KarhunenLoeve": cs.KarhunenLoeve(0.03, length=15, count=10),
        "Modes": cs.Modes([0.02, 0.02, 0.02], first=3, random=True),
        "VibrationModes": cs.VibrationModes([0.015, 0.015, 0.015], first=6, random=True),
        "BasisForm": cs.BasisForm("legendre", {"3,0": 0.02, "1,2": 0.02}),
        "Randomised": cs.Randomised(cs.Paraboloid(0.1), "norm", (1.0, 0.3)),
        "a sum": cs.Paraboloid(0.1) + cs.GaussianField(0.01, length=6),
    }


def make() -> dict[str, cs.SkinModel]:
    part = cs.nominal(PART, edge_length=1.5)
    shown = [f for f in part.features if f.kind != "plane" or 1600 < f.area < 1700]
    skins = {}
    for title, model in models().items():
        kind = {"BasisForm": "plane"}.get(title)
        chosen = [f for f in shown if kind in (None, f.kind)]
        skins[title] = cs.simulate(part, model.on(chosen), rng=4, check=False)
    return skins


def main() -> int:
    skins = make().values()
    return sum(skin.closed and np.ptp(skin.deviation) > 0 for skin in skins)


if __name__ == "__main__":
    skins, path = make(), sys.argv[1] if len(sys.argv) > 1 else "random.png"
    cs.sheet(path, list(skins.values()), list(skins), columns=4, tile=(480, 360), edges=False, clim=0.1)
