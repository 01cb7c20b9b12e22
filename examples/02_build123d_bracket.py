"""02 Volume of a worn part: a bracket (build123d) that loses 0.05 mm on every face.

Every deviation is -0.05 mm (material taken away). By Steiner's formula the volume changes by the area times
-0.05 mm, plus terms of second order. `main` returns the change of the mesh's volume over that product: 1 up
to some 1 %.
"""

from __future__ import annotations

import build123d as bd
import numpy as np

import cadskin as cs

WEAR = 0.05  # mm


def make() -> cs.SkinModel:
    with bd.BuildPart() as bracket:
        bd.Box(60, 40, 6, align=(bd.Align.MIN, bd.Align.CENTER, bd.Align.MIN))
        bd.Box(6, 40, 30, align=(bd.Align.MIN, bd.Align.CENTER, bd.Align.MIN))
        with bd.Locations((38, -10, 6), (38, 10, 6)):
            bd.Hole(3)
    part = cs.nominal(bracket, edge_length=2.0)
    return cs.simulate(part, np.full(part.n_samples, -WEAR))


def main() -> float:
    skin = make()
    area = sum(face.area for face in skin.nominal.faces)
    return float((skin.surface.volume - skin.nominal.surface.volume) / (-WEAR * area))


if __name__ == "__main__":
    print(f"volume lost over (area times wear): {main():.4f}")
    print("wrote", make().save("worn_bracket.ply"))
