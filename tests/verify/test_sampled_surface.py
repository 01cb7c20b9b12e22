"""Distances from a sampled freeform surface against a torus, whose distances are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from cadskin.verify.sampled import sampled_closest

MAJOR, MINOR = 30.0, 8.0


def torus(u, v):
    """Points, normals, principal curvatures and directions of the outer part of a torus."""
    zero = np.zeros_like(u)
    ring = np.column_stack([np.cos(u), np.sin(u), zero])
    up = np.array([0.0, 0.0, 1.0])
    normals = np.cos(v)[:, None] * ring + np.sin(v)[:, None] * up
    points = MAJOR * ring + MINOR * normals
    bends = np.column_stack([np.full_like(u, -1 / MINOR), -np.cos(v) / (MAJOR + MINOR * np.cos(v))])
    around = np.column_stack([-np.sin(u), np.cos(u), zero])
    along = -np.sin(v)[:, None] * ring + np.cos(v)[:, None] * up
    return points, normals, bends, np.stack([along, around], axis=1)


def worst_error(n, height, rng):
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, n), np.linspace(-1, 1, n // 2)))
    closest = sampled_closest(*torus(u, v))
    points, normals, _, _ = torus(rng.uniform(0.1, 0.9, 3000), rng.uniform(-0.9, 0.9, 3000))
    away = rng.uniform(-height, height, 3000)
    found, directions = closest(points + away[:, None] * normals)
    return np.abs(found - away).max(), np.abs(directions - normals).max()


def test_error_is_what_the_documentation_says():
    value, direction = worst_error(40, 0.1, np.random.default_rng(0))
    assert value < 2e-6
    assert direction < 1e-5


def test_error_falls_with_a_high_power_of_the_spacing():
    rng = np.random.default_rng(1)
    coarse, _ = worst_error(30, 0.05, rng)
    fine, _ = worst_error(60, 0.05, rng)
    assert np.log2(coarse / fine) > 4.0


@pytest.mark.parametrize("height", [0.0, 0.5])
def test_exact_over_the_samples(height):
    """Along the normal of a sample the foot is the sample itself, also far out (a skin model)."""
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, 20), np.linspace(-1, 1, 10)))
    points, normals, bends, directions = torus(u, v)
    found, _ = sampled_closest(points, normals, bends, directions)(points + height * normals)
    np.testing.assert_allclose(found, height, atol=1e-12)


def test_few_samples_and_a_second_sheet_do_no_harm():
    flat = np.array([[0, 0, 0], [1.0, 0, 0], [0, 1.0, 0]])
    up = np.tile([0.0, 0.0, 1.0], (3, 1))
    axes = np.tile(np.eye(3)[:2], (3, 1, 1))
    found, _ = sampled_closest(flat, up, np.zeros((3, 2)), axes)(np.array([[0.3, 0.2, 0.7]]))
    assert found == pytest.approx([0.7])
    grid = np.stack(np.meshgrid(np.arange(6.0), np.arange(6.0)), axis=-1).reshape(-1, 2)
    above = np.column_stack([grid, np.full(36, 0.2)])
    below = np.column_stack([grid, np.zeros(36)])
    normals = np.repeat([[0.0, 0, 1.0], [0.0, 0, -1.0]], 36, axis=0)
    closest = sampled_closest(
        np.concatenate([above, below]), normals, np.zeros((72, 2)), np.tile(np.eye(3)[:2], (72, 1, 1))
    )
    found, _ = closest(np.array([[2.4, 2.6, 0.25], [2.4, 2.6, -0.1]]))
    np.testing.assert_allclose(found, [0.05, 0.1], atol=1e-9)
