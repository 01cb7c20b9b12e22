"""Nodes spread over a surface and their logarithmic maps, by lengths along the surface alone.

A mesh is known by the lengths of its sides. Around each vertex its edges have polar angles, the sum of the
angles of its triangles stretched to a full turn; a direction is carried along an edge by the angles of the
edge at its two ends. A walk outward from a node, nearest vertices first, adds up edge vectors in the node's
tangent plane: the logarithmic map. Two sides of a thin wall are far apart in it, a fillet is unrolled.

References
----------
Schmidt, Grimm, Wyvill: Interactive decal compositing with discrete exponential maps, ACM Trans. Graph. 25
(2006), doi:10.1145/1141911.1141930.
Knöppel, Crane, Pinkall, Schröder: Globally optimal direction fields, ACM Trans. Graph. 32 (2013),
doi:10.1145/2461912.2462005.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._jit import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, Ints, Triangles

__all__ = ["Fans", "LogMaps", "spread_nodes", "vertex_fans"]

_REACH = 2.9  # of a log map, in spacings of its node
_FRONT = 1.6  # spacings up to which vertices are candidates for the next node
_STRAY = 0.5  # of an edge: ways around that differ by more are not averaged


@dataclass(frozen=True, eq=False)
class Fans:
    """The edges around each vertex of an oriented surface, in their order.

    Parameters
    ----------
    starts : (n + 1,) int
        Where the edges of each vertex start.
    heads : (e,) int
        Vertex at the other end.
    lengths : (e,) float
    directions : (e,) complex
        Unit vector of the edge in the tangent plane of the vertex.
    reverse : (e,) int
        The same edge seen from its other end.
    """

    starts: Ints
    heads: Ints
    lengths: Floats
    directions: NDArray[np.complex128]
    reverse: Ints


@dataclass(frozen=True, eq=False)
class LogMaps:
    """Nodes, and where they stand as seen from the vertices around them.

    Parameters
    ----------
    nodes : (m,) int
        Vertices.
    reach : (m,) float
        Up to which distance the vertices around a node see it.
    starts : (n + 1,) int
        Where the sights of each vertex start.
    seen : (s,) int
        Node, as a row of ``nodes``.
    places : (s,) complex
        Its place in the tangent plane of the vertex, nearest first.
    """

    nodes: Ints
    reach: Floats
    starts: Ints
    seen: Ints
    places: NDArray[np.complex128]

    def renumbered(self, order: Ints) -> LogMaps:
        """Return the same with the nodes in another order."""
        number = np.argsort(order)
        return LogMaps(self.nodes[order], self.reach[order], self.starts, number[self.seen], self.places)


def vertex_fans(count: int, triangles: Triangles, sides: Floats) -> Fans | None:
    """Return the fans of ``count`` vertices; None where the surface is not an oriented manifold.

    Parameters
    ----------
    count : int
    triangles : (m, 3) int
    sides : (m, 3) float
        Lengths from each corner to the next.
    """
    tails, heads = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    keys = tails * count + heads
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    if (np.diff(ordered) == 0).any():
        return None
    wanted = heads * count + tails
    place = np.minimum(np.searchsorted(ordered, wanted), len(ordered) - 1)
    twin = np.where(ordered[place] == wanted, order[place], -1)
    ok, *arrays = _fans(count, tails, heads, twin, np.ascontiguousarray(sides.ravel(), dtype=np.float64))
    return Fans(*arrays) if ok else None


def spread_nodes(fans: Fans, spacing: Floats, turn: Ints) -> LogMaps:
    """Return nodes about one local spacing (n,) apart on the surface, with their log maps.

    The front advances: the next node is the vertex that lies least beyond the spacing of those before, first
    among the vertices whose ``turn`` (n,) is 0, then among those of turn 1, and so on.
    """
    arrays = (fans.starts, fans.heads, fans.lengths, fans.directions, fans.reverse)
    fresh = np.argsort(turn, kind="stable")
    nodes, reach, vertices, seen, places = _advance(
        arrays, np.asarray(spacing, dtype=np.float64), 2.0 * _FRONT * turn, fresh
    )
    return LogMaps(nodes, reach, *_grouped(len(spacing), vertices, seen, places))


@kernel
def _corner_angle(a: float, b: float, c: float) -> float:
    """Angle opposite to side a."""
    cosine = (b * b + c * c - a * a) / (2.0 * b * c)
    return math.acos(min(1.0, max(-1.0, cosine)))


@kernel
def _fans(count: int, tails: Any, heads: Any, twin: Any, sides: Any) -> Any:
    """Go around every vertex: ok, starts, heads, lengths, directions, reverse."""
    halves = tails.size
    degree = np.zeros(count + 1, dtype=np.int64)
    first = np.full(count, -1, dtype=np.int64)
    for h in range(halves):
        degree[tails[h] + 1] += 1
        if first[tails[h]] == -1 or twin[h] == -1:
            first[tails[h]] = h
        if twin[h] == -1:
            degree[heads[h] + 1] += 1
    starts = np.cumsum(degree)
    total = starts[count]
    head = np.zeros(total, dtype=np.int64)
    length = np.zeros(total)
    angle = np.zeros(total)
    entry = np.zeros(halves, dtype=np.int64)
    last = np.full(count, -1, dtype=np.int64)
    for v in range(count):
        h = first[v]
        at, turn, closed = starts[v], 0.0, False
        while h != -1 and at < starts[v + 1]:
            triangle, k = h // 3, h % 3
            before = 3 * triangle + (k + 2) % 3
            opposite = sides[3 * triangle + (k + 1) % 3]
            head[at], angle[at], entry[h] = heads[h], turn, at
            length[at] = sides[h] if twin[h] == -1 else 0.5 * (sides[h] + sides[twin[h]])
            at += 1
            turn += _corner_angle(opposite, sides[h], sides[before])
            h = twin[before]
            if h == -1 and at < starts[v + 1]:
                head[at], angle[at], length[at] = tails[before], turn, sides[before]
                last[v] = at
                at += 1
            elif h == first[v]:
                closed = True
                break
        if at != starts[v + 1]:
            return False, starts, head, length, angle + 0j, entry
        if closed:
            for e in range(starts[v], at):
                angle[e] *= 2.0 * np.pi / turn
    reverse = np.full(total, -1, dtype=np.int64)
    for h in range(halves):
        reverse[entry[h]] = entry[twin[h]] if twin[h] != -1 else last[heads[h]]
        if twin[h] == -1:
            if last[heads[h]] == -1:
                return False, starts, head, length, angle + 0j, reverse
            reverse[last[heads[h]]] = entry[h]
    return True, starts, head, length, np.exp(1j * angle), reverse


@kernel
def _push(keys: Any, items: Any, size: int, key: float, item: int) -> int:
    """Put an item on a binary heap, smallest key first; return the new size."""
    k = size
    while k > 0 and keys[(k - 1) // 2] > key:
        keys[k], items[k] = keys[(k - 1) // 2], items[(k - 1) // 2]
        k = (k - 1) // 2
    keys[k], items[k] = key, item
    return size + 1


@kernel
def _pop(keys: Any, items: Any, size: int) -> int:
    """Take the smallest off; it stands at ``size - 1`` afterwards; return the new size."""
    top_key, top_item = keys[0], items[0]
    size -= 1
    key, item = keys[size], items[size]
    k = 0
    while 2 * k + 1 < size:
        child = 2 * k + 1
        if child + 1 < size and keys[child + 1] < keys[child]:
            child += 1
        if keys[child] >= key:
            break
        keys[k], items[k] = keys[child], items[child]
        k = child
    keys[k], items[k] = key, item
    keys[size], items[size] = top_key, top_item
    return size


@kernel
def _advance(fans: Any, spacing: Any, late: Any, fresh: Any) -> Any:
    """Nodes, their reach, and the sights (vertex, node, place); ``late`` is added in the front's queue."""
    n = spacing.size
    place, turn = np.zeros(n, dtype=np.complex128), np.zeros(n, dtype=np.complex128)
    tentative, settled = np.full(n, -1, dtype=np.int64), np.full(n, -1, dtype=np.int64)
    walk = (place, turn, np.zeros(n), tentative, settled)
    queue = (np.zeros(fans[1].size + 1), np.zeros(fans[1].size + 1, dtype=np.int64))
    visited = np.zeros(n, dtype=np.int64)
    covered = np.zeros(n, dtype=np.bool_)
    front_keys, front_items = np.zeros(64 * n), np.zeros(64 * n, dtype=np.int64)
    nodes, reach = np.zeros(n, dtype=np.int64), np.zeros(n)
    vertices, seen = np.zeros(32 * n, dtype=np.int32), np.zeros(32 * n, dtype=np.int32)
    places = np.zeros(32 * n, dtype=np.complex128)
    front, count, filled, asked = 0, 0, 0, 0
    while True:
        node = -1
        while asked < n and covered[fresh[asked]]:
            asked += 1
        while front > 0 and node == -1:
            front = _pop(front_keys, front_items, front)
            if not covered[front_items[front]]:
                node = front_items[front]
        if asked < n and (node == -1 or late[fresh[asked]] < late[node]):
            if node != -1:
                front = _push(front_keys, front_items, front, front_keys[front], node)
            node = fresh[asked]
        if node == -1:
            break
        nodes[count], reach[count] = node, _REACH * spacing[node]
        covered[node] = True
        number = _walk(node, count, reach[count], fans, walk, queue, visited)
        if filled + number > seen.size:
            vertices = np.concatenate((vertices, np.zeros_like(vertices)))
            seen = np.concatenate((seen, np.zeros_like(seen)))
            places = np.concatenate((places, np.zeros_like(places)))
        for v in visited[:number]:
            away, least = abs(place[v]), min(spacing[node], spacing[v])
            vertices[filled], seen[filled], places[filled] = v, count, -place[v] * turn[v]
            filled += 1
            if away < least:
                covered[v] = True
            elif away < _FRONT * least and not covered[v] and front < front_keys.size:
                front = _push(front_keys, front_items, front, late[v] + away / least, v)
        count += 1
    return nodes[:count], reach[:count], vertices[:filled], seen[:filled], places[:filled]


