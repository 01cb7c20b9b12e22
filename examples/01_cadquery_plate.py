"""01 A known deviation on one face, found again: a plate (cadquery) whose top is dished by 0.05 mm.

A paraboloid z = a (x² + y²) with peak-to-valley height 0.05 mm lies on the top face alone. The skin model's
top is measured like a coordinate measuring machine would do it: heights of its points over the nominal plane.
`main` returns their peak-to-valley height in mm: 0.05.
"""

from __future__ import annotations

import cadquery as cq
import numpy as np

import cadskin as cs


def make() -> cs.SkinModel:
    plate = cq.Workplane().box(60, 40, 8).faces(">Z").workplane().hole(12)
    part = cs.nominal(plate, edge_length=1.5)
    return cs.simulate(part, cs.Paraboloid(0.05).on(">Z"))


def main() -> float:
    skin = make()
    heights = skin.feature(">Z").points[:, 2] - 4.0  # the plate is 8 mm thick, its middle at z = 0
    return float(np.ptp(heights))


if __name__ == "__main__":
    print(f"the top is dished by {main():.4f} mm")
    print("wrote", make().picture("dished_plate.png"))
