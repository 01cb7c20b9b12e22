"""The compiled innermost loops against numpy."""

from __future__ import annotations

import numpy as np
import pytest
from numba.core.errors import TypingError

from cadskin.deviation import _lanes, _linear
from cadskin.deviation._grid import _interpolate
from cadskin.deviation._kriging import _prolong, _sequential

COLUMNS = _lanes.COLUMNS
RNG = np.random.default_rng(3)


def floats(*shape):
    return RNG.standard_normal(shape).astype(np.float32)


@pytest.mark.parametrize("count", [1, 15, 16, 100])
def test_rows_become_columns(count):
    rows = floats(COLUMNS, count + 7)[:, 3 : count + 3]
    assert np.array_equal(_linear.columns_of(rows), rows.T)


@pytest.mark.parametrize("rows", [COLUMNS, 5])
@pytest.mark.parametrize("jump", [0, 1])
def test_columns_are_written_to_samples(rows, jump):
    columns = floats(90, COLUMNS)
    samples = np.arange(70, dtype=np.uint32) + 4
    samples[40:] += jump
    places = RNG.permutation(90)[:70].astype(np.uint32)
    scale = RNG.uniform(1, 2, 70)
    out = np.full((rows, 80), np.nan)
    _linear.write_columns(columns, places, scale, samples, out)
    assert np.array_equal(out[:, samples], (scale[:, None] * columns[places].astype(float))[:, :rows].T)
    assert np.isnan(np.delete(out, samples, axis=1)).all()


@pytest.mark.parametrize("start", [0, 5])
def test_rows_are_spread_to_samples(start):
    rows = floats(COLUMNS, 200)
    places, samples = np.arange(150) + start, np.arange(150)
    places[100:] = places[100:][::-1]
    scale = RNG.uniform(1, 2, 150)
    out = np.zeros((COLUMNS, 150))
    _linear.spread(rows, places.astype(np.uint32), scale, samples.astype(np.uint32), out)
    assert np.array_equal(out, scale * rows[:, places].astype(float))


@pytest.mark.parametrize(("count", "terms", "triangular"), [(7, 3, False), (30, 30, True), (9, 40, False)])
def test_matrix_product(count, terms, triangular):
    weights, rows = floats(count, terms), floats(terms, COLUMNS)
    if triangular:
        weights = np.tril(weights)
    out = np.full((count, COLUMNS), np.nan, dtype=np.float32)
    _linear.matrix_product(weights, rows, triangular, out)
    assert np.allclose(out, weights.astype(float) @ rows, atol=1e-5)


def test_sequential_values():
    count, width = 50, 8
    ids = np.zeros((count, width), dtype=np.uint32)
    weights = np.zeros((count, width), dtype=np.float32)
    for i in range(1, count):
        ids[i, : min(i, width)] = RNG.permutation(i)[:width]
        weights[i, : min(i, width)] = 0.3 * floats(min(i, width))
    deviation, noise = np.abs(floats(count)) + 0.1, floats(count, COLUMNS)
    expected = np.zeros((count, COLUMNS))
    for i in range(count):
        expected[i] = deviation[i] * noise[i] + weights[i] @ expected[ids[i]]
    values = noise.copy()
    _sequential(ids[:20], weights[:20], deviation[:20], 0, values)
    _sequential(ids[20:], weights[20:], deviation[20:], 20, values)
    assert np.allclose(values, expected, atol=1e-4)


def test_prolongation():
    ids, weights = RNG.integers(0, 30, (100, 16)).astype(np.uint32), floats(100, 16)
    coarse, scale = floats(30, COLUMNS), RNG.uniform(1, 2, 90)
    places, samples = RNG.permutation(100)[:90].astype(np.uint32), np.arange(90, dtype=np.uint32)
    out = np.zeros((COLUMNS, 90))
    _prolong(ids, weights, coarse, places, scale, samples, out)
    expected = np.einsum("ik,ikr->ri", weights[places], coarse.astype(float)[ids[places]])
    assert np.allclose(out, scale * expected, atol=1e-4)


@pytest.mark.parametrize("shape", [(6, 9), (5, 6, 7)])
def test_interpolation_on_a_grid(shape):
    """Four nodes of each axis, their weights multiplied."""
    d = len(shape)
    values = floats(*shape, COLUMNS)
    corner = np.stack([RNG.integers(0, n - 3, 20) for n in shape], axis=1)
    weights = floats(20, d, 4)
    strides = np.array([int(np.prod(shape[k + 1 :])) for k in range(d)])
    everything, out = np.arange(20, dtype=np.uint32), np.zeros((COLUMNS, 20))
    first = (corner @ strides).astype(np.uint32)
    flat = values.reshape(-1, COLUMNS)
    _interpolate(flat, first, strides, weights, everything, np.ones(20), everything, out)
    for i in range(20):
        block = values[tuple(slice(c, c + 4) for c in corner[i])].astype(float)
        for k in range(d):
            block = np.tensordot(weights[i, k].astype(float), block, axes=1)
        assert np.allclose(out[:, i], block, atol=1e-4)


def test_other_numbers_are_refused():
    """The instructions read memory as float32: anything else must not compile."""
    with pytest.raises(TypingError, match="expected a contiguous array of float32"):
        _linear.matrix_product(np.ones((2, 2)), floats(2, COLUMNS), False, floats(2, COLUMNS))
    with pytest.raises(TypingError, match="expected a contiguous array of uint32"):
        _linear.write_columns(
            floats(2, COLUMNS), np.arange(2), np.ones(2), np.arange(2, dtype=np.uint32), np.zeros((2, 2))
        )
