"""Tolerances on made parts: closed forms on parts whose deviation is prescribed."""

from __future__ import annotations

import json
import pickle

import numpy as np
import pytest

from cadskin.errors import SpecificationError
from cadskin.shape.association import associate, rotation
from cadskin.skin import SkinEnsemble, SkinModel
from cadskin.spec import (
    Datum,
    Specification,
    angularity,
    circular_runout,
    coaxiality,
    cylindricity,
    flatness,
    parallelism,
    perpendicularity,
    position,
    roundness,
    straightness,
    surface_profile,
    symmetry,
    total_runout,
)
from cadskin.verify import verify

# Faces of the box: -x 0, +x 1, -y 2, +y 3, -z 4, +z 5; of the shaft: round 0+1, bottom 2, top 3.


def displaced(part, field):
    """A mesh whose vertices moved by a vector field, with the labels of the part."""
    return part.surface.with_points(part.surface.points + field(part.surface.points))


def on_top(part, height):
    """Move the points of the upper face of the box along z."""

    def field(points):
        top = np.isclose(points[:, 2], points[:, 2].max())
        shift = np.zeros_like(points)
        shift[top, 2] = height(points[top, 0], points[top, 1])
        return shift

    return displaced(part, field)


def test_raised_top(array_box):
    made = on_top(array_box, lambda x, y: 0.05 + 0 * x)
    spec = Specification(
        flatness(5, 0.2),
        parallelism(5, 0.2, datums="A"),
        perpendicularity(5, 0.2, datums="B"),
        surface_profile(5, 0.2, datums="A"),
        position(5, 0.2, datums="A"),
        surface_profile(5, 0.2),
        datums={"A": 4, "B": 1},
    )
    found = verify(made, spec, nominal=array_box)
    values = {name: evaluation.value for name, evaluation in found.evaluations}
    assert not found.unresolved
    assert values["flatness-1"] == 0.0
    assert values["parallelism-1"] == pytest.approx(0, abs=1e-12)
    # Raised side by side with B: the upper edge of B went up within its plane.
    assert values["perpendicularity-1"] == pytest.approx(0, abs=1e-12)
    assert values["surface_profile-1"] == pytest.approx(0.1, abs=1e-12)
    assert values["position-1"] == pytest.approx(0.1, abs=1e-12)
    assert values["surface_profile-2"] == pytest.approx(0.0, abs=1e-12)  # free to follow
    assert found.conforming
    assert found.certified


def test_bowed_and_tilted_top(array_box):
    made = on_top(array_box, lambda x, y: 0.001 * x + 0.02 * (1 - (y / 20) ** 2))
    spec = Specification(
        flatness(5, 0.04), parallelism(5, 0.05, datums="A"), straightness(5, 0.04), datums={"A": 4}
    )
    found = verify(made, spec, nominal=array_box)
    assert found["flatness-1"].value == pytest.approx(0.02, rel=1e-5)
    assert found["parallelism-1"].value == pytest.approx(0.06 + 0.02, abs=1e-12)
    assert found["straightness-1"].value == pytest.approx(0.0, abs=1e-9)  # along x the lines are straight
    assert not found.conforming
    assert found["parallelism-1"].ok is False
    assert found["flatness-1"].ok is True


def test_rigid_motion_of_the_whole_part_changes_nothing(array_box, plain_skin):
    surface = plain_skin(array_box).surface
    turn, shift = rotation(np.array([0.02, -0.01, 0.03])), np.array([1.0, -2.0, 0.5])
    spec = Specification(
        flatness(5, 0.1),
        parallelism(5, 0.1, datums="A"),
        perpendicularity(1, 0.1, datums="A|C"),
        surface_profile([1, 5], 0.2, datums="A|B|C"),
        position(5, 0.2, datums="A|B"),
        surface_profile([0, 1, 2, 3, 4, 5], 0.3),
        symmetry([0, 1], 0.2, datums="D", derived="median_plane"),
        datums=[
            Datum("A", spec_faces(4)),
            Datum("B", spec_faces(2)),
            Datum("C", spec_faces(0)),
            Datum("D", spec_faces(2, 3)),
        ],
        checked=False,
    )
    here = verify(surface, spec, nominal=array_box)
    there = verify(surface.with_points(surface.points @ turn.T + shift), spec, nominal=array_box)
    assert [name for name, _ in here.evaluations] == [name for name, _ in there.evaluations]
    assert len(here.evaluations) == 7
    assert not here.unresolved
    for (name, first), (_, second) in zip(here.evaluations, there.evaluations, strict=True):
        assert first.value > 0.01, name
        assert second.value == pytest.approx(first.value, abs=1e-9), name


