"""A collar that carries a surface on beyond its free edges, known by its lengths alone.

The Laplace-Beltrami operator sees only lengths along the surface, so the collar need not fit into space: it
may run over itself in a hole. Every boundary edge e gets rows of trapezoids whose length at the distance D is
e + D phi, phi the turning of the boundary along the edge; a flat face continues flat. At concave corners the
turning is spread over 2 D, as the strips of both sides overlap there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array

from cadskin.shape.operators import cotangent_laplacian, lumped_mass

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points, Triangles

__all__ = ["Collar", "boundary_loops", "make_collar"]

WIDTH = 2.0  # correlation lengths
_GROWTH = 1.2  # of the height of the rows
_LEAST = 0.1  # of the length of a loop: a collar that shrinks further, in a hole, ends
_EVEN = 1.0  # mean edges to both sides over which the turning is evened out: jagged edges are no corners
_THIN = 0.02  # of an edge: the least length that it shrinks to


@dataclass(frozen=True, eq=False)
class Collar:
    """Unknowns beyond the free edges; they follow those of the surface.

    Parameters
    ----------
    origin : (k,) int
        Vertex of the boundary that each new unknown belongs to.
    offsets : (k,) float
        Its distance from the boundary.
    triangles : (m, 3) int
        In the numbers of all unknowns; each counts half, both diagonals of a trapezoid are there.
    corners : (m, 3, 3) float
        Their corners, each triangle for itself.
    outer : (b, 2) int
        Edges at the outer end.
    outer_length : (b,) float
    """

    origin: Ints
    offsets: Floats
    triangles: Triangles
    corners: Points
    outer: Ints
    outer_length: Floats

    def operators(self, count: int, weights: Floats | None = None) -> tuple[csr_array, Floats, Floats]:
        """Return Laplacian (count, count), mass (count,) and boundary mass (count,) of the collar alone."""
        loose = self.corners.reshape(-1, 3)
        own = np.arange(len(loose)).reshape(-1, 3)
        places = self.triangles.ravel()
        join = csr_array((np.ones(len(loose)), (places, np.arange(len(loose)))), shape=(count, len(loose)))
        laplacian = csr_array(0.5 * (join @ cotangent_laplacian(loose, own, weights=weights) @ join.T))
        mass = 0.5 * np.bincount(places, weights=lumped_mass(loose, own), minlength=count)
        edge = np.bincount(self.outer.ravel(), weights=np.repeat(0.5 * self.outer_length, 2), minlength=count)
        return laplacian, np.asarray(mass), np.asarray(edge, dtype=np.float64)

    def extended(self, points: Points, triangles: Triangles) -> Points:
        """Return the points and, in space, places for the new unknowns that keep neighbours together."""
        corners = points[triangles]
        area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal = np.stack(
            [
                np.bincount(triangles.ravel(), weights=np.repeat(column, 3), minlength=len(points))
                for column in area.T
            ],
            axis=1,
        )
        away = np.zeros_like(points)
        for loop in boundary_loops(triangles):
            along = points[np.roll(loop, -1)] - points[np.roll(loop, 1)]
            away[loop] = np.cross(along, normal[loop])
        away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-300)
        return np.concatenate([points, points[self.origin] + self.offsets[:, None] * away[self.origin]])


def make_collar(points: Points, triangles: Triangles, width: Floats) -> Collar | None:
    """Return the collar of a surface, None where it has no free edge or edges that branch.

    Parameters
    ----------
    points : (n, 3) float
        In correlation lengths.
    triangles : (m, 3) int
    width : (n,) float
        Width wanted at each vertex; a loop takes the mean over its vertices.
    """
    loops = boundary_loops(triangles)
    if not loops:
        return None
    angle = _interior_angles(points, triangles)
    parts, start = [], len(points)
    for loop in loops:
        part = _loop_collar(points, loop, np.pi - angle[loop], float(width[loop].mean()), start)
        start += len(part.origin)
        parts.append(part)
    names = ("origin", "offsets", "triangles", "corners", "outer", "outer_length")
    return Collar(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def boundary_loops(triangles: Triangles) -> list[Ints]:
    """Return the vertices of each boundary loop, the surface to their left; none where loops branch."""
    sides = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    count = int(triangles.max(initial=0)) + 1
    free = sides[~np.isin(sides[:, 0] * count + sides[:, 1], sides[:, 1] * count + sides[:, 0])]
    following = {int(a): int(b) for a, b in free}
    if len(following) != len(free) or set(following) != set(following.values()):
        return []
    loops = []
    left = dict(sorted(following.items()))
    while left:
        first = next(iter(left))
        loop = [first]
        while (after := left.pop(loop[-1])) != first:
            loop.append(after)
        loops.append(np.array(loop, dtype=np.int64))
    return loops


def _interior_angles(points: Points, triangles: Triangles) -> Floats:
    """Sum of the angles of the triangles at each vertex (n,)."""
    corners = points[triangles]
    total = np.zeros(len(points))
    for k in range(3):
        one = corners[:, (k + 1) % 3] - corners[:, k]
        other = corners[:, (k + 2) % 3] - corners[:, k]
        sine = np.linalg.norm(np.cross(one, other), axis=1)
        angle = np.arctan2(sine, np.einsum("ij,ij->i", one, other))
        total += np.bincount(triangles[:, k], weights=angle, minlength=len(points))
    return total


def _loop_collar(points: Points, loop: Ints, turning: Floats, width: float, start: int) -> Collar:
    edges = np.linalg.norm(points[np.roll(loop, -1)] - points[loop], axis=1)
    heights = _row_heights(float(edges.mean()), width)
    inner, lengths, distance = loop, edges, 0.0
    count = len(loop)
    around = np.roll(np.arange(count), -1)
    origin, offsets, triangles, corners = [], [], [], []
    for height in heights:
        distance += float(height)
        longer = _lengths_at(edges, turning, distance)
        if longer.sum() < _LEAST * edges.sum():
            break
        outer = start + np.arange(count)
        start += count
        origin.append(loop)
        offsets.append(np.full(count, distance))
        quads = np.stack([inner, inner[around], outer[around], outer], axis=1)
        flat = _trapezoids(lengths, longer, float(height))
        for split in ([0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]):
            triangles.append(quads[:, split])
            corners.append(flat[:, split])
        inner, lengths = outer, longer
    return Collar(
        np.concatenate([*origin, np.zeros(0, dtype=np.int64)]),
        np.concatenate([*offsets, np.zeros(0)]),
        np.concatenate([*triangles, np.zeros((0, 3), dtype=np.int64)]),
        np.concatenate([*corners, np.zeros((0, 3, 3))]),
        np.stack([inner, inner[around]], axis=1),
        lengths,
    )


def _row_heights(first: float, width: float) -> Floats:
    """Heights that grow from that of the mesh and add up to the width."""
    count = max(1, int(np.ceil(np.log1p(width * (_GROWTH - 1.0) / first) / np.log(_GROWTH))))
    heights = _GROWTH ** np.arange(count)
    return np.asarray(heights * (width / heights.sum()), dtype=np.float64)


def _lengths_at(edges: Floats, turning: Floats, distance: float) -> Floats:
    """Length of each edge at a distance from the boundary; ``turning`` is that at its first vertex."""
    even = _spread_turning(edges, turning, _EVEN * float(edges.mean()))
    inward = np.minimum(even, 0.0)
    halves = 0.5 * (inward + np.roll(inward, 1))  # back from the edges to their first vertices
    grown = edges + distance * (np.maximum(even, 0.0) + _spread_turning(edges, halves, distance))
    return np.asarray(np.maximum(grown, _THIN * edges), dtype=np.float64)


def _spread_turning(edges: Floats, turning: Floats, reach: float) -> Floats:
    """Return the turning of each edge, that of a vertex spread evenly over ``reach`` to both sides."""
    total = float(edges.sum())
    if 2.0 * reach >= total:
        return np.asarray(turning.sum() * edges / total, dtype=np.float64)
    place = np.concatenate([[0.0], np.cumsum(edges)[:-1]])
    steps = np.concatenate([place - total, place, place + total])
    knots = np.sort(np.concatenate([steps - reach, steps + reach]))
    slope = np.concatenate([np.tile(turning, 3), -np.tile(turning, 3)]) / (2.0 * reach)
    order = np.argsort(np.concatenate([steps - reach, steps + reach]), kind="stable")
    density = np.cumsum(slope[order])
    integral = np.concatenate([[0.0], np.cumsum(density[:-1] * np.diff(knots))])
    return np.asarray(np.interp(place + edges, knots, integral) - np.interp(place, knots, integral))


def _trapezoids(lower: Floats, upper: Floats, height: float) -> Points:
    """Corners (k, 4, 3) of trapezoids around the middle of their sides."""
    x = np.stack([-0.5 * lower, 0.5 * lower, 0.5 * upper, -0.5 * upper], axis=1)
    y = np.broadcast_to([0.0, 0.0, height, height], x.shape)
    return np.stack([x, y, np.zeros_like(x)], axis=2)
