"""11 Tolerances of a hole pattern (build123d): one frame for four holes, refined by a second one below it.

A pattern is one tolerance with four members; the lower segment of the composite frame keeps the holes
together more tightly than the upper one places them. `main` returns the number of members that come back from
AP242 in both segments together: 8.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import build123d as bd

import cadskin as cs


def flange() -> bd.Part:
    with bd.BuildPart() as part:
        bd.Cylinder(40, 10)
        with bd.PolarLocations(28, 4):
            bd.Hole(4)
    return part.part


def tolerances(part: cs.NominalModel) -> cs.Specification:
    holes = part.select(kind="cylinder", internal=True)
    rim = part.feature(kind="cylinder", internal=False)
    return cs.Specification(
        cs.position(holes, 0.3, datums="A|B", diameter=True, id="place"),
        cs.position(holes, 0.1, datums="A", diameter=True, parent="place"),
        cs.cylindricity(rim, 0.02),
        cs.total_runout(part.feature(">Z"), 0.05, datums="B"),
        datums={"A": part.feature("<Z"), "B": rim},
    )


def read_back(path: Path) -> cs.Specification:
    shape = flange()
    part = cs.nominal(shape, edge_length=4.0)
    return cs.read_pmi(cs.write_step(path, shape, tolerances(part)))


def main() -> float:
    with tempfile.TemporaryDirectory() as folder:
        spec = read_back(Path(folder, "flange.step"))
    upper, lower = spec.tolerances[:2]
    assert lower.parent == upper.id
    return float(len(upper.feature.groups) + len(lower.feature.groups))


if __name__ == "__main__":
    print(read_back(Path("flange.step")).table())
