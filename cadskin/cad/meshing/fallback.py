"""A last resort that keeps the mesh closed: a face is filled from its boundary points alone."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from cadskin._typing import Floats, Ints, Points, Triangles
from cadskin.cad.meshing.domain import Domain, FaceProblem
from cadskin.cad.meshing.edges import EdgeCurve, EdgeSamples
from cadskin.cad.meshing.face import FaceMesh
from cadskin.cad.meshing.topology import EdgeUse
from cadskin.cad.surface import FaceSurface

__all__ = ["fill_from_boundary"]

_EARS_TRIED = 40


def fill_from_boundary(
    index: int,
    surface: FaceSurface,
    uses: Sequence[EdgeUse],
    curves: Sequence[EdgeCurve],
    samples: Sequence[EdgeSamples],
    reason: str,
) -> FaceMesh:
    """Triangulate the loops of a face by ear clipping, each boundary segment once, no inner points.

    The loops follow the wires in space, not in the parameter plane, so it works where parameters are useless.
    Seams and degenerate edges bound nothing in space and are left out.

    Raises
    ------
    FaceProblem
        No loop is left (a face that only a seam bounds).
    """
    domain = _space_domain(uses, curves, samples)
    flat = best_fit_plane(domain.points)
    loops = [np.array(loop) for loop in _loops(domain.segments)]
    if not loops:
        raise FaceProblem("the face has no boundary loop in space")
    polygon = _one_polygon(loops, flat)
    triangles = clip_ears(polygon, flat, domain.points)
    nan = np.full((len(domain.points), 6, 3), np.nan)
    nan[:, 0] = domain.points
    corners = domain.points[triangles]
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * float(np.linalg.norm(doubled, axis=1).sum())
    return FaceMesh(index, surface, domain, domain.uv, triangles, domain.points, nan, area, (), reason)


def _space_domain(
    uses: Sequence[EdgeUse], curves: Sequence[EdgeCurve], samples: Sequence[EdgeSamples]
) -> Domain:
    times_used = {use.edge: sum(other.edge == use.edge for other in uses) for use in uses}
    node_ids: dict[tuple[int, int], int] = {}
    nodes: list[tuple[int, int]] = []
    vertex_ids: list[int] = []
    points: list[Points] = []
    segments: list[tuple[int, int]] = []
    edges: list[int] = []
    for use in uses:
        curve, sample = curves[use.edge], samples[use.edge]
        if curve.degenerate or times_used[use.edge] > 1:
            continue
        chain = []
        for place in range(sample.n_segments + 1):
            vertex = {0: int(curve.ends[0]), sample.n_segments: int(curve.ends[1])}.get(place, -1)
            key = (-1, vertex) if vertex >= 0 else (use.edge, place)
            if key not in node_ids:
                node_ids[key] = len(nodes)
                nodes.append((use.edge, place))
                vertex_ids.append(vertex)
                points.append(sample.points[place])
            chain.append(node_ids[key])
        steps = list(pairwise(chain))
        segments += steps if use.forward else [(b, a) for a, b in steps]
        edges += [use.edge] * sample.n_segments
    return Domain(
        uv=np.full((len(nodes), 2), np.nan),
        nodes=np.array(nodes, dtype=np.int64).reshape(-1, 2),
        vertex_ids=np.array(vertex_ids, dtype=np.int64),
        points=np.array(points).reshape(-1, 3),
        sizes=np.ones(len(nodes)),
        segments=np.array(segments, dtype=np.int64).reshape(-1, 2),
        segment_edges=np.array(edges, dtype=np.int64),
        reprojected=0,
    )


def _loops(segments: Ints) -> list[list[int]]:
    """Walk the directed segments; a vertex that is met twice closes a loop of its own."""
    after: dict[int, list[int]] = {}
    for a, b in segments.tolist():
        after.setdefault(a, []).append(b)
    loops: list[list[int]] = []
    for start in list(after):
        while after[start]:
            path = [start]
            place = {start: 0}
            node = after[start].pop()
            while True:
                if node in place:
                    loops.append(path[place[node] :])
                    for dropped in path[place[node] + 1 :]:
                        del place[dropped]
                    path = path[: place[node] + 1]
                    if len(path) == 1:
                        break
                else:
                    place[node] = len(path)
                    path.append(node)
                if not after.get(node):
                    raise FaceProblem("the wires of the face do not close")
                node = after[node].pop()
    return [loop for loop in loops if len(loop) > 1]


def best_fit_plane(points: Points) -> Floats:
    """Return coordinates (n, 2) of points in their plane of least squares."""
    if not len(points):
        return np.zeros((0, 2))
    centred = points - points.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    return np.asarray(centred @ axes[:2].T)


def _one_polygon(loops: list[Ints], flat: Floats) -> list[int]:
    """Join the loops into one polygon through bridges between their nearest nodes."""
    loops = sorted(loops, key=lambda loop: -abs(_area(flat[loop])))
    polygon: list[int] = loops[0].tolist()
    for hole in loops[1:]:
        gaps = ((flat[polygon][:, None] - flat[hole][None]) ** 2).sum(axis=2)
        i, j = np.unravel_index(int(gaps.argmin()), gaps.shape)
        ring = [*hole[j:].tolist(), *hole[: j + 1].tolist()]
        polygon = polygon[: i + 1] + ring + polygon[i:]
    return polygon


def _area(loop: Floats) -> float:
    x, y = loop.T
    return 0.5 * float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


def clip_ears(polygon: list[int], flat: Floats, points: Points) -> Triangles:
    """Cut a polygon into triangles, best convex empty ear first; where there is none, the best of all."""
    polygon = list(polygon)
    turn = 1.0 if _area(flat[polygon]) >= 0 else -1.0
    triangles = []
    while len(polygon) > 3:
        k = _best_ear(polygon, flat, points, turn)
        triangles.append((polygon[k - 1], polygon[k], polygon[(k + 1) % len(polygon)]))
        polygon.pop(k)
    triangles.append((polygon[0], polygon[1], polygon[-1]))
    return np.array(triangles, dtype=np.int64)


def _best_ear(polygon: list[int], flat: Floats, points: Points, turn: float) -> int:
    here, before, after = flat[polygon], np.roll(flat[polygon], 1, axis=0), np.roll(flat[polygon], -1, axis=0)
    convex = turn * _cross(here - before, after - before)
    space = points[polygon]
    to_before, to_after = np.roll(space, 1, axis=0) - space, np.roll(space, -1, axis=0) - space
    doubled = np.linalg.norm(np.cross(to_before, to_after), axis=1)
    squares = (to_before**2 + to_after**2 + (to_before - to_after) ** 2).sum(axis=1)
    score = doubled / np.maximum(squares, 1e-300) - (convex <= 0)
    for k in np.argsort(-score)[:_EARS_TRIED].tolist():
        if convex[k] <= 0:
            break
        sides = ((before[k], here[k]), (here[k], after[k]), (after[k], before[k]))
        inside = np.ones(len(polygon), dtype=bool)
        for start, end in sides:
            inside &= turn * _cross(end - start, here - start) > 0
        if not inside.any():
            return int(k)
    return int(np.argmax(score))


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
