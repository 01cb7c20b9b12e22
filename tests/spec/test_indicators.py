"""Intersection plane, orientation plane, direction feature, collection plane (ISO 1101)."""

import math

import numpy as np
import pytest

import cadskin as cs
from cadskin.errors import SpecificationError
from cadskin.spec import Indicator, as_indicator, parse_spec, section_normal

UP, SIDE = np.array([0.0, 0, 1]), np.array([1.0, 0, 0])


def test_in_a_spec_file_and_back():
    text = """
straightness = {value = 0.02, on = ">Z", intersection_plane = "parallel A"}
line_profile = {value = 0.1, on = ">Z", datums = "A", intersection_plane = "∥ A", orientation_plane = "⟂ A-B"}
circular_runout = {value = 0.1, on = "<Z", datums = "A", direction_feature = "inclined 30 A"}
surface_profile = {value = 0.3, on = ">X", collection_plane = {relation = "parallel", datums = "B"}}
[datums]
A = "<X"
B = "<Y"
"""
    spec = parse_spec(text)
    shown = [str(tolerance) for tolerance in spec]
    assert shown == ["⏤ 0.02  ◁∥ A", "⌒ 0.1 | A  ◁∥ A  ◁⟂ A-B▷", "↗ 0.1 | A  ←∠30° A", "⌓ 0.3  ○∥ B"]
    assert spec.tolerances[2].indicator("direction_feature").angle == math.radians(30)
    assert spec.tolerances[0].indicator("collection_plane") is None
    assert parse_spec(spec.to_toml()) == spec
    plane = spec.to_dict()["tolerances"][0]["indicators"]
    assert plane == [
        {
            "kind": "intersection_plane",
            "relation": "parallel",
            "datums": ["A"],
            "angle_deg": None,
            "direction": None,
        }
    ]


def test_in_python():
    tolerance = cs.straightness(3, 0.02, intersection_plane="perpendicular B")
    assert tolerance.indicators == (as_indicator("intersection_plane", "perpendicular B"),)
    with pytest.raises(SpecificationError, match="refers to datum B, which is not defined"):
        cs.Specification(tolerance)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('intersection_plane = "A"', "must be like 'parallel A'"),
        ('intersection_plane = "parallel"', "must be like 'parallel A'"),
        ('intersection_plane = "inclined A"', "give an angle"),
        ('intersection_plane = "parallel 30 A"', "give an angle for an inclined one"),
        ('intersection_plane = "crooked A"', "relation 'crooked' is none of"),
        ('intersection_plane = "run_out A"', "run_out is only for direction_feature"),
        ('collection_plane = "symmetrical A"', "symmetrical is only for intersection_plane"),
        ('direction_feature = {relation = "parallel"}', "give a datum"),
        ("direction_feature = {direction = [0, 0, 0]}", "not zero"),
        ('direction_feature = {datum = "A", relation = "parallel"}', "give a datum"),
        ('direction_feature = {datums = "A", angel = 3}', "unknown key 'angel'"),
        ("intersection_plane = 3", "must be a table"),
        ('intersection_plan = "parallel A"', "did you mean 'intersection_plane'"),
    ],
)
def test_mistakes_are_told_with_their_line(line, message):
    text = f"tolerances = [\n  {{straightness = 0.02, on = 1, {line}}},\n]\n[datums]\nA = 0\n"
    with pytest.raises(SpecificationError, match=f"spec:2: .*{message}"):
        parse_spec(text)


def test_the_sections_of_a_surface():
    parallel = as_indicator("intersection_plane", "parallel A")
    across = as_indicator("intersection_plane", "perpendicular A")
    assert section_normal(parallel, UP, SIDE) == pytest.approx([1, 0, 0])
    assert abs(section_normal(across, UP, SIDE)) == pytest.approx([0, 1, 0])
    # The other way round for an axis: a plane parallel to it holds it.
    assert abs(section_normal(parallel, UP, SIDE, is_axis=True)) == pytest.approx([0, 1, 0])
    assert section_normal(across, UP, 3 * SIDE, is_axis=True) == pytest.approx([1, 0, 0])
    assert section_normal(Indicator("intersection_plane", direction=(0, 2, 0)), UP) == pytest.approx(
        [0, 1, 0]
    )
    for plane in (parallel, across):
        with pytest.raises(SpecificationError, match="parallel to the surface itself"):
            section_normal(plane, UP, UP)
    with pytest.raises(SpecificationError, match="does not say in which planes"):
        section_normal(as_indicator("orientation_plane", "parallel A"), UP, SIDE)
    with pytest.raises(SpecificationError, match="direction of datum A is needed"):
        section_normal(parallel, UP)
