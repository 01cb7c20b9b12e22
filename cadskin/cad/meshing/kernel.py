"""The remeshing kernel: from a triangulation of a face to triangles of the wanted size."""

# Kernels take their arrays one by one: a structure of arrays would be one more type to compile.
# ruff: noqa: PLR0913

from __future__ import annotations

import logging
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from cadskin._jit import kernel
from cadskin._typing import Floats
from cadskin.cad.meshing._collapses import collapse_short
from cadskin.cad.meshing._flips import delaunay_flips, even_valence
from cadskin.cad.meshing._shapes import improve_shape
from cadskin.cad.meshing._smoothing import grade, smooth
from cadskin.cad.meshing._splits import split_long

__all__ = ["Metric", "is_compiled", "remesh", "warm"]

_log = logging.getLogger(__name__)

GRADING = 0.22
TOO_LONG = 1.4
TOO_SHORT = 0.7
SHAPE_SWEEPS = 8


@dataclass(frozen=True, eq=False)
class Metric:
    """The first fundamental form over the parameter box of a face.

    Parameters
    ----------
    grid : (nu, nv, 3) float
        E, F, G at regular points; one point only where the metric is constant.
    placing : (4,) float
        Lower corner of the box, then points per unit in u and v.
    """

    grid: Floats
    placing: Floats


@kernel
def remesh_arrays(
    position: Any,
    size: Any,
    fixed: Any,
    triangles: Any,
    neighbours: Any,
    locked: Any,
    counts: Any,
    grid: Any,
    placing: Any,
    settings: Any,
) -> None:
    """Split, collapse, flip and smooth in place.

    ``counts`` holds the numbers of nodes and of triangles in use, and becomes 1 at index 2 when the arrays
    were too short. ``settings``: target size, grading, too short, too long, iterations.
    """
    target = settings[0]
    grading = settings[1]
    short = settings[2]
    long = settings[3]
    iterations = int(settings[4])
    triangle_of = np.full(position.shape[0], -1, np.int64)
    awake = np.ones(position.shape[0], np.uint8)
    for t in range(counts[1]):
        for i in range(3):
            triangle_of[triangles[t, i]] = t
    delaunay_flips(position, triangles, neighbours, locked, triangle_of, counts[1], grid, placing, awake, 30)
    grade(position, size, fixed, triangles, counts[1], grid, placing, grading, 10)
    for iteration in range(iterations):
        awake[:] = 1
        for _ in range(30):
            n = split_long(
                position, size, fixed, triangles, neighbours, locked, triangle_of, counts, grid, placing,
                target, grading, long,
            )  # fmt: skip
            if n == 0 or counts[2]:
                break
            delaunay_flips(
                position, triangles, neighbours, locked, triangle_of, counts[1], grid, placing, awake, 5
            )
        collapse_short(
            position, size, fixed, triangles, neighbours, locked, triangle_of, counts[0], grid, placing,
            short, long,
        )  # fmt: skip
        delaunay_flips(
            position, triangles, neighbours, locked, triangle_of, counts[1], grid, placing, awake, 8
        )
        if iteration < iterations - 1:
            even_valence(
                position, fixed, triangles, neighbours, locked, triangle_of, counts[0], counts[1], grid,
                placing,
            )  # fmt: skip
        for _ in range(3):
            smooth(
                position, size, fixed, triangles, neighbours, triangle_of, counts[0], grid, placing,
                awake, iteration > 0,
            )  # fmt: skip
        delaunay_flips(
            position, triangles, neighbours, locked, triangle_of, counts[1], grid, placing, awake, 8
        )
        grade(position, size, fixed, triangles, counts[1], grid, placing, grading, 1)
    awake[:] = 1
    for k in range(4):
        smooth(
            position, size, fixed, triangles, neighbours, triangle_of, counts[0], grid, placing, awake, True
        )
        n = delaunay_flips(
            position, triangles, neighbours, locked, triangle_of, counts[1], grid, placing, awake, 5
        )
        if n == 0 and k > 1:
            break
    awake[:] = 1
    for _ in range(SHAPE_SWEEPS):
        n = improve_shape(
            position, size, fixed, triangles, neighbours, triangle_of, counts[0], grid, placing, awake
        )
        n += delaunay_flips(
            position, triangles, neighbours, locked, triangle_of, counts[1], grid, placing, awake, 5
        )
        if n == 0:
            break