def spec_faces(*faces):
    from cadskin.spec import as_selection

    return as_selection(list(faces))


def shaft_field(part, shift, axial=None):
    """Move the shaft radially by ``shift(angle, z)`` along the radius, the upper cap by ``axial``."""

    def field(points):
        angle = np.arctan2(points[:, 1], points[:, 0])
        radius = np.linalg.norm(points[:, :2], axis=1)
        out = np.zeros_like(points)
        amount = shift(angle, points[:, 2]) * (radius / radius.max())
        out[:, 0], out[:, 1] = amount * np.cos(angle), amount * np.sin(angle)
        if axial is not None:
            top = np.isclose(points[:, 2], points[:, 2].max())
            out[top, 2] += axial(radius[top], angle[top])
        return out

    return displaced(part, field)


def test_lobed_shaft(array_shaft):
    made = shaft_field(array_shaft, lambda angle, z: 0.01 * np.cos(3 * angle))
    spec = Specification(
        roundness(0, 0.03),
        cylindricity(0, 0.03),
        straightness(0, 0.03),
        straightness(0, 0.03, diameter=True),
        circular_runout(0, 0.03, datums="A"),
        total_runout(0, 0.03, datums="A"),
        datums={"A": 0},
        checked=False,
    )
    found = verify(made, spec, nominal=array_shaft)
    assert not found.unresolved
    assert found["roundness-1"].value == pytest.approx(0.02, abs=1e-6)
    assert found["cylindricity-1"].value == pytest.approx(0.02, abs=1e-9)
    assert found["straightness-1"].value == pytest.approx(0.0, abs=1e-9)
    assert found["straightness-2"].value == pytest.approx(0.0, abs=1e-9)
    assert found["circular_runout-1"].value == pytest.approx(0.02, abs=1e-6)
    assert found["total_runout-1"].value == pytest.approx(0.02, abs=1e-9)


def test_tapered_shaft_has_total_but_no_circular_runout(array_shaft):
    made = shaft_field(array_shaft, lambda angle, z: 0.001 * z + 0 * angle)
    spec = Specification(
        circular_runout(0, 0.03, datums="A"),
        total_runout(0, 0.03, datums="A"),
        datums={"A": 0},
        checked=False,
    )
    found = verify(made, spec, nominal=array_shaft)
    assert found["circular_runout-1"].value == pytest.approx(0.0, abs=1e-9)
    assert found["total_runout-1"].value == pytest.approx(0.04, abs=1e-9)


def test_bent_and_leaning_shaft(array_shaft):
    """The centre of each section lies at (lean z + bow (1 - ((z - 20) / 20)^2), 0)."""

    def centre(z):
        return 0.0005 * z + 0.01 * (1 - ((z - 20) / 20) ** 2)

    def field(points):
        out = np.zeros_like(points)
        out[:, 0] = centre(points[:, 2]) * (np.linalg.norm(points[:, :2], axis=1) / 10.0)
        return out

    made = displaced(array_shaft, field)
    spec = Specification(
        straightness(0, 0.03, diameter=True),
        perpendicularity(0, 0.03, diameter=True, datums="A"),
        position(0, 0.1, diameter=True, datums="A"),
        datums={"A": 2},
    )
    found = verify(made, spec, nominal=array_shaft, sections=41)
    assert not found.unresolved
    z = np.linspace(2, 38, 41)
    x = centre(z)
    # Straightness: the band of a parabola over its chord; perpendicularity: the range of the centres.
    assert found["perpendicularity-1"].value == pytest.approx(np.ptp(x), rel=2e-2)
    assert found["straightness-1"].value == pytest.approx(0.01 * 0.9**2, rel=3e-2)
    assert found["position-1"].value == pytest.approx(
        np.ptp(x), rel=2e-2
    )  # A leaves the place along x and y free


