"""Proof that a mesh is what it claims to be: closed, 2-manifold, oriented, well shaped."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cadskin._arrays import frozen
from cadskin._jit import kernel
from cadskin.shape.discrete import triangle_normals

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats, Ints, Points, Triangles
    from cadskin.shape.discrete import DiscreteShape

__all__ = [
    "EdgeTable",
    "MeshCheck",
    "check_mesh",
    "edge_table",
    "inverted_triangles",
    "non_manifold_vertices",
    "triangle_quality",
]


@dataclass(frozen=True, eq=False)
class EdgeTable:
    """The undirected edges of a mesh and the triangles at them.

    Parameters
    ----------
    vertices : (e, 2) int
        End points, the smaller index first.
    count : (e,) int
        Triangles at the edge: 1 at an open edge, 2 inside, more where the mesh is not manifold.
    balance : (e,) int
        Sum of the directions in which the triangles run along the edge; 0 where two agree in orientation.
    triangles : (e, 2) int
        The first two triangles; the second is -1 at an open edge.
    of_sides : (m, 3) int
        Edge of side k of each triangle (from corner k to corner k + 1).
    """

    vertices: Ints
    count: Ints
    balance: Ints
    triangles: Ints
    of_sides: Ints


@dataclass(frozen=True, eq=False)
class MeshCheck:
    """What `check_mesh` found.

    Parameters
    ----------
    n_points, n_triangles, n_edges : int
    open_edges, non_manifold_edges, misoriented_edges : (k, 2) int
        End points of edges with one triangle; with more than two; with two that run the same way.
    non_manifold_vertices : (k,) int
        Vertices where several fans of triangles touch.
    degenerate_triangles : (k,) int
        Triangles with a repeated corner or an area below 1e-12 of the square of their longest side.
    unused_points : (k,) int
        Points of no triangle.
    n_components : int
        Connected pieces.
    volume, area : float
        [mm³], [mm²]; the volume is positive when the mesh is oriented outward.
    quality_min, quality_p01, quality_median : float
        Of 4 sqrt(3) A / (l1² + l2² + l3²): 1 for an equilateral triangle, 0 for one without area.
    edge_length_min, edge_length_median, edge_length_max : float
        [mm].
    """

    n_points: int
    n_triangles: int
    n_edges: int
    open_edges: Ints
    non_manifold_edges: Ints
    misoriented_edges: Ints
    non_manifold_vertices: Ints
    degenerate_triangles: Ints
    unused_points: Ints
    n_components: int
    volume: float
    area: float
    quality_min: float
    quality_p01: float
    quality_median: float
    edge_length_min: float
    edge_length_median: float
    edge_length_max: float

    @property
    def closed(self) -> bool:
        """True when every edge has at least two triangles and there is one."""
        return self.n_triangles > 0 and len(self.open_edges) == 0

    @property
    def manifold(self) -> bool:
        """True when the mesh is a 2-manifold, with or without a border."""
        return len(self.non_manifold_edges) == 0 and len(self.non_manifold_vertices) == 0

    @property
    def oriented(self) -> bool:
        """True when neighbouring triangles agree on which side is outside."""
        return len(self.misoriented_edges) == 0

    @property
    def watertight(self) -> bool:
        """True for a closed, 2-manifold, outward oriented surface without degenerate triangles."""
        return not self.problems(solid=True)

    @property
    def euler_number(self) -> int:
        """Vertices - edges + triangles, of the used points: 2 for a sphere, 0 for a plate with one hole."""
        return self.n_points - len(self.unused_points) - self.n_edges + self.n_triangles

    def problems(self, *, solid: bool = True) -> tuple[str, ...]:
        """Return one line per fault, none for a good mesh; ``solid=False`` allows a border."""
        found = [
            (len(self.non_manifold_edges), "edges with more than two triangles"),
            (len(self.non_manifold_vertices), "vertices where separate fans touch"),
            (len(self.misoriented_edges), "edges whose triangles disagree in orientation"),
            (len(self.degenerate_triangles), "triangles without area"),
            (len(self.open_edges) if solid else 0, "open edges"),
        ]
        lines = [f"{count} {what}" for count, what in found if count]
        if not self.n_triangles:
            lines.append("no triangles")
        if solid and self.closed and self.volume <= 0:
            lines.append(f"oriented inward (volume {self.volume:.6g} mm³)")
        return tuple(lines)


def check_mesh(surface: DiscreteShape) -> MeshCheck:
    """Check a mesh for closure, manifoldness, orientation and shape.

    Parameters
    ----------
    surface : DiscreteShape

    Returns
    -------
    MeshCheck

    Examples
    --------
    >>> from cadskin.shape import DiscreteShape
    >>> tet = DiscreteShape([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    ...                     [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], [0, 1, 2, 3])
    >>> check_mesh(tet).watertight, check_mesh(tet).euler_number
    (True, 2)
    """
    points, triangles = surface.points, surface.triangles
    edges = edge_table(triangles)
    lengths = np.linalg.norm(points[edges.vertices[:, 0]] - points[edges.vertices[:, 1]], axis=1)
    quality = triangle_quality(points, triangles)
    used = np.zeros(len(points), dtype=bool)
    used[triangles] = True
    return MeshCheck(
        n_points=len(points),
        n_triangles=len(triangles),
        n_edges=len(edges.vertices),
        open_edges=edges.vertices[edges.count == 1],
        non_manifold_edges=edges.vertices[edges.count > 2],
        misoriented_edges=edges.vertices[(edges.count == 2) & (edges.balance != 0)],
        non_manifold_vertices=non_manifold_vertices(triangles, edges),
        degenerate_triangles=np.flatnonzero(_degenerate(points, triangles)),
        unused_points=np.flatnonzero(~used),
        n_components=_n_components(triangles, used),
        volume=surface.volume,
        area=surface.area,
        quality_min=_quantile(quality, 0.0),
        quality_p01=_quantile(quality, 0.01),
        quality_median=_quantile(quality, 0.5),
        edge_length_min=_quantile(lengths, 0.0),
        edge_length_median=_quantile(lengths, 0.5),
        edge_length_max=_quantile(lengths, 1.0),
    )


def edge_table(triangles: Triangles) -> EdgeTable:
    """Return the undirected edges of ``triangles`` (m, 3) with the triangles at them."""
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    low, high = np.minimum(start, end), np.maximum(start, end)
    size = np.int64(triangles.max() + 1 if triangles.size else 1)
    keys, first, edge_of_side, count = np.unique(
        low * size + high, return_index=True, return_inverse=True, return_counts=True
    )
    edge_of_side = edge_of_side.reshape(-1).astype(np.int64)
    balance = np.bincount(edge_of_side, weights=np.where(start < end, 1.0, -1.0), minlength=len(keys))
    pairs = np.full((len(keys), 2), -1, dtype=np.int64)
    pairs[:, 0] = first // 3
    is_later = np.ones(len(start), dtype=bool)
    is_later[first] = False
    later = np.flatnonzero(is_later)[::-1]
    pairs[edge_of_side[later], 1] = later // 3  # in reverse, so that the second triangle stays
    return EdgeTable(
        vertices=frozen(np.stack(np.divmod(keys, size), axis=1), dtype=np.int64),
        count=frozen(count, dtype=np.int64),
        balance=frozen(balance, dtype=np.int64),
        triangles=frozen(pairs, dtype=np.int64),
        of_sides=frozen(edge_of_side.reshape(-1, 3), dtype=np.int64),
    )


def non_manifold_vertices(triangles: Triangles, edges: EdgeTable | None = None) -> Ints:
    """Return the vertices whose triangles do not form one fan that is connected through edges.

    Parameters
    ----------
    triangles : (m, 3) int
    edges : EdgeTable, optional
        Of the same triangles, where it is known already.
    """
    if not triangles.size:
        return np.zeros(0, dtype=np.int64)
    table = edge_table(triangles) if edges is None else edges
    corners = np.arange(triangles.size).reshape(-1, 3)
    side_edge = table.of_sides
    # Two corners at one vertex hang together when their triangles share an edge that ends there.
    outgoing = np.stack([corners.ravel(), side_edge.ravel(), triangles.ravel()])
    incoming = np.stack([corners.ravel(), np.roll(side_edge, 1, axis=1).ravel(), triangles.ravel()])
    corner, edge, vertex = np.concatenate([outgoing, incoming], axis=1)
    order = np.lexsort((vertex, edge))
    corner, edge, vertex = corner[order], edge[order], vertex[order]
    linked = (edge[1:] == edge[:-1]) & (vertex[1:] == vertex[:-1])
    graph = coo_array(
        (np.ones(int(linked.sum())), (corner[:-1][linked], corner[1:][linked])), shape=(corners.size,) * 2
    )
    _, fan = connected_components(graph, directed=False)
    vertex_and_fan = np.unique(np.stack([triangles.ravel(), fan], axis=1), axis=0)
    vertices, n_fans = np.unique(vertex_and_fan[:, 0], return_counts=True)
    return np.asarray(vertices[n_fans > 1], dtype=np.int64)


def triangle_quality(points: Points, triangles: Triangles) -> Floats:
    """Return 4 sqrt(3) A / (l1² + l2² + l3²) of each triangle (m,): 1 for an equilateral one."""
    corners = points[triangles]
    squares = ((corners - np.roll(corners, -1, axis=1)) ** 2).sum(axis=(1, 2))
    areas = 0.5 * np.linalg.norm(triangle_normals(points, triangles, unit=False), axis=1)
    return np.asarray(4.0 * np.sqrt(3.0) * areas / np.where(squares > 0, squares, 1.0))


def inverted_triangles(points: Points, reference: Points, triangles: Triangles, *, tol: float = 0.0) -> Bools:
    """Return which triangles are turned over, or flat, against the same triangles on a reference.

    Parameters
    ----------
    points : (n, 3) float
        Moved vertices [mm].
    reference : (n, 3) float
        Vertices before the move [mm].
    triangles : (m, 3) int
    tol : float
        A triangle counts as inverted when its area, seen along the normal it had, is not more than ``tol``
        times the area it had. A triangle without area has no side to turn to and never counts.

    Returns
    -------
    (m,) bool
    """
    moved, before = (np.ascontiguousarray(p, dtype=np.float64) for p in (points, reference))
    turned = np.asarray(_turned(moved, before, np.array(triangles, dtype=np.int64), float(tol)))
    where = np.flatnonzero(turned)
    if len(where):  # seldom
        turned[where[_degenerate(reference, triangles[where])]] = False
    return turned


@kernel
def _turned(points: Any, reference: Any, triangles: Any, tol: float) -> Any:
    """Return which triangles have no more than ``tol`` of their area along the normal they had."""
    out = np.zeros(triangles.shape[0], dtype=np.bool_)
    for t in range(triangles.shape[0]):
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        seen, had = 0.0, 0.0
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            after = (points[j, u] - points[i, u]) * (points[k, v] - points[i, v]) - (
                points[j, v] - points[i, v]
            ) * (points[k, u] - points[i, u])
            before = (reference[j, u] - reference[i, u]) * (reference[k, v] - reference[i, v]) - (
                reference[j, v] - reference[i, v]
            ) * (reference[k, u] - reference[i, u])
            seen += before * after
            had += before * before
        out[t] = seen <= tol * had
    return out


def _degenerate(points: Points, triangles: Triangles) -> Bools:
    corners = points[triangles]
    longest = ((corners - np.roll(corners, -1, axis=1)) ** 2).sum(axis=2).max(axis=1, initial=0.0)
    doubled = np.linalg.norm(triangle_normals(points, triangles, unit=False), axis=1)
    repeated = (triangles == np.roll(triangles, -1, axis=1)).any(axis=1)
    return np.asarray(repeated | (doubled <= 2e-12 * longest), dtype=np.bool_)


def _n_components(triangles: Triangles, used: Bools) -> int:
    if not triangles.size:
        return 0
    links = (
        np.concatenate([triangles[:, 0], triangles[:, 1]]),
        np.concatenate([triangles[:, 1], triangles[:, 2]]),
    )
    graph = coo_array((np.ones(len(links[0])), links), shape=(len(used),) * 2)
    return int(connected_components(graph, directed=False)[0] - np.count_nonzero(~used))


def _quantile(values: Floats, q: float) -> float:
    return float(np.quantile(values, q)) if len(values) else float("nan")
