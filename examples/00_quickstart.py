"""00 A part as it could be made: a correlated random field on every face of a plate with a bore.

The field has standard deviation ``sigma`` and correlation length ``length``, both in mm. `main` returns the
root mean square of the deviations over sigma, which is 1 up to what one sample of a small part can tell.
"""

from __future__ import annotations

import cadquery as cq
import numpy as np

import cadskin as cs

SIGMA = 0.01  # mm


def make() -> cs.SkinModel:
    plate = cq.Workplane().box(60, 40, 8).faces(">Z").workplane().hole(12)
    part = cs.nominal(plate, edge_length=1.0)
    return cs.simulate(part, cs.GaussianField(sigma=SIGMA, length=6), rng=7)


def main() -> float:
    skin = make()
    return float(np.sqrt(np.mean(skin.deviation**2)) / SIGMA)


if __name__ == "__main__":
    print(f"root mean square of the deviations: {main():.3f} sigma")
    print("wrote", make().save("plate.stl"), "and", make().picture("plate.png"))
