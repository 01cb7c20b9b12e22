"""Signatures of processes: heights by their formulas."""

from __future__ import annotations

import numpy as np
import pytest
from surfaces import ball, plane, tube

from cadskin.deviation import (
    ClampedBow,
    GaussianField,
    LayerSteps,
    Lobing,
    Taper,
    clamped_plate,
    drilled,
    from_dict,
    ground,
    milled,
    printed,
    turned,
)
from cadskin.errors import DeviationError


def test_turned_marks_have_the_height_of_the_feed():
    part = tube(radius=5.0, height=8.0, h=0.25)
    model = turned(feed=2.0, nose_radius=4.0)
    values = model.sample(part)[0]
    assert np.ptp(values) == pytest.approx(2.0**2 / (8 * 4.0), rel=1e-9)
    z = part.surface.points[part.samples.vertex_ids][:, 2]
    assert np.allclose(values[np.abs(z - 1.0) < 1e-9], values[np.abs(z - 3.0) < 1e-9])  # a period apart
    full = turned(feed=2.0, nose_radius=4.0, ovality=0.1, taper=0.05)
    assert [type(term) for term in full.terms[1:]] == [Lobing, Taper]
    assert full.terms[1].lobes == 2


def test_milled_marks():
    values = milled(feed_per_tooth=8.0, diameter=40.0).sample(plane(h=1.0, jitter=0.0))[0]
    assert np.ptp(values) == pytest.approx(0.4, rel=1e-9)


def test_ground_is_rougher_across_the_lay():
    model = ground(sigma="from tolerance", length=6.0, ratio=4.0, lay=(0.0, 1.0, 0.0)).resolved(
        tolerance=0.08
    )
    assert model == GaussianField(
        0.01, 6.0, "exponential", metric="euclidean", anisotropy=4.0, direction=(0.0, 1.0, 0.0)
    )


def test_drilled_has_three_lobes():
    part = tube(radius=5.0, height=10.0, h=0.5)
    values = drilled(lobing=0.02).sample(part)[0]
    points = part.surface.points[part.samples.vertex_ids]
    ring = np.abs(points[:, 2] - 5.0) < 1e-9
    order = np.argsort(np.arctan2(points[ring, 1], points[ring, 0]))
    spectrum = np.abs(np.fft.rfft(values[ring][order]))
    assert spectrum.argmax() == 3
    assert 2 * spectrum[3] / ring.sum() == pytest.approx(0.01, rel=1e-9)


def test_clamped_bow_meets_its_edge_conditions():
    part = plane((40.0, 20.0), h=0.5, jitter=0.0)
    values = clamped_plate(bow=0.3).sample(part)[0]
    x, y = part.surface.points[part.samples.vertex_ids][:, :2].T
    assert values[np.hypot(x - 20, y - 10) < 1e-9] == pytest.approx(0.3)
    edge = (x == 0) | (x == 40) | (y == 0) | (y == 20)
    assert np.abs(values[edge]).max() < 1e-15
    inner = np.abs(x - 0.5) < 1e-9  # one step inside: the slope is zero, the height of second order
    assert values[inner].max() < 0.3 * (4 * 0.5 / 20) ** 2
    assert from_dict(ClampedBow("from tolerance").to_dict()).resolved(tolerance=0.1) == ClampedBow(0.05)


def test_clamped_bow_is_the_quoted_ritz_solution():
    """Its amplitude under uniform load by Ritz's method: 0.00133 q a⁴ / D for a square of side a."""
    s = np.linspace(-1, 1, 41)
    profile = np.polynomial.Polynomial.fit(s, ClampedBow(1.0).height(s, np.zeros(41)), 4, domain=[-1, 1])

    def integral(of):
        return of.integ()(1) - of.integ()(-1)

    bent, squared = integral(profile.deriv(2) ** 2), integral(profile**2)
    across = integral(profile.deriv(1) ** 2)
    amplitude = integral(profile) ** 2 / (2 * bent * squared + 2 * across**2)
    assert amplitude / 16 == pytest.approx(0.00133, abs=5e-6)
    assert amplitude / 16 == pytest.approx(0.00126, rel=0.06)


def brute_force_steps(height, slope, thickness):
    """Distance along the normal of a slope to the outside stairs, by walking."""
    walk = np.linspace(0.0, 1.1 * thickness, 40_001)
    z = height + walk * np.cos(slope)
    x = -height / np.tan(slope) + walk * np.sin(slope)  # the slope rises towards -x
    layer = np.floor(z / thickness)
    reach = -layer * thickness / np.tan(slope)  # the layer covers the material at its bottom
    return walk[np.flatnonzero(x > reach + 1e-12)[0]]


@pytest.mark.parametrize("slope", [0.2, 0.7, 1.2])
def test_layer_steps_against_walking_to_the_stairs(slope):
    thickness = 0.3
    model = LayerSteps(thickness)

    class Face:
        points = np.column_stack([np.zeros(50), np.zeros(50), np.linspace(0.01, 0.89, 50)])
        normals = np.tile([np.sin(slope), 0.0, np.cos(slope)], (50, 1))

    expected = [brute_force_steps(z, slope, thickness) for z in Face.points[:, 2]]
    assert np.allclose(model._on(Face), expected, atol=3e-5)
    turned_over = type("Under", (), {"points": -Face.points, "normals": -Face.normals})
    assert np.allclose(model._on(turned_over), expected, atol=3e-5)


def test_layer_steps_on_a_ball_and_on_flat_faces():
    part = ball(radius=20.0, count=4000)
    values = printed(layer=0.5).sample(part)[0]
    cosine = np.abs(part.samples.normals[:, 2])
    assert (values >= 0).all()
    assert (values <= 0.5 * np.maximum(cosine, 0.0) + 1e-9).all()
    assert values.max() > 0.45
    assert not LayerSteps(0.5).sample(plane())[0].any()  # at z = 0, a layer boundary
    assert not LayerSteps(0.5, (1.0, 0.0, 0.0)).sample(plane())[0].any()  # a wall


@pytest.mark.parametrize(
    "make",
    [
        lambda: turned(feed=0.0, nose_radius=1.0),
        lambda: milled(feed_per_tooth=1.0, diameter=-1.0),
        lambda: LayerSteps(0.1, (0.0, 0.0, 0.0)),
        lambda: LayerSteps(float("nan")),
    ],
)
def test_bad_parameters(make):
    with pytest.raises(DeviationError, match=r"^(turned|milled|LayerSteps): "):
        make()
