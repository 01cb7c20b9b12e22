"""A collar that carries a surface on beyond its free edges, known by its lengths alone.

The Laplace-Beltrami operator sees only lengths along the surface, so the collar need not fit into space: it
may run over itself in a hole. Rows of triangles follow the outline at growing distances D. There a piece of
the outline of length e that turns by phi has the length e + D phi: a flat face continues flat. A convex
corner opens into a fan. At concave corners the turning is spread over 2 D, as the strips of both sides
overlap there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import csr_array

from cadskin.shape.operators import cotangent_laplacian, lumped_mass

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points, Triangles

__all__ = ["WIDTH", "Collar", "boundary_loops", "make_collar", "triangles_of_lengths"]

WIDTH = 2.0  # correlation lengths
GROWTH = 1.1  # of the height of the rows; quadratic elements are as accurate with 1.3
_LEAST = 0.1  # of the length of a loop: a collar that shrinks further, in a hole, is closed
_EVEN = 1.0  # mean edges to both sides over which the turning is evened out: jagged edges are no corners
_SHARP = 0.35  # turning at a vertex from which on it is a corner
_ALONE = 0.7  # share of the turning that the neighbours leave at a corner: less is a jag
_THIN = 0.02  # of an edge: the least length that it shrinks to


@dataclass(frozen=True, eq=False)
class Collar:
    """Unknowns beyond the free edges; they follow those of the surface.

    Parameters
    ----------
    origin : (k,) int
        Vertex of the boundary that each new unknown is nearest to.
    offsets : (k,) float
        Its distance from the boundary.
    leans : (k,) float
        Angle to the direction away from the surface, along the boundary, for unknowns in a fan [rad].
    anchors : (k, 3) float
        The place on the boundary that they stand beyond.
    triangles : (m, 3) int
        In the numbers of all unknowns; they run around the other way than those of the surface.
    corners : (m, 3, 3) float
        Their corners, each triangle for itself.
    outer : (b, 2) int
        Edges at the outer end.
    outer_length : (b,) float
    """

    origin: Ints
    offsets: Floats
    leans: Floats
    anchors: Points
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
        laplacian = csr_array(join @ cotangent_laplacian(loose, own, weights=weights) @ join.T)
        mass = np.bincount(places, weights=lumped_mass(loose, own), minlength=count)
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
        along, away = np.zeros_like(points), np.zeros_like(points)
        for loop in boundary_loops(triangles):
            along[loop] = points[np.roll(loop, -1)] - points[np.roll(loop, 1)]
            away[loop] = np.cross(along[loop], normal[loop])
        for vectors in (along, away):
            vectors /= np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)
        cosine, sine = np.cos(self.leans)[:, None], np.sin(self.leans)[:, None]
        direction = cosine * away[self.origin] + sine * along[self.origin]
        return np.concatenate([points, self.anchors + self.offsets[:, None] * direction])


def make_collar(
    points: Points, triangles: Triangles, width: Floats, *, growth: float = GROWTH
) -> Collar | None:
    """Return the collar of a surface, None where it has no free edge or edges that branch.

    Parameters
    ----------
    points : (n, 3) float
        In correlation lengths.
    triangles : (m, 3) int
    width : (n,) float
        Width wanted at each vertex; a loop takes the mean over its vertices.
    growth : float
        Of the height of each row over that before.
    """
    loops = boundary_loops(triangles)
    if not loops:
        return None
    angle = _interior_angles(points, triangles)
    parts, start = [], len(points)
    for loop in loops:
        part = _loop_collar(points, loop, np.pi - angle[loop], float(width[loop].mean()), growth, start)
        start += len(part.origin)
        parts.append(part)
    return Collar(*(np.concatenate([getattr(part, name) for part in parts]) for name in _FIELDS))


_FIELDS = ("origin", "offsets", "leans", "anchors", "triangles", "corners", "outer", "outer_length")


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


def triangles_of_lengths(sides: Floats) -> Points:
    """Return corners (m, 3, 3) in the plane of triangles with sides (m, 3) 01, 12, 20, one by one."""
    first, second, third = sides.T
    x = (first**2 + third**2 - second**2) / (2.0 * first)
    least = _THIN * np.minimum(first, third)  # lengths that no triangle has, in a strip that folds
    y = np.sqrt(np.maximum(third**2 - x**2, least**2))
    corners = np.zeros((len(sides), 3, 3))
    corners[:, 1, 0], corners[:, 2, 0], corners[:, 2, 1] = first, x, y
    return corners


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


@dataclass(frozen=True, eq=False)
class _Outline:
    """A boundary loop, parametrised by s: the fan of a corner comes before the edge that follows it.

    Parameters
    ----------
    edges : (k,) float
        Length of the edge that follows each vertex.
    fans : (k,) float
        Turning of the convex corners, 0 elsewhere.
    outward : (k,) float
        Turning of each edge to the outside, that of its vertices evened out.
    inward : (k,) float
        Turning of each vertex to the inside, <= 0.
    """

    edges: Floats
    fans: Floats
    outward: Floats
    inward: Floats

    @classmethod
    def of(cls, edges: Floats, turning: Floats) -> _Outline:
        around = np.abs(turning + np.roll(turning, 1) + np.roll(turning, -1))
        corner = (np.abs(turning) > _SHARP) & (around > _ALONE * np.abs(turning))
        even = _spread_turning(edges, np.where(corner, 0.0, turning), _EVEN * float(edges.mean()))
        inward = np.minimum(even, 0.0)
        back = 0.5 * (inward + np.roll(inward, 1))  # from the edges to their vertices
        sharp = np.where(corner, turning, 0.0)
        return cls(edges, np.maximum(sharp, 0.0), np.maximum(even, 0.0), np.minimum(sharp, 0.0) + back)

    @cached_property
    def knots(self) -> Floats:
        """Parameter (2 k + 1,) where each fan and each edge begins, and the end."""
        wide = self.fans * self.edges.mean()
        return np.concatenate([[0.0], np.cumsum(np.stack([wide, self.edges], axis=1).ravel())])

    @cached_property
    def cuts(self) -> Ints:
        """Knots between the straight pieces and the fans; every row has a vertex there."""
        fans = 2 * np.flatnonzero(self.fans)
        return np.unique(np.concatenate([[0], fans, fans + 1, [len(self.knots) - 1]]))

    def lengths(self, distance: float) -> Floats:
        """Length of the row at a distance, from the first knot to each (2 k + 1,)."""
        grown = self.edges + distance * self.outward
        if distance > 0.0:
            grown = grown + distance * _spread_turning(self.edges, self.inward, distance)
        grown = np.maximum(grown, _THIN * self.edges)
        return np.concatenate([[0.0], np.cumsum(np.stack([distance * self.fans, grown], axis=1).ravel())])

    def reach(self, width: float) -> float:
        """Distance at which the rows have shrunk to a small rest, in a hole, or the width."""
        least = _LEAST * float(self.edges.sum())
        if self.lengths(width)[-1] >= least:
            return width
        low, high = 0.0, width
        for _ in range(40):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.lengths(middle)[-1] >= least else (low, middle)
        return low

    def row(self, lengths: Floats, spacing: float) -> Floats:
        """Parameters of the vertices of a row, evenly spaced in every piece."""
        least = {2: 3, 3: 2}.get(len(self.cuts), 1)  # a row has three vertices or more
        places = []
        for first, last in zip(self.cuts[:-1], self.cuts[1:], strict=True):
            reach = lengths[last] - lengths[first]
            count = max(least, round(reach / spacing))
            steps = lengths[first] + reach * np.arange(count) / count
            places.append(np.interp(steps, lengths, self.knots))
        return np.concatenate(places)


@dataclass(frozen=True, eq=False)
class _Row:
    """One row: parameter and number of each vertex, length of the edge after it, lengths at the knots."""

    place: Floats
    number: Ints
    chord: Floats
    lengths: Floats


def _loop_collar(
    points: Points, loop: Ints, turning: Floats, width: float, growth: float, start: int
) -> Collar:
    edges = np.linalg.norm(points[np.roll(loop, -1)] - points[loop], axis=1)
    outline = _Outline.of(edges, turning)
    reach = outline.reach(width)
    row, owner = _first_row(outline, loop)
    first, distance = row, 0.0
    parts: list[tuple[Any, ...]] = []
    for height in _row_heights(edges, reach, growth):
        distance += float(height)
        lengths = outline.lengths(distance)
        place = outline.row(lengths, float(height))
        number = start + np.arange(len(place))
        start += len(place)
        following, triangles, sides = _strip(outline, row, _Row(place, number, place, lengths), float(height))
        near, _ = _nearest(_middles(first.place, outline.knots[-1]), place, outline.knots[-1], first=True)
        anchor, lean = _anchors(outline, points[loop], place)
        parts.append((loop[owner[near]], np.full(len(place), distance), lean, anchor, triangles, sides))
        row = following
    outer = np.stack([row.number, np.roll(row.number, -1)], axis=1)
    chord = row.chord
    if reach < width:  # a hole is filled up to here: a last vertex in its middle
        radius = np.full(len(chord), row.lengths[-1] / (2.0 * np.pi))
        cap = np.stack([*outer.T, np.full(len(outer), start)], axis=1)
        sides = np.stack([chord, radius, radius], axis=1)
        middle = points[loop].mean(axis=0)[None]
        parts.append((loop[:1], np.zeros(1), np.zeros(1), middle, cap, sides))
        outer, chord = outer[:0], chord[:0]
    origin, offsets, leans, anchors, triangles, sides = (
        np.concatenate([part[k] for part in parts]) for k in range(6)
    )
    return Collar(origin, offsets, leans, anchors, triangles, triangles_of_lengths(sides), outer, chord)


def _first_row(outline: _Outline, loop: Ints) -> tuple[_Row, Ints]:
    """Return the boundary itself, corners once at either end of their fan, and the owner of each vertex."""
    knots = outline.knots[:-1].reshape(-1, 2)
    twice = np.flatnonzero(outline.fans)
    owner = np.sort(np.concatenate([np.arange(len(loop)), twice]))
    place = np.sort(np.concatenate([knots[:, 1], knots[twice, 0]]))
    chord = np.where(owner == np.roll(owner, -1), 0.0, outline.edges[owner])
    return _Row(place, loop[owner], chord, outline.lengths(0.0)), owner


def _anchors(outline: _Outline, points: Points, place: Floats) -> tuple[Points, Floats]:
    """Return the place on the boundary of each vertex of a row, and its lean within a fan."""
    interval = np.clip(np.searchsorted(outline.knots, place, side="right") - 1, 0, 2 * len(points) - 1)
    vertex = interval // 2
    begin, end = outline.knots[interval], outline.knots[interval + 1]
    share = ((place - begin) / np.maximum(end - begin, 1e-300))[:, None]
    on_edge = interval % 2 == 1
    along = np.where(on_edge[:, None], share, 0.0)
    anchor = points[vertex] * (1.0 - along) + points[(vertex + 1) % len(points)] * along
    lean = np.where(on_edge, 0.0, (share[:, 0] - 0.5) * outline.fans[vertex])
    return anchor, lean


def _strip(outline: _Outline, inner: _Row, outer: _Row, height: float) -> tuple[_Row, Triangles, Floats]:
    """Triangles between two rows and their sides, all lengths those of a strip that turns evenly."""
    total = outline.knots[-1]

    def length(row: _Row, place: Floats) -> Floats:
        turns = np.floor(place / total)
        whole = row.lengths[-1]
        along = np.interp(place - turns * total, outline.knots, row.lengths)
        return np.asarray(along + turns * whole, dtype=np.float64)

    def factor(low: Floats, high: Floats) -> tuple[Floats, Floats, Floats]:
        near = length(inner, high) - length(inner, low)
        far = length(outer, high) - length(outer, low)
        return near, far, np.sinc((far - near) / (2.0 * np.pi * height))  # chord over arc of the strip

    def across(low: Floats, high: Floats) -> Floats:
        near, far, sine = factor(low, high)
        return np.asarray(np.sqrt(height**2 + near * far * sine**2))

    inner_next = np.append(inner.place[1:], inner.place[0] + total)
    outer_next = np.append(outer.place[1:], outer.place[0] + total)
    _, far, sine = factor(outer.place, outer_next)
    chord = far * sine
    inner_middle, outer_middle = _middles(inner.place, total), _middles(outer.place, total)
    apex, turn = _nearest(outer_middle, inner_middle, total, first=True)
    place = outer.place[apex] + turn * total
    one = np.stack([inner.number, np.roll(inner.number, -1), outer.number[apex]], axis=1)
    one_sides = np.stack([inner.chord, across(inner_next, place), across(inner.place, place)], axis=1)
    apex, turn = _nearest(inner_middle, outer_middle, total, first=False)
    place = inner.place[apex] + turn * total
    two = np.stack([np.roll(outer.number, -1), outer.number, inner.number[apex]], axis=1)
    two_sides = np.stack([chord, across(place, outer.place), across(place, outer_next)], axis=1)
    real = one[:, 0] != one[:, 1]
    triangles = np.concatenate([one[real], two])
    return (
        _Row(outer.place, outer.number, chord, outer.lengths),
        triangles,
        np.concatenate([one_sides[real], two_sides]),
    )


def _middles(place: Floats, total: float) -> Floats:
    return np.asarray(0.5 * (place + np.append(place[1:], place[0] + total)), dtype=np.float64)


def _nearest(middles: Floats, targets: Floats, total: float, *, first: bool) -> tuple[Ints, Ints]:
    """Return the vertex whose cell between ``middles`` holds each target, and its turn around the loop."""
    count = len(middles)
    found = np.searchsorted(middles, targets, side="left" if first else "right")
    last = middles[-1] - total
    before = targets <= last if first else targets < last
    turn = np.where(before, -1, np.where(found == count, 1, 0))
    return np.where(before, count - 1, found % count), turn


def _row_heights(edges: Floats, width: float, growth: float) -> Floats:
    """Heights that grow from that of the mesh and add up to the width."""
    count = max(1, int(np.ceil(np.log1p(width * (growth - 1.0) / edges.mean()) / np.log(growth))))
    heights = growth ** np.arange(count)
    return np.asarray(heights * (width / heights.sum()), dtype=np.float64)


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
