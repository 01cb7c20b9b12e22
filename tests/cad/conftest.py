"""Files and parts made by cadquery on the spot; the corpus, where it is there."""

import os
from pathlib import Path

import cadquery as cq
import pytest


@pytest.fixture(scope="session")
def corpus():
    """Folder of real STEP files; the test is skipped where it is absent."""
    default = Path(__file__).resolve().parents[2].parent / "shared" / "corpus"
    folder = Path(os.environ.get("CADSKIN_CORPUS", default)) / "step"
    if not folder.is_dir():
        pytest.skip("no STEP corpus: set CADSKIN_CORPUS to its folder")
    return folder


@pytest.fixture(scope="session")
def plate():
    """60 x 40 x 8 plate with a through hole of diameter 12 in the middle."""
    return cq.Workplane().box(60, 40, 8).faces(">Z").workplane().hole(12)


@pytest.fixture(scope="session")
def half_cylinder_plate():
    """A plate whose hole consists of two half-cylinders, as most CAD systems write it."""
    plate = cq.Workplane().box(40, 40, 10)
    sketch = cq.Workplane(origin=(0, 0, -5)).moveTo(-6, 0).threePointArc((0, 6), (6, 0))
    return plate.cut(sketch.threePointArc((0, -6), (-6, 0)).close().extrude(10, clean=False), clean=False)
