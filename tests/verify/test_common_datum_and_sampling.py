"""Common datum axes, and the estimate of what sampling misses."""

from __future__ import annotations

import numpy as np
import pytest

from cadskin.errors import GeometryError
from cadskin.shape.association import rotation
from cadskin.verify import DatumFeature, establish, flatness
from cadskin.verify.sampling import sampling_shortfall


def seat(radius, z0, centre, rng):
    angle, z = rng.uniform(0, 2 * np.pi, 300), z0 + rng.uniform(-5, 5, 300)
    r = radius + rng.uniform(-0.01, 0.0, 300)
    angle[:3], r[:3] = 2 * np.pi * np.arange(3) / 3, radius  # three contacts around each end of each seat
    z[:3] = z0 - 5
    angle[3:6], r[3:6], z[3:6] = angle[:3] + 0.3, radius, z0 + 5
    return np.column_stack([centre[0] + r * np.cos(angle), centre[1] + r * np.sin(angle), z])


def test_common_axis_runs_through_both_seats():
    """Seats of radius 10 and 15, each touching its circle all around: their centres define the axis."""
    rng = np.random.default_rng(0)
    lean = 0.001
    first, second = seat(10.0, 0.0, (0.0, 0.0), rng), seat(15.0, 100.0, (0.0, 0.0), rng)
    points = np.concatenate([first, second]) @ rotation(np.array([0.0, lean, 0.0])).T
    radii = np.repeat([10.0, 15.0], 300)
    feature = DatumFeature("A-B", "cylinder", points, hint=np.array([0.0, 0, 1]), radii=radii)
    frame = establish([feature])
    expected = rotation(np.array([0.0, lean, 0.0]))[:, 2]
    np.testing.assert_allclose(frame.axes[:, 2], expected, atol=1e-9)
    assert frame.certified
    assert frame.datums[0].label == "A-B"


def test_shortfall_of_a_wave_is_about_what_is_missing():
    """8 points per wave, waves that do not fit the grid: the estimate has the order of the true shortfall."""
    rng = np.random.default_rng(1)
    ticks = np.linspace(0, 100, 21)
    x, y = (a.ravel() for a in np.meshgrid(ticks, ticks))

    def wavy(u, v, phase):
        return 0.05 * np.sin(2 * np.pi * u / 41.7 + phase[0]) * np.sin(2 * np.pi * v / 38.3 + phase[1])

    estimates, truths = [], []
    for _ in range(12):
        phase = rng.uniform(0, 2 * np.pi, 2)
        value, shortfall = sampling_shortfall(
            np.column_stack([x, y, wavy(x, y, phase)]), lambda p: flatness(p).value, subsets=4
        )
        estimates.append(shortfall)
        truths.append(0.1 - value)
    assert np.mean(truths) > 0
    assert 0.2 < np.mean(estimates) / np.mean(truths) < 5.0


def test_too_few_points_for_an_estimate():
    with pytest.raises(GeometryError, match="64"):
        sampling_shortfall(np.zeros((10, 3)), lambda p: 0.0)