def test_axial_runout_of_a_wobbling_face(array_shaft):
    made = shaft_field(
        array_shaft, lambda angle, z: 0 * angle, axial=lambda radius, angle: 0.001 * radius * np.cos(angle)
    )
    spec = Specification(
        circular_runout(3, 0.1, datums="A"), total_runout(3, 0.1, datums="A"), datums={"A": 0}, checked=False
    )
    found = verify(made, spec, nominal=array_shaft)
    # The wobble lifts the upper rim of the datum cylinder along itself: its axis stays.
    assert found["total_runout-1"].value == pytest.approx(0.02, abs=1e-9)
    assert found["circular_runout-1"].value == pytest.approx(0.02 * 0.95, rel=0.02)


def test_what_cannot_be_evaluated_is_said(array_box):
    spec = Specification(flatness(5, 0.1), flatness([0, 2], 0.1, derived="axis"), datums={"A": 4})
    found = verify(array_box.surface, spec, nominal=array_box)
    assert [name for name, _ in found.evaluations] == ["flatness-1"]
    assert {name for name, _ in found.unresolved} == {"flatness-2"}
    assert not found.conforming
    assert "plane" in dict(found.unresolved)["flatness-2"]


def test_ensemble_equals_its_members(array_box):
    rng = np.random.default_rng(0)
    fields = 0.01 * rng.standard_normal((3, array_box.n_samples))
    ensemble = SkinEnsemble(array_box, fields)
    spec = Specification(flatness(5, 0.05), parallelism(5, 0.08, datums="A"), datums={"A": 4})
    seen = []
    together = verify(ensemble, spec, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(1, 3), (2, 3), (3, 3)]
    for index, skin in enumerate(ensemble):
        assert isinstance(skin, SkinModel)
        single = verify(skin, spec)
        assert together.values[index].tolist() == [e.value for _, e in single.evaluations]
        assert together.conforming[index] == single.conforming


def test_flatness_of_a_skin_is_that_of_its_points(array_box, plain_skin):
    skin = plain_skin(array_box)
    found = verify(skin.surface, Specification(flatness(5, 0.1)), nominal=array_box)
    points = skin.surface.points[array_box.feature_of(5).vertex_ids]
    assert found["flatness-1"].value == pytest.approx(associate(points, "plane").value, abs=1e-12)


def test_table_csv_json_and_pickle(array_box):
    found = verify(array_box.surface, Specification(flatness(5, 0.1)), nominal=array_box)
    assert "flatness-1" in str(found)
    assert found.to_csv().splitlines()[1] == "flatness-1,flatness,0,0.1,ok,yes"
    data = json.loads(json.dumps(found.to_dict()))
    assert data["conforming"] is True
    assert data["evaluations"]["flatness-1"]["operations"]
    again = pickle.loads(pickle.dumps(found["flatness-1"]))
    assert again.to_dict() == found["flatness-1"].to_dict()


def test_mesh_without_nominal_is_refused(array_box):
    with pytest.raises(SpecificationError, match="nominal"):
        verify(array_box.surface, Specification(flatness(5, 0.1)))


def test_angularity_needs_no_angle_when_the_nominal_has_it(array_box):
    """Against a nominal the exact angle comes from the nominal: here 90 degrees."""
    spec = Specification(
        angularity(1, 0.1, datums="A"), perpendicularity(1, 0.1, datums="A"), datums={"A": 4}
    )
    made = displaced(array_box, lambda p: 0.02 * np.sin(p[:, [1, 2, 0]] / 5))
    found = verify(made, spec, nominal=array_box)
    assert found["angularity-1"].value == pytest.approx(found["perpendicularity-1"].value, abs=1e-12)


def test_coaxiality_to_itself_is_zero(array_shaft):
    spec = Specification(coaxiality(0, 0.1, diameter=True, datums="A"), datums={"A": 0}, checked=False)
    assert verify(array_shaft.surface, spec, nominal=array_shaft)["coaxiality-1"].value < 1e-9
