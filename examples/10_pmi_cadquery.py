"""10 Tolerances written in a CAD script (cadquery): a plate with a bore goes to AP242 and comes back.

The selectors are cadquery's. The file holds semantic PMI that any AP242 reader understands. `main` returns
how many of the four tolerances come back with the same value, datums and faces: 4.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import cadquery as cq

import cadskin as cs


def plate() -> cq.Workplane:
    return cq.Workplane().box(60, 40, 8).faces(">Z").workplane().hole(12)


def tolerances() -> cs.Specification:
    return cs.Specification(
        cs.flatness("<Z", 0.02),
        cs.perpendicularity("<X", 0.05, datums="A"),
        cs.position("%CYLINDER", 0.1, datums="A|B|C", diameter=True, material="MMR"),
        cs.surface_profile(">Z", 0.2, datums="A|B|C"),
        datums={"A": "<Z", "B": "<X", "C": "<Y"},
        dimensions=[cs.size("%CYLINDER", 12, fit="H7")],
    )


def main() -> float:
    spec = tolerances()
    with tempfile.TemporaryDirectory() as folder:
        path = cs.write_step(Path(folder, "plate.step"), plate(), spec)
        nominal = cs.nominal(path, edge_length=5.0)
        back = cs.read_pmi(path, nominal)
    wanted = spec.bind(nominal)
    same = [
        (one.type, one.value, one.datums, one.material, one.feature.faces)
        == (other.type, other.value, other.datums, other.material, other.feature.faces)
        for one, other in zip(wanted, back, strict=True)
    ]
    return float(sum(same))


if __name__ == "__main__":
    written = cs.write_step("plate.step", plate(), tolerances())
    print(cs.read_pmi(written).table())
