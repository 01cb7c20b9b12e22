"""Systematic forms: the sag against high-precision arithmetic, amplitudes, limits, morphing."""

from __future__ import annotations

from decimal import Decimal, getcontext

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from surfaces import ball, plane, tube

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
    morph,
)
from cadskin.deviation.given import distance_along_normals
from cadskin.errors import DeviationError
from cadskin.shape import Plane as IdealPlane
from cadskin.shape import Sphere as IdealSphere


@pytest.fixture(scope="module")
def part():
    return plane((120.0, 80.0), h=4.0)


def centred(part):
    return (part.surface.points[part.samples.vertex_ids] - [60, 40, 0]).T


@pytest.mark.parametrize("radius", [1e2, 1e4, 1e6, 1e8, 1e10])
def test_sag_of_a_sphere_for_huge_radii(radius):
    """1e6 mm is the sphere of 1 km radius: 10 digits are asked, 15 are there."""
    getcontext().prec = 60
    exact = Decimal(radius) - (Decimal(radius) ** 2 - Decimal(60) ** 2).sqrt()
    found = biconic_sag(np.array(60.0), np.array(0.0), 1 / radius, 1 / radius)
    assert abs(Decimal(float(found)) - exact) / exact < Decimal("1e-15") * 4


@pytest.mark.parametrize("form", [Paraboloid, Cone, Sphere, Cylinder, Ellipsoid, Saddle])
@given(amplitude=st.floats(1e-9, 5.0), sign=st.sampled_from([-1, 1]))
@settings(max_examples=25, deadline=None)
def test_peak_to_valley_is_the_amplitude(form, part, amplitude, sign):
    values = form(sign * amplitude).sample(part)[0]
    assert np.ptp(values) == pytest.approx(amplitude, rel=1e-10)
    assert form is Saddle or (sign * values >= -1e-12 * amplitude).all()


def test_forms_lie_on_their_surfaces(part):
    x, y, _ = centred(part)
    z = Sphere(3.0).sample(part)[0]
    rim = np.hypot(x, y)
    radius = (rim.max() ** 2 + z.max() ** 2) / (2 * z.max())
    assert np.allclose(x**2 + y**2 + (z - radius) ** 2, radius**2, rtol=1e-12)
    z = Cylinder(3.0, rotation=np.pi / 2).sample(part)[0]
    radius = (40.0**2 + z.max() ** 2) / (2 * z.max())
    assert np.allclose(y**2 + (z - radius) ** 2, radius**2, rtol=1e-12)
    z = Ellipsoid(3.0, ratio=2.0).sample(part)[0]
    inside = np.sqrt(x**2 + 2 * y**2).max()
    radius = (inside**2 + z.max() ** 2) / (2 * z.max())
    assert np.allclose(x**2 + 2 * y**2 + (z - radius) ** 2, radius**2, rtol=1e-12)
    z = Cone(3.0).sample(part)[0]
    assert np.allclose(z / rim, z.max() / rim.max(), rtol=1e-12)


def test_round_forms_meet_the_paraboloid_when_flat(part):
    flat = Paraboloid(1e-6).sample(part)
    assert np.abs(Sphere(1e-6).sample(part) - flat).max() < 1e-14
    assert np.array_equal(Saddle(0.1).sample(part), Paraboloid(0.1, ratio=-1.0).sample(part))
    assert (Sphere(0.0).sample(part) == 0).all()


def test_too_much_amplitude_is_refused(part):
    with pytest.raises(DeviationError, match="too small for this amplitude, the most is 7"):
        Sphere(100.0).sample(part)


def test_quadric(part):
    x, y, _ = centred(part)
    quadric = Quadric(1e-5, -2e-5, conic=-1.0).sample(part)[0]
    assert np.allclose(quadric, (1e-5 * x**2 - 2e-5 * y**2) / 2, atol=1e-16)
    turned = Quadric(1e-5, 0.0, angle=np.pi / 2, conic=-1.0).sample(part)[0]
    assert np.allclose(turned, 1e-5 * y**2 / 2, atol=1e-16)
    with pytest.raises(DeviationError, match="beyond the equator"):
        Quadric(0.1, 0.1).sample(part)


def test_morphing_passes_through_both_ends(part):
    a, b = Sphere(0.05), Saddle(0.02)
    assert np.allclose(morph(a, b, 0.0).sample(part), a.sample(part))
    assert np.allclose(morph(a, b, 1.0).sample(part), b.sample(part))
    assert np.allclose(morph(a, b, 0.5).sample(part), 0.5 * (a.sample(part) + b.sample(part)))


@pytest.mark.parametrize("form", [Paraboloid(0.05), Cone(0.05), Sphere(0.05), Ellipsoid(0.05), Saddle(0.05)])
def test_forms_on_curved_features(form):
    for part in (tube(20.0, 60.0, h=3.0, turn=1.5), ball(20.0, 300)):
        assert np.ptp(form.sample(part)) == pytest.approx(0.05, rel=1e-9)


def test_distance_to_a_target_agrees_with_the_height_to_first_order(part):
    """The intersection along the normal is the height on a plane, and differs at second order when tilted."""
    x, y, _ = centred(part)
    sphere = IdealSphere([60, 40, 1e4], 1e4)
    values = Towards(sphere).sample(part)[0]
    assert np.allclose(values, biconic_sag(np.hypot(x, y), 0 * y, 1e-4, 1e-4), rtol=1e-9, atol=1e-11)
    assert np.allclose(Towards(sphere, share=0.25).sample(part)[0], 0.25 * values)
    points = part.surface.points
    for tilt in (0.02, 0.01):
        normals = np.tile([np.sin(tilt), 0, np.cos(tilt)], (len(points), 1))
        along = distance_along_normals(points, normals, IdealPlane([0, 0, 1], [0, 0, 1]))
        assert np.abs(along - 1).max() == pytest.approx(tilt**2 / 2, rel=1e-3)


def test_a_normal_that_misses_is_named(part):
    with pytest.raises(DeviationError, match=r"normals of plane do not meet the sphere; restrict"):
        Towards(IdealSphere([0, 0, 5], 3.0)).sample(part)


def test_target_round_trip():
    model = Towards(IdealSphere([0, 0, 5], 3.0), share=0.5)
    assert from_dict(model.to_dict()) == model
    assert model.to_dict() == {
        "towards": {"target": {"kind": "sphere", "centre": [0.0, 0.0, 5.0], "radius": 3.0}, "share": 0.5}
    }