@kernel
def _walk(node: int, mark: int, limit: float, fans: Any, walk: Any, queue: Any, visited: Any) -> int:
    """Map the vertices within ``limit`` of a node; return how many were ``visited``."""
    starts, heads, lengths, directions, reverse = fans
    place, turn, distance, tentative, settled = walk
    keys, items = queue
    place[node], turn[node], tentative[node] = 0.0, 1.0, mark
    size = _push(keys, items, 0, 0.0, node)
    number = 0
    while size > 0:
        size = _pop(keys, items, size)
        v = items[size]
        if settled[v] == mark:
            continue
        settled[v] = mark
        if v != node:
            _average(v, mark, fans, place, turn, settled)
        if abs(place[v]) >= limit:
            continue
        visited[number] = v
        number += 1
        for e in range(starts[v], starts[v + 1]):
            u = heads[e]
            if settled[u] == mark:
                continue
            step = place[v] + lengths[e] * directions[e] * np.conj(turn[v])
            far = abs(step)
            if far < limit and (tentative[u] != mark or far < distance[u]):
                place[u], distance[u], tentative[u] = step, far, mark
                turn[u] = -turn[v] * directions[reverse[e]] * np.conj(directions[e])
                size = _push(keys, items, size, far, u)
    return number


@kernel
def _average(v: int, mark: int, fans: Any, place: Any, turn: Any, settled: Any) -> None:
    """Replace place and turn of a vertex by their mean over the ways from all settled neighbours."""
    starts, heads, lengths, directions, reverse = fans
    total, total_turn, weight = 0j, 0j, 0.0
    for e in range(starts[v], starts[v + 1]):
        w = heads[e]
        if settled[w] != mark:
            continue
        back = reverse[e]
        step = place[w] + lengths[e] * directions[back] * np.conj(turn[w])
        if abs(step - place[v]) < _STRAY * lengths[e]:
            share = 1.0 / lengths[e]
            total += share * step
            total_turn -= share * turn[w] * directions[e] * np.conj(directions[back])
            weight += share
    if weight > 0.0 and abs(total_turn) > 0.0:
        place[v] = total / weight
        turn[v] = total_turn / abs(total_turn)


@kernel
def _grouped(count: int, vertices: Any, seen: Any, places: Any) -> Any:
    """Sights by vertex, the nearest first: starts, nodes, places."""
    starts = np.zeros(count + 1, dtype=np.int64)
    for v in vertices:
        starts[v + 1] += 1
    for v in range(count):
        starts[v + 1] += starts[v]
    fill = starts[:count].copy()
    nodes = np.zeros(seen.size, dtype=np.int64)
    around = np.zeros(seen.size, dtype=np.complex128)
    for p in range(vertices.size):
        v = vertices[p]
        q = fill[v]
        fill[v] += 1
        far = abs(places[p])
        while q > starts[v] and abs(around[q - 1]) > far:
            nodes[q], around[q] = nodes[q - 1], around[q - 1]
            q -= 1
        nodes[q], around[q] = seen[p], places[p]
    return starts, nodes, around
