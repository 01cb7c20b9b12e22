"""Forms in any frame, on every kind of face, against closed forms; targets met along the normals."""

from __future__ import annotations

from decimal import Decimal, getcontext

import numpy as np
import pytest
from surfaces import ball, funnel, plane, ring, tube, wave

from cadskin.deviation import (
    Cone,
    Cylinder,
    Ellipsoid,
    Paraboloid,
    Quadric,
    Saddle,
    Sphere,
    Towards,
    biconic_sag,
    from_dict,
    from_text,
)
from cadskin.deviation.coordinates import form_coordinates
from cadskin.deviation.given import distance_along_normals
from cadskin.errors import DeviationError
from cadskin.shape import Cylinder as IdealCylinder
from cadskin.shape import Plane as IdealPlane
from cadskin.shape import Sphere as IdealSphere

FACES = {
    "plane": lambda: plane((60.0, 40.0), h=3.0),
    "strip": lambda: tube(20.0, 40.0, h=3.0, turn=1.2),
    "cylinder": lambda: tube(12.0, 40.0, h=3.0),
    "cone": lambda: funnel(0.4, 20.0, 50.0, h=3.0),
    "sphere": lambda: ball(18.0, 400),
    "torus": lambda: ring(20.0, 8.0, h=3.0),
    "freeform": lambda: wave((60.0, 40.0), h=3.0),
}


def rows(part):
    return part.surface.points[part.samples.vertex_ids]


@pytest.mark.parametrize("kind", FACES)
@pytest.mark.parametrize("form", [Paraboloid, Cone, Sphere, Cylinder, Ellipsoid, Saddle])
def test_peak_to_valley_and_sign_on_every_face(form, kind):
    part = FACES[kind]()
    for options in ({}, {"rotation": 0.7, "centre": (3.0, -2.0)}, {"direction": (0.3, 1.0, 0.6)}):
        up, down = (form(sign * 0.03, **options).sample(part)[0] for sign in (1, -1))
        assert np.ptp(up) == pytest.approx(0.03, rel=1e-9)
        assert np.allclose(down, -up, atol=1e-15)


def test_any_frame_on_a_plane():
    """Origin and first axis anywhere in space: the ruled paraboloid is a parabola of one coordinate."""
    part = plane((60.0, 40.0), h=3.0)
    origin, axis = np.array([12.0, 31.0, 7.0]), np.array([3.0, 4.0, 2.0])  # 7 mm above, 2 along the normal
    along, across = np.array([0.6, 0.8, 0.0]), np.array([-0.8, 0.6, 0.0])
    x, y = (rows(part) - origin) @ along, (rows(part) - origin) @ across
    frame = {"origin": tuple(origin), "direction": tuple(axis)}
    parabola = Paraboloid(0.02, ratio=0.0, **frame).sample(part)[0]
    assert np.allclose(parabola, 0.02 * x**2 / np.ptp(x**2), atol=1e-15)
    moved = Paraboloid(0.02, (5.0, -3.0), np.pi / 2, ratio=0.0, **frame).sample(part)[0]
    assert np.allclose(moved, 0.02 * (y + 3) ** 2 / np.ptp((y + 3) ** 2), atol=1e-15)
    quadric = Quadric(2e-5, -1e-5, conic=-1.0, **frame).sample(part)[0]
    assert np.allclose(quadric, 1e-5 * x**2 - 0.5e-5 * y**2, atol=1e-15)


def test_the_centroid_as_origin_changes_nothing():
    part = plane((60.0, 40.0), h=3.0)
    for form in (Saddle(0.02, rotation=0.3), Quadric(1e-5, 2e-5, 0.4)):
        options = {"origin": (30.0, 20.0, 0.0), "direction": (1.0, 0.0, 0.0)}
        again = from_dict({form.name: form.parameters() | options})
        assert np.allclose(again.sample(part), form.sample(part), atol=1e-15)


def test_any_frame_on_curved_faces():
    """The first axis along the axis of a cylinder or cone: the height; on a sphere: the geodesic."""
    strip = tube(20.0, 40.0, h=3.0, turn=1.2)
    angle = np.arctan2(rows(strip)[:, 1], rows(strip)[:, 0])
    frame = {"origin": (40 * np.cos(0.3), 40 * np.sin(0.3), 10.0), "direction": (5.0, 0.0, 1.0)}
    x, y = form_coordinates(strip.features[0], **frame)
    apex = np.argmin(np.hypot(x, y))
    assert np.hypot(x, y)[apex] < 3
    turned = form_coordinates(strip.features[0], origin=frame["origin"], direction=(0.0, 0.0, 1.0))
    assert np.allclose(turned[0], rows(strip)[:, 2] - 10, atol=1e-9)
    assert np.allclose(turned[1], -20 * (angle - 0.3), atol=1e-9)
    cone = funnel(0.4, 20.0, 50.0, h=3.0)
    apex = np.array([0, 0, 0.0]) + 30.0 * np.array([np.tan(0.4), 0, 1])
    x, _ = form_coordinates(cone.features[0], origin=tuple(apex), direction=(0.0, 0.0, 1.0))
    assert np.allclose(x, (rows(cone)[:, 2] - 30) / np.cos(0.4), atol=1e-9)
    shell = ball(18.0, 400)
    x, y = form_coordinates(shell.features[0], direction=(0.0, 1.0, 0.0))
    polar = np.arccos(np.clip(rows(shell)[:, 2] / 18, -1, 1))
    assert np.allclose(np.hypot(x, y), 18 * polar, atol=1e-6) or np.allclose(
        np.hypot(x, y), 18 * (np.pi - polar), atol=1e-6
    )


