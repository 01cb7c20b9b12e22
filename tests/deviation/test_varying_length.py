"""Non-stationary fields: the correlation length varies over the surface."""

from __future__ import annotations

import numpy as np
import pytest
from surfaces import ball, correlation_rows, plane

from cadskin.deviation import GaussianField, _surface, correlation
from cadskin.errors import DeviationError

SHORT, LONG = 7.0, 12.0


@pytest.mark.parametrize("kernel", ["squared_exponential", "whittle", "exponential"])
def test_a_constant_array_is_the_stationary_field(kernel):
    part = ball(count=500)
    stationary = GaussianField(0.01, 11.0, kernel, metric="surface").prepare(part)
    varying = GaussianField(0.01, np.full(part.n_samples, 11.0), kernel).prepare(part)
    rows = np.arange(0, part.n_samples, 16)
    assert np.allclose(correlation_rows(varying, rows), correlation_rows(stationary, rows), atol=2e-5)


def two_lengths(points):
    """Short marks on the left, long ones on the right, a smooth change over 20 mm."""
    return SHORT + (LONG - SHORT) / (1.0 + np.exp(-(points[:, 0] - 60.0) / 5.0))


def test_each_side_has_its_own_length():
    """In the middle of either half the exact covariance is that of the field with the local length.

    There the kernel of the plane with that length holds up to what the slow change of the length does.
    """
    part = plane((120.0, 80.0), h=2.0)
    sampler = GaussianField(0.02, two_lengths, "matern52").prepare(part)
    some = np.linspace(0, part.n_samples - 1, 64).astype(int)
    found = correlation_rows(sampler, some)[np.arange(64), some]
    assert np.allclose(found, 1.0, atol=1e-3)  # the variance is right everywhere
    points = part.surface.points[part.samples.vertex_ids]
    for centre, length in (((20.0, 40.0), SHORT), ((94.0, 40.0), LONG)):
        middle = int(np.argmin(np.linalg.norm(points[:, :2] - centre, axis=1)))
        distance = np.linalg.norm(points - points[middle], axis=1)
        near = distance < 1.5 * length
        (row,) = correlation_rows(sampler, [middle])
        assert np.abs(row - correlation(distance, length, "matern52"))[near].max() < 0.01
        other = LONG if length == SHORT else SHORT
        assert np.abs(row - correlation(distance, other, "matern52"))[near].max() > 0.2


def test_sampled_variance_of_large_meshes(monkeypatch):
    """On large meshes the standard deviation is that of 8192 samples: relative error 0.8 % (one sigma)."""
    part = plane((60.0, 40.0), h=2.0)
    lengths = two_lengths(2 * part.surface.points[part.samples.vertex_ids])
    monkeypatch.setattr(_surface, "_GRADED_WORK", 0)
    (field,) = GaussianField(1.0, lengths, "whittle").prepare(part).fields
    deviation = field.scale * np.sqrt(field._row_norms(np.arange(len(field.scale))))
    assert 0.004 < np.sqrt(np.mean((deviation - 1.0) ** 2)) < 0.016
    assert np.abs(deviation - 1.0).max() < 0.045  # 5.7 sigma


def test_bad_lengths():
    part = plane(h=8.0)
    with pytest.raises(DeviationError, match="3 values"):
        GaussianField(0.01, [1.0, 2.0, 3.0]).prepare(part)
    with pytest.raises(DeviationError, match="greater than 0"):
        GaussianField(0.01, [1.0, 0.0])
    for options in ({"metric": "euclidean"}, {"method": "dense"}, {"anisotropy": 2.0}):
        with pytest.raises(DeviationError, match="varying length"):
            GaussianField(0.01, [1.0, 2.0], **options)
