"""The remeshing kernel keeps the boundary and the domain, and reaches the wanted size."""

import logging

import numpy as np
import pytest
from scipy.spatial import Delaunay

from cadskin.cad.meshing import kernel
from cadskin.cad.meshing._flips import flip
from cadskin.cad.meshing._splits import split
from cadskin.cad.meshing.check import BOUNDARY, half_edge_twins
from cadskin.cad.meshing.kernel import Metric, remesh

FLAT = Metric(np.array([[[1.0, 0.0, 1.0]]]), np.zeros(4))


def polygon(n=40, radius=10.0):
    angle = 2 * np.pi * np.arange(n) / n
    nodes = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    triangles = Delaunay(nodes).simplices.astype(np.int64)
    turned = signed_areas(nodes, triangles) < 0
    triangles[turned] = triangles[turned, ::-1]
    twin = half_edge_twins(triangles, n)
    return nodes, triangles, np.where(twin >= 0, twin // 3, -1).reshape(-1, 3)


def signed_areas(nodes, triangles):
    a, b, c = (nodes[triangles[:, k]] for k in range(3))
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def run(metric=FLAT, target=1.5, capacity=500):
    nodes, triangles, neighbours = polygon()
    return nodes, remesh(
        nodes,
        np.full(len(nodes), target),
        len(nodes),
        triangles,
        neighbours,
        np.zeros((len(triangles), 3), np.uint8),
        metric=metric,
        target=target,
        capacity=capacity,
    )


@pytest.mark.parametrize("capacity", [500, 8])
def test_boundary_and_area_stay_and_no_triangle_is_turned(capacity):
    before, (nodes, triangles) = run(capacity=capacity)
    np.testing.assert_array_equal(nodes[: len(before)], before)
    areas = signed_areas(nodes, triangles)
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(0.5 * 40 * 100 * np.sin(2 * np.pi / 40), rel=1e-12)
    assert (half_edge_twins(triangles, len(nodes)) == BOUNDARY).sum() == 40


def test_sides_have_the_wanted_length():
    _, (nodes, triangles) = run()
    sides = np.linalg.norm(nodes[triangles] - nodes[np.roll(triangles, -1, axis=1)], axis=2)
    assert 0.8 < np.median(sides) / 1.5 < 1.2
    assert sides.max() < 1.6 * 1.5


def test_a_stretched_metric_stretches_the_triangles():
    stretched = Metric(np.array([[[9.0, 0.0, 1.0]]]), np.zeros(4))
    before, (nodes, triangles) = run(stretched)
    inner = triangles[(triangles >= len(before)).all(axis=1)]
    sides = (nodes[inner] - nodes[np.roll(inner, -1, axis=1)]).reshape(-1, 2)
    across, along = np.sqrt((sides**2).mean(axis=0))  # of equilateral triangles, however they are turned
    assert along / across == pytest.approx(3.0, rel=0.05)


def test_flip_and_split_keep_the_adjacency():
    triangles = np.full((4, 3), -1, dtype=np.int64)
    triangles[:2] = [[0, 1, 2], [0, 2, 3]]
    neighbours = np.full((4, 3), -1, dtype=np.int64)
    neighbours[0, 2], neighbours[1, 0] = 1, 0
    locked = np.zeros((4, 3), np.uint8)
    triangle_of = np.array([0, 0, 0, 1, -1])
    flip(triangles, neighbours, locked, triangle_of, 0, 2, 1, 0)
    assert {tuple(sorted(row)) for row in triangles[:2].tolist()} == {(0, 1, 3), (1, 2, 3)}
    side = next(i for i in range(3) if neighbours[0, i] == 1)
    split(triangles, neighbours, locked, triangle_of, 0, side, 4, 2)
    twin = half_edge_twins(triangles, 5)
    np.testing.assert_array_equal(np.where(twin >= 0, twin // 3, -1).reshape(-1, 3), neighbours)


def test_compiling_is_announced(caplog, monkeypatch):
    monkeypatch.setattr(kernel, "is_compiled", lambda: False)
    with caplog.at_level(logging.INFO, logger="cadskin.cad.meshing.kernel"):
        kernel.warm()
    assert "compiling the meshing kernels" in caplog.text
    monkeypatch.undo()
    assert kernel.is_compiled()
