"""One face: constrained Delaunay triangulation of its polygon, remeshing, evaluation, check."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import pythoncdt

from cadskin._typing import Floats, Ints, Points, Triangles
from cadskin.cad.meshing._space import flip_in_space, measure, node_normals
from cadskin.cad.meshing.check import BOUNDARY, CROWDED, half_edge_twins
from cadskin.cad.meshing.domain import Domain, FaceProblem
from cadskin.cad.meshing.kernel import Metric, remesh
from cadskin.cad.meshing.lattice import start_points
from cadskin.cad.surface import FaceSurface

__all__ = ["FaceMesh", "mesh_face"]

SMALLEST_SIZE = 0.04  # of the face's edge length
SMALLEST_FOLD = 1e-3  # area over squared edge length
_GRID = (17, 97)


@dataclass(frozen=True, eq=False)
class FaceMesh:
    """The triangles of one face, in its own numbering.

    Parameters
    ----------
    index : int
    surface : FaceSurface
    domain : Domain
        The boundary; its nodes are the first of the mesh.
    uv : (n, 2) float
    triangles : (m, 3) int
        Counter-clockwise in the parameter plane.
    points : (n, 3) float
        Shared points on the boundary, points of the surface inside [mm].
    derivatives : (n, 6, 3) float
        Of the surface at ``uv``.
    area : float
        Of the triangles [mm²].
    folded_edges : tuple of int
        Edges at which a triangle turns away from the surface normal.
    problem : str or None
        Why the face stands on its boundary points only, or is missing.
    """

    index: int
    surface: FaceSurface
    domain: Domain
    uv: Floats
    triangles: Triangles
    points: Points
    derivatives: Floats
    area: float
    folded_edges: tuple[int, ...] = ()
    problem: str | None = None


def mesh_face(
    index: int, surface: FaceSurface, domain: Domain, *, target: float, area: float, lattice: bool = True
) -> FaceMesh:
    """Mesh a face with a given boundary.

    Parameters
    ----------
    target : float
        Wanted edge length [mm].
    area : float
        Exact area of the face [mm²], to reserve memory.

    Raises
    ------
    FaceProblem
        The polygon crosses itself or the surface cannot be evaluated.
    """
    metric, scale, corner = face_metric(surface, domain)
    position = (domain.uv - corner) * scale
    start = np.zeros((0, 2))
    if lattice:
        start = start_points(position, domain.sizes, domain.segments, metric=metric, target=target)
    n_fixed = len(position)
    nodes = np.concatenate([position, start])
    triangles, neighbours = constrained_delaunay(nodes, domain)
    if int((neighbours < 0).sum()) != _n_outer_sides(domain):
        if len(start):  # a start point fell on the boundary
            return mesh_face(index, surface, domain, target=target, area=area, lattice=False)
        raise FaceProblem("the boundary polygon does not close", domain.segment_edges.tolist())
    sizes = np.full(len(nodes), target)
    sizes[:n_fixed] = np.maximum(domain.sizes, SMALLEST_SIZE * target)
    position, remeshed = remesh(
        nodes,
        sizes,
        n_fixed,
        triangles,
        neighbours,
        _locked_sides(triangles, domain),
        metric=metric,
        target=target,
        capacity=int(min(1.3 * area / (0.866 * target**2), 4e6)) + 6 * n_fixed + 100,
    )
    if _n_boundary_sides(remeshed, len(position)) != _n_outer_sides(domain):
        # rounding on a degenerate polygon has spoilt the mesh: keep what the triangulation gave
        position, remeshed = _without_unused(nodes, triangles, n_fixed)
    uv = position / scale + corner
    uv[:n_fixed] = domain.uv
    return _evaluated(index, surface, domain, uv, position, remeshed, target)


def _n_boundary_sides(triangles: Triangles, n_nodes: int) -> int:
    """Count the sides without a neighbour, -1 where a side has more than one."""
    twin = half_edge_twins(triangles, n_nodes)
    return -1 if (twin == CROWDED).any() else int((twin == BOUNDARY).sum())


def _without_unused(nodes: Floats, triangles: Triangles, n_fixed: int) -> tuple[Floats, Triangles]:
    """Drop inner nodes that no triangle uses."""
    used = np.zeros(len(nodes), dtype=bool)
    used[triangles] = True
    used[:n_fixed] = True
    return nodes[used], (np.cumsum(used) - 1)[triangles]


def _evaluated(
    index: int,
    surface: FaceSurface,
    domain: Domain,
    uv: Floats,
    position: Floats,
    triangles: Triangles,
    target: float,
) -> FaceMesh:
    """Put a remeshed face onto its surface, mend what looks bad there, and measure it."""
    derivatives = finite_derivatives(surface, uv)
    n_fixed = len(domain.uv)
    points = derivatives[:, 0].copy()
    points[:n_fixed] = domain.points
    names = np.arange(-len(uv), 0)
    at_vertex = domain.vertex_ids >= 0
    names[:n_fixed][at_vertex] = domain.vertex_ids[at_vertex]
    normals = node_normals(derivatives)
    if surface.kind != "plane":
        twin = half_edge_twins(triangles, len(uv))
        flip_in_space(points, normals, names, position, triangles, twin)
    at_fold = np.zeros(len(uv), np.uint8)
    area = measure(points, normals, names, triangles, SMALLEST_FOLD * target**2, at_fold)
    folded: tuple[int, ...] = ()
    if surface.kind != "plane" and at_fold[:n_fixed].any():
        touched = at_fold[domain.segments].any(axis=1)
        folded = tuple(np.unique(domain.segment_edges[touched]).tolist())
    return FaceMesh(index, surface, domain, uv, triangles, points, derivatives, area, folded)


def face_metric(surface: FaceSurface, domain: Domain) -> tuple[Metric, Floats, Floats]:
    """Return the metric over the face's parameter box, the scale of the plane and its origin.

    The plane is scaled so that lengths in it are millimetres in the middle of the face.
    """
    low, high = domain.uv.min(axis=0), domain.uv.max(axis=0)
    if surface.kind == "plane":
        return Metric(np.array([[[1.0, 0.0, 1.0]]]), np.zeros(4)), np.ones(2), low
    shape = tuple(
        int(np.clip(8 * spans, *_GRID)) if varies else 2
        for spans, varies in zip(surface.spans, surface.varies, strict=True)
    )
    axes = [np.linspace(low[k], high[k], shape[k]) for k in range(2)]
    uv = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    derivatives = surface.derivatives(uv)
    su, sv = derivatives[:, 1], derivatives[:, 2]
    form = np.stack([np.einsum("ni,ni->n", a, b) for a, b in ((su, su), (su, sv), (sv, sv))], axis=1)
    broken = ~np.isfinite(form).all(axis=1)
    if broken.all():
        raise FaceProblem("the surface has no derivatives on this face")
    middle = np.median(form[~broken], axis=0)
    form[broken] = middle
    if not (middle[[0, 2]] > 0).all():
        raise FaceProblem("the surface is a curve or a point on this face")
    form[:, [0, 2]] = np.maximum(form[:, [0, 2]], 1e-10 * middle[[0, 2]])
    scale = np.sqrt(middle[[0, 2]])
    form /= np.array([scale[0] ** 2, scale[0] * scale[1], scale[1] ** 2])
    if not any(surface.varies):
        return Metric(form[:1].reshape(1, 1, 3), np.zeros(4)), scale, low
    placing = np.concatenate([[0.0, 0.0], (np.array(shape) - 1) / ((high - low) * scale)])
    return Metric(form.reshape(*shape, 3), placing), scale, low


def finite_derivatives(surface: FaceSurface, uv: Floats) -> Floats:
    """Evaluate the surface; where that gives NaN (a singular point), a step towards the middle of the face.

    Raises
    ------
    FaceProblem
        The surface has no values there either.
    """
    derivatives = surface.derivatives(uv)
    broken = ~np.isfinite(derivatives).all(axis=(1, 2))
    if broken.any():
        middle = np.median(uv, axis=0)
        for step in (1e-7, 1e-5, 1e-3):
            nudged = surface.derivatives(uv[broken] + step * (middle - uv[broken]))
            derivatives[broken] = nudged
            broken = ~np.isfinite(derivatives).all(axis=(1, 2))
            if not broken.any():
                return derivatives
        raise FaceProblem(f"the surface has no value at {int(broken.sum())} points")
    return derivatives


def constrained_delaunay(nodes: Floats, domain: Domain) -> tuple[Triangles, Ints]:
    """Triangulate the polygon with the nodes inside it.

    Returns
    -------
    triangles, neighbours : (m, 3) int
        Neighbour i lies across the side (i, i + 1), -1 outside.

    Raises
    ------
    FaceProblem
        The boundary crosses itself; names the two edges.
    """
    vertex_buffer: Any = np.ascontiguousarray(nodes)
    edge_buffer: Any = np.ascontiguousarray(domain.segments, dtype=np.uint32)
    triangulation = pythoncdt.Triangulation(
        pythoncdt.VertexInsertionOrder.AUTO, pythoncdt.IntersectingConstraintEdges.NOT_ALLOWED, 0.0
    )
    try:
        triangulation.insert_vertices(vertex_buffer)
        triangulation.insert_edges(edge_buffer)
        triangulation.erase_outer_triangles_and_holes()
    except RuntimeError as error:
        reason = str(error).split("\n")[0]
        raise FaceProblem(reason, _named_edges(reason, domain)) from error
    table = triangulation.triangles_array(copy=True)
    if not len(table):
        raise FaceProblem("the boundary polygon encloses nothing", domain.segment_edges.tolist())
    triangles = np.ascontiguousarray(table["vertices"]).astype(np.int64)
    neighbours = np.ascontiguousarray(table["neighbors"]).view(np.int32).astype(np.int64)
    return triangles, neighbours


def _named_edges(reason: str, domain: Domain) -> list[int]:
    """Find the B-rep edges of the node pairs that the triangulation's message names."""
    named: list[int] = []
    for a, b in re.findall(r"\((\d+), (\d+)\)", reason):
        pair = np.sort([int(a), int(b)])
        rows = (np.sort(domain.segments, axis=1) == pair).all(axis=1)
        named += domain.segment_edges[rows].tolist()
    return named or domain.segment_edges.tolist()


def _segment_keys(domain: Domain) -> tuple[Ints, Ints]:
    ordered = np.sort(domain.segments, axis=1)
    return np.unique(ordered[:, 0] * len(domain.uv) + ordered[:, 1], return_counts=True)


def _n_outer_sides(domain: Domain) -> int:
    """Count the segments used once; one used twice (a slit) has triangles on both sides."""
    _, counts = _segment_keys(domain)
    return int((counts % 2 == 1).sum())


def _locked_sides(triangles: Triangles, domain: Domain) -> Any:
    """Mark the sides on segments that have triangles on both sides (slits)."""
    locked = np.zeros((len(triangles), 3), np.uint8)
    keys, counts = _segment_keys(domain)
    slits = keys[counts % 2 == 0]
    if len(slits):
        a, b = triangles, triangles[:, [1, 2, 0]]
        n = len(domain.uv)
        on_boundary = (a < n) & (b < n)
        locked[on_boundary & np.isin(np.minimum(a, b) * n + np.maximum(a, b), slits)] = 1
    return locked
