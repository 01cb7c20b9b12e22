"""40 Form, orientation and position: the three zones of the paper, met at once and by law.

A plate's top is to be flat within 0.02 mm, parallel to the bottom A within 0.04 mm, and its hole in position
within 0.05 mm to A, B and C. Every part follows the law of the field *given* that all of this holds; nothing
is clipped or rescaled, and each part is evaluated on its welded mesh. `main` returns the largest value over
its limit among 20 parts: at most 1, and near to it, because the zones are used.

Zhang et al. 2013, doi:10.1177/0954405412466987, figures on form, orientation and position.
"""

from __future__ import annotations

import cadquery as cq
import numpy as np

import cadskin as cs
from cadskin.verify import verify

SPEC = cs.Specification(
    cs.flatness(">Z", 0.02),
    cs.parallelism(">Z", 0.04, datums="A"),
    cs.position("%CYLINDER", 0.05, datums="A|B|C"),
    datums={"A": "<Z", "B": "<Y", "C": "<X"},
)


def make(size: int = 20) -> cs.SkinEnsemble:
    plate = cq.Workplane().box(60, 40, 8).faces(">Z").workplane().hole(12)
    part = cs.nominal(plate, edge_length=4.0)
    return cs.simulate_ensemble(part, cs.GaussianField(0.006, 18), size=size, spec=SPEC, rng=7)


def main() -> float:
    found = verify(make(), SPEC)
    assert found.conforming.all()
    return float(np.max(found.values / found.limits))


if __name__ == "__main__":
    lot = make(5)
    print(lot.provenance.options["acceptance_by_tolerance"])
    print(f"largest value over limit {main():.3f}")
    print("wrote", lot[0].picture("inside.png"))