@pytest.mark.parametrize("kind", ["cylinder", "cone", "torus"])
def test_no_jump_at_the_seam_of_a_closed_face(kind):
    """Neighbours differ by no more than the slope allows, wherever the apex is."""
    part = FACES[kind]()
    edges = part.surface.triangles[:, [0, 1]]
    values = np.zeros(part.surface.n_points)
    for centre in ((0.0, 0.0), (17.0, 2.0), (-30.0, 5.0)):
        values[part.samples.vertex_ids] = Paraboloid(1.0, centre).sample(part)[0]
        assert np.abs(np.diff(values[edges], axis=1)).max() < 0.35


def test_moving_the_apex_around_a_cylinder_turns_the_form():
    part = tube(12.0, 40.0, h=3.0)
    angle = np.arctan2(rows(part)[:, 1], rows(part)[:, 0])
    values = Paraboloid(0.02, (12.0 * 2.0, 0.0), ratio=0.0).sample(part)[0]
    offset = np.angle(np.exp(1j * (angle - 2.0)))
    assert np.allclose(values, 0.02 * offset**2 / np.ptp(offset**2), atol=1e-12)


@pytest.mark.parametrize("radius", [1e4, 1e6, 1e8, 1e10])
def test_forms_of_huge_radii_are_exact(radius):
    """Quadric by its curvature, Sphere by its amplitude: relative error at rounding, in 60-digit numbers."""
    getcontext().prec = 60
    part = plane((120.0, 80.0), h=20.0, jitter=0.0)
    x, y, _ = (rows(part) - [60, 40, 0]).T
    squared = [Decimal(float(a)) ** 2 + Decimal(float(b)) ** 2 for a, b in zip(x, y, strict=True)]
    exact = [Decimal(radius) - (Decimal(radius) ** 2 - s).sqrt() for s in squared]
    low, high = min(exact), max(exact)
    by_curvature = Quadric(1 / radius, 1 / radius).sample(part)[0]
    by_amplitude = Sphere(float(high - low)).sample(part)[0]
    for found, value in [*zip(by_curvature, exact, strict=True), *zip(by_amplitude, exact, strict=True)]:
        assert abs(Decimal(float(found)) - value) <= Decimal("2e-14") * high


def test_distance_to_a_cylinder_along_the_normals_of_a_cylinder():
    """t = e.n + sqrt(R'² - |e|² + (e.n)²) - R for an axis moved by e; to first order e.n + R' - R."""
    part = tube(20.0, 40.0, h=4.0)
    normals = part.samples.normals
    for size, error in ((1e-1, 3e-4), (1e-2, 3e-6), (1e-3, 3e-8)):
        e = size * np.array([0.6, -0.8, 0.0])
        found = Towards(IdealCylinder(e, [0, 0, 1], 20.0 + size)).sample(part)[0]
        along = normals @ e
        exact = along + np.sqrt((20 + size) ** 2 - e @ e + along**2) - 20
        assert np.allclose(found, exact, atol=1e-11)
        assert np.abs(found - (along + size)).max() < error  # second order


@pytest.mark.parametrize("radius", [1e4, 1e6, 1e8, 1e10])
def test_targets_of_huge_radii_are_exact(radius):
    """The way to a sphere or cylinder along the normals of a plane is the sag, relative error at rounding."""
    part = plane((120.0, 80.0), h=20.0, jitter=0.0)
    x, y, _ = (rows(part) - [60, 40, 0]).T
    found = Towards(IdealSphere([60, 40, radius], radius)).sample(part)[0]
    assert np.allclose(found, biconic_sag(np.hypot(x, y), 0 * y, 1 / radius, 0.0), rtol=1e-13, atol=0)
    found = Towards(IdealCylinder([60, 40, radius], [0, 1, 0], radius)).sample(part)[0]
    assert np.allclose(found, biconic_sag(x, 0 * y, 1 / radius, 0.0), rtol=1e-13, atol=0)


def test_crossings_on_both_sides():
    """From the middle plane of a sphere both ways are as long; off the middle the nearer one counts."""
    points, normals = np.zeros((3, 3)), np.tile([0.0, 0, 1], (3, 1))
    points[:, 0], points[:, 2] = 3.0, [0.0, 1.0, -1.0]
    found = distance_along_normals(points, normals, IdealSphere([0, 0, 0], 5.0))
    assert np.allclose(np.abs(found), [4, 3, 3])
    assert np.allclose(found[1:], [3, -3])
    missed = distance_along_normals(points, normals, IdealPlane([0, 9, 0], [0, 1, 0]))
    assert np.isnan(missed).all()


def test_frames_are_written_and_read():
    model = Paraboloid(0.02, origin=(1.0, 2.0, 3.0), direction=(0.0, 1.0, 0.0), ratio=2.0)
    assert from_dict(model.to_dict()) == model
    assert from_text(str(model)) == model
    assert str(model) == (
        "Paraboloid(amplitude=0.02 mm, origin=(1.0, 2.0, 3.0) mm, direction=(0.0, 1.0, 0.0), ratio=2)"
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"origin": (1.0, 2.0)}, "origin must be three numbers"),
        ({"origin": (1.0, 2.0, np.nan)}, "origin must be finite"),
        ({"direction": (0.0, 0.0, 0.0)}, "direction must not be zero"),
        ({"direction": (0.0, 0.0, 2.0)}, "is normal to plane at the origin of the form"),
    ],
)
def test_bad_frames(options, message):
    for make in (lambda: Paraboloid(0.1, **options), lambda: Quadric(1e-5, 1e-5, **options)):
        with pytest.raises(DeviationError, match=message):
            make().sample(plane((60.0, 40.0), h=6.0))
