"""Darboux frames by quadric fits: exact on quadrics, second order on sphere, torus and a wavy surface."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull, Delaunay

from cadskin.errors import GeometryError
from cadskin.shape.darboux import classify, darboux_frames


def sphere(count, radius=5.0):
    k = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * k / count), np.pi * (1 + np.sqrt(5)) * k
    normals = np.column_stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)])
    triangles = ConvexHull(normals).simplices.astype(np.int64)
    a, b, c = (normals[triangles[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return radius * normals, triangles, normals


def torus(count, major=6.0, minor=2.0):
    """Normals, k1, k2 in closed form."""
    nu, nv = 3 * count, count
    u, v = (
        a.ravel()
        for a in np.meshgrid(np.arange(nu) * 2 * np.pi / nu, np.arange(nv) * 2 * np.pi / nv, indexing="ij")
    )
    u = u + 0.5 * (np.arange(len(u)) % nv % 2) * 2 * np.pi / nu  # break the symmetry of the grid
    normals = np.column_stack([np.cos(u) * np.cos(v), np.sin(u) * np.cos(v), np.sin(v)])
    points = np.column_stack([np.cos(u), np.sin(u), 0 * u]) * major + minor * normals
    i, j = (a.ravel() for a in np.meshgrid(np.arange(nu), np.arange(nv), indexing="ij"))
    a, b = i * nv + j, (i + 1) % nu * nv + j
    c, d = i * nv + (j + 1) % nv, (i + 1) % nu * nv + (j + 1) % nv
    triangles = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])
    k2 = np.full(len(u), -1 / minor)
    k1 = -np.cos(v) / (major + minor * np.cos(v))
    return (
        points,
        triangles,
        normals,
        np.column_stack([k1, k2]),
        np.column_stack([-np.sin(u), np.cos(u), 0 * u]),
    )


def graph(h, height):
    """A graph over the unit square around the origin, irregular."""
    rng = np.random.default_rng(2)
    x, y = (a.ravel() for a in np.meshgrid(np.arange(-1, 1.001, h), np.arange(-1, 1.001, h)))
    flat = np.column_stack([x, y]) + rng.uniform(-0.25, 0.25, (len(x), 2)) * h
    triangles = Delaunay(flat).simplices.astype(np.int64)
    a, b, c = (flat[triangles[:, k]] for k in range(3))
    turn = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    triangles[turn < 0] = triangles[turn < 0][:, ::-1]
    triangles = triangles[np.abs(turn) > 1e-3 * h * h]
    return np.column_stack([flat, height(*flat.T)]), triangles


def test_second_order_on_the_sphere():
    errors = []
    for count in (1000, 4000):
        points, triangles, normals = sphere(count)
        frames = darboux_frames(points, triangles)
        errors.append(np.abs(frames.curvatures + 0.2).max())
        assert np.einsum("ij,ij->i", frames.normals, normals).min() > 1 - 1e-4
    assert errors[1] < 0.3 * errors[0] < 0.3 * 0.01


def test_second_order_on_the_torus():
    errors = []
    for count in (24, 48):
        points, triangles, normals, curvatures, along = torus(count)
        frames = darboux_frames(points, triangles)
        errors.append(np.abs(frames.curvatures - curvatures).max())
        aligned = np.abs(np.einsum("ij,ij->i", frames.directions[:, 0], along))
        assert aligned.min() > 0.99
        assert np.einsum("ij,ij->i", frames.normals, normals).min() > 0.999
    assert errors[1] < 0.35 * errors[0] < 0.35 * 0.05


def test_second_order_on_a_wavy_surface():
    """Interior vertices of z = 0.1 sin(2x) cos(3y) against the exact fundamental forms."""
    errors = []
    for h in (0.08, 0.04):
        points, triangles = graph(h, lambda x, y: 0.1 * np.sin(2 * x) * np.cos(3 * y))
        x, y, _ = points.T
        zx, zy = 0.2 * np.cos(2 * x) * np.cos(3 * y), -0.3 * np.sin(2 * x) * np.sin(3 * y)
        zxx, zyy = -0.4 * np.sin(2 * x) * np.cos(3 * y), -0.9 * np.sin(2 * x) * np.cos(3 * y)
        zxy = -0.6 * np.cos(2 * x) * np.sin(3 * y)
        w = np.sqrt(1 + zx**2 + zy**2)
        gauss = (zxx * zyy - zxy**2) / w**4
        mean = ((1 + zy**2) * zxx - 2 * zx * zy * zxy + (1 + zx**2) * zyy) / (2 * w**3)
        spread = np.sqrt(np.maximum(mean**2 - gauss, 0))
        exact = np.column_stack([mean + spread, mean - spread])
        inside = np.abs(points[:, :2]).max(axis=1) < 0.75
        frames = darboux_frames(points, triangles)
        errors.append(np.abs(frames.curvatures - exact)[inside].max())
        slope = np.column_stack([-zx, -zy, np.ones_like(zx)]) / w[:, None]
        assert np.einsum("ij,ij->i", frames.normals, slope)[inside].min() > 1 - 1e-5
    assert errors[1] < 0.35 * errors[0]


def test_exact_on_a_quadric_and_right_handed():
    points, triangles = graph(0.1, lambda x, y: 0.3 * x**2 - 0.1 * y**2)
    frames = darboux_frames(points, triangles, normals=np.tile([0.0, 0, 1], (len(points), 1)))
    apex = int(np.argmin(np.abs(points[:, :2]).sum(axis=1)))
    slope = np.hypot(0.6 * points[apex, 0], 0.2 * points[apex, 1])
    assert frames.curvatures[apex] == pytest.approx([0.6, -0.2], abs=3 * slope**2)
    handed = np.einsum("ij,ij->i", np.cross(frames.directions[:, 0], frames.directions[:, 1]), frames.normals)
    assert np.allclose(handed, 1, atol=1e-9)
    assert (frames.residual < 1e-7).all()


def test_plane_has_no_curvature():
    points, triangles = graph(0.2, lambda x, y: 0.5 * x)
    frames = darboux_frames(points, triangles)
    assert np.abs(frames.curvatures).max() < 1e-9
    assert np.allclose(frames.normals, np.array([-0.5, 0, 1]) / np.sqrt(1.25), atol=1e-9)
    assert np.isfinite(frames.directions).all()


def test_classification():
    curvatures = np.array([[0, 0], [0.1, 0], [0.0, -0.1], [0.2, 0.1], [-0.1, -0.2], [0.1, -0.1]])
    assert classify(curvatures, flat=1e-3).tolist() == [0, 1, 1, 2, 2, 3]


def test_a_lonely_vertex_is_named():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    with pytest.raises(GeometryError, match="vertex 0 has too few neighbours"):
        darboux_frames(points, np.array([[0, 1, 2]]))