@kernel
def compact(position: Any, triangles: Any, counts: Any, n_fixed: int, new_id: Any) -> None:
    """Squeeze out free rows and unused nodes in place; the first ``n_fixed`` nodes keep their numbers."""
    new_id[:] = -1
    rows = 0
    for t in range(counts[1]):
        if triangles[t, 0] >= 0:
            for i in range(3):
                triangles[rows, i] = triangles[t, i]
                new_id[triangles[t, i]] = 0
            rows += 1
    counts[1] = rows
    nodes = n_fixed
    for v in range(counts[0]):
        if v < n_fixed:
            new_id[v] = v
        elif new_id[v] == 0:
            new_id[v] = nodes
            position[nodes, 0] = position[v, 0]
            position[nodes, 1] = position[v, 1]
            nodes += 1
    counts[0] = nodes
    for t in range(rows):
        for i in range(3):
            triangles[t, i] = new_id[triangles[t, i]]


def remesh(
    position: Floats,
    size: Floats,
    n_fixed: int,
    triangles: Any,
    neighbours: Any,
    locked: Any,
    *,
    metric: Metric,
    target: float,
    capacity: int,
    iterations: int = 4,
) -> tuple[Floats, Any]:
    """Remesh a planar triangulation to a wanted edge length in the metric of its surface.

    Parameters
    ----------
    position : (n, 2) float
        Nodes in the parameter plane; the first ``n_fixed`` lie on the boundary and stay.
    size : (n,) float
        Wanted edge length at each node [mm].
    triangles, neighbours : (m, 3) int
        Counter-clockwise; neighbour i across the side (i, i + 1), -1 outside.
    locked : (m, 3) uint8
        Sides inside the domain that must stay.
    metric : Metric
    target : float
        Largest wanted edge length [mm].
    capacity : int
        Expected number of nodes; it is doubled where it turns out to be too small.

    Returns
    -------
    position : (k, 2) float
        The fixed nodes first.
    triangles : (l, 3) int
    """
    settings = np.array([target, GRADING, TOO_SHORT, TOO_LONG, float(iterations)])
    n, m = len(position), len(triangles)
    while True:
        nodes = np.zeros((capacity + n, 2))
        sizes = np.zeros(capacity + n)
        fixed = np.zeros(capacity + n, np.uint8)
        rows = 2 * capacity + m
        work = np.full((2, rows, 3), -1, np.int64)
        locks = np.zeros((rows, 3), np.uint8)
        nodes[:n], sizes[:n], fixed[:n_fixed] = position, size, 1
        work[0, :m], work[1, :m], locks[:m] = triangles, neighbours, locked
        counts = np.array([n, m, 0], dtype=np.int64)
        arrays = nodes, sizes, fixed, work[0], work[1], locks, counts
        remesh_arrays(*arrays, metric.grid, metric.placing, settings)
        if not counts[2]:
            break
        capacity = 2 * capacity + n
    compact(nodes, work[0], counts, n_fixed, np.zeros(len(nodes), np.int64))
    return nodes[: counts[0]].copy(), work[0, : counts[1]].copy()


def is_compiled() -> bool:
    """Say whether the kernel is in memory or in the cache on disk: its first use then compiles nothing.

    Examples
    --------
    >>> isinstance(is_compiled(), bool)
    True
    """
    dispatcher: Any = remesh_arrays
    if dispatcher.signatures:
        return True
    cache_file = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    return cache_file is not None and bool(cache_file._load_index())


def warm() -> float:
    """Compile the kernels, or load them from the cache; return the seconds that took.

    Examples
    --------
    >>> warm() >= 0.0
    True
    """
    started = time.perf_counter()
    if not is_compiled():
        _log.info("compiling the meshing kernels, once (about 20 s)")
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    remesh(
        square,
        np.full(4, 0.5),
        4,
        np.array([[0, 1, 2], [0, 2, 3]]),
        np.array([[-1, -1, 1], [0, -1, -1]]),
        np.zeros((2, 3), np.uint8),
        metric=Metric(np.array([[[1.0, 0.0, 1.0]]]), np.zeros(4)),
        target=0.5,
        capacity=64,
    )
    return time.perf_counter() - started
