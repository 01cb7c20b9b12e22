"""The polygon of a face in its parameter plane, with nodes that its neighbours share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.Geom2d import Geom2d_Line
from OCP.gp import gp_Pnt
from OCP.ShapeAnalysis import ShapeAnalysis_Surface

from cadskin._typing import Floats, Ints, Points
from cadskin.cad.meshing.edges import EdgeCurve, EdgeSamples
from cadskin.cad.meshing.topology import EdgeUse
from cadskin.cad.surface import FaceSurface

__all__ = ["Domain", "FaceProblem", "face_domain"]


class FaceProblem(Exception):
    """A face that this attempt cannot mesh; names the edges whose refinement may help."""

    def __init__(self, reason: str, edges: Sequence[int] = ()) -> None:
        super().__init__(reason)
        self.reason = reason
        self.edges = tuple(edges)


@dataclass(frozen=True, eq=False)
class Domain:
    """Boundary polygon of a face.

    Parameters
    ----------
    uv : (n, 2) float
        Surface parameters of the nodes.
    nodes : (n, 2) int
        Edge and position on it of each node: its name in the whole mesh.
    vertex_ids : (n,) int
        Vertex of the shape, -1 for a point inside an edge.
    points : (n, 3) float
        The shared points [mm].
    sizes : (n,) float
        Wanted edge length there [mm].
    segments : (m, 2) int
        Boundary segments in the direction of the face's wires.
    segment_edges : (m,) int
    reprojected : int
        Number of nodes whose stored parameters disagreed with their point.
    """

    uv: Floats
    nodes: Ints
    vertex_ids: Ints
    points: Points
    sizes: Floats
    segments: Ints
    segment_edges: Ints
    reprojected: int


def face_domain(
    face: Any,
    surface: FaceSurface,
    uses: Sequence[EdgeUse],
    curves: Sequence[EdgeCurve],
    samples: Sequence[EdgeSamples],
    *,
    reproject: bool = False,
) -> Domain:
    """Gather the boundary of a face (FORWARD) from its edge uses.

    Parameters
    ----------
    reproject : bool
        Distrust all parameter curves: project every boundary point onto the surface.

    Raises
    ------
    FaceProblem
        No edges, or no extent in the parameter plane.
    """
    if not uses:
        raise FaceProblem("the face has no boundary edges")
    chains = [samples[use.edge] for use in uses]
    counts = np.array([len(chain.parameters) for chain in chains])
    starts = np.concatenate([[0], np.cumsum(counts)])
    points = np.concatenate([chain.points for chain in chains])
    sizes = np.concatenate([chain.sizes for chain in chains])
    edge_ids = np.repeat([use.edge for use in uses], counts)
    positions = np.arange(starts[-1]) - np.repeat(starts[:-1], counts)
    vertex_ids = np.full(starts[-1], -1, dtype=np.int64)
    for use, start, stop in zip(uses, starts[:-1].tolist(), (starts[1:] - 1).tolist(), strict=True):
        curve = curves[use.edge]
        if curve.degenerate:
            vertex_ids[start : stop + 1] = curve.ends[0]
        else:
            vertex_ids[start], vertex_ids[stop] = curve.ends[0], curve.ends[1]
    flat = surface.kind == "plane"
    if flat:
        uv, moved = (points - surface.frame[0]) @ surface.frame[1:3].T, 0
    else:
        uv, moved = _parameters(face, surface, uses, curves, chains, points, sizes, reproject)
    node_of = _merge_ends(uses, curves, starts, uv, flat)
    first, node_of = np.unique(node_of, return_inverse=True)
    segments, segment_edges = _segments(uses, starts, node_of)
    box = np.ptp(uv, axis=0)
    if not (box > 0).all():
        raise FaceProblem("the face has no extent in its parameter plane")
    merged_sizes = np.zeros(len(first))
    np.maximum.at(merged_sizes, node_of, sizes)
    return Domain(
        uv=uv[first],
        nodes=np.stack([edge_ids[first], positions[first]], axis=1),
        vertex_ids=vertex_ids[first],
        points=points[first],
        sizes=merged_sizes,
        segments=segments,
        segment_edges=segment_edges,
        reprojected=moved,
    )


def _segments(uses: Sequence[EdgeUse], starts: Ints, node_of: Ints) -> tuple[Ints, Ints]:
    pieces, edges = [], []
    for use, start, stop in zip(uses, starts[:-1].tolist(), starts[1:].tolist(), strict=True):
        chain = node_of[start:stop]
        pair = (chain[:-1], chain[1:]) if use.forward else (chain[:0:-1], chain[-2::-1])
        pieces.append(np.stack(pair, axis=1))
        edges.append(np.full(stop - start - 1, use.edge))
    segments, segment_edges = np.concatenate(pieces), np.concatenate(edges)
    real = segments[:, 0] != segments[:, 1]
    return segments[real], segment_edges[real]


def _parameters(
    face: Any,
    surface: FaceSurface,
    uses: Sequence[EdgeUse],
    curves: Sequence[EdgeCurve],
    chains: Sequence[EdgeSamples],
    points: Points,
    sizes: Floats,
    reproject: bool,
) -> tuple[Floats, int]:
    """Return the surface parameters of the boundary points; those that miss their point are projected."""
    uv = np.concatenate(
        [_curve_parameters(use, face, chain.parameters) for use, chain in zip(uses, chains, strict=True)]
    )
    tolerance = np.concatenate(
        [
            np.full(len(chain.parameters), curves[use.edge].tolerance)
            for use, chain in zip(uses, chains, strict=True)
        ]
    )
    degenerate = np.concatenate(
        [
            np.full(len(chain.parameters), curves[use.edge].degenerate)
            for use, chain in zip(uses, chains, strict=True)
        ]
    )
    known = np.isfinite(uv).all(axis=1)
    miss = np.full(len(uv), np.inf)
    miss[known] = np.linalg.norm(surface.points(uv[known]) - points[known], axis=1)
    wrong = ~(miss <= np.maximum(2.0 * tolerance, 0.02 * sizes)) & ~degenerate
    if reproject:
        wrong = ~(miss <= 1e-3 * sizes) & ~degenerate
    if wrong.any():
        project_onto(surface, points, uv, miss, np.flatnonzero(wrong))
    if not np.isfinite(uv).all():
        raise FaceProblem("boundary points cannot be projected onto the surface")
    return uv, int(wrong.sum())


def _curve_parameters(use: EdgeUse, face: Any, parameters: Floats) -> Floats:
    """Evaluate the parameter curve of an edge; NaN where the file has none."""
    curve = BRep_Tool.CurveOnSurface_s(use.shape, face, 0.0, 0.0)
    if curve is None:
        return np.full((len(parameters), 2), np.nan)
    if isinstance(curve, Geom2d_Line):
        start, along = curve.Location(), curve.Direction()
        return np.stack([start.X() + parameters * along.X(), start.Y() + parameters * along.Y()], axis=1)
    value = curve.Value
    return np.array([(p.X(), p.Y()) for p in map(value, parameters.tolist())])


def project_onto(surface: FaceSurface, points: Points, uv: Floats, miss: Floats, rows: Ints) -> None:
    """Project points onto the surface in place, where that comes nearer; periods stay near the old value."""
    analysis = ShapeAnalysis_Surface(surface.geometry)
    geometry = surface.geometry
    periods = (
        geometry.UPeriod() if geometry.IsUPeriodic() else 0.0,
        geometry.VPeriod() if geometry.IsVPeriodic() else 0.0,
    )
    for row in rows.tolist():
        found = analysis.ValueOfUV(gp_Pnt(*points[row].tolist()), 1e-7)
        new = np.array([found.X(), found.Y()])
        distance = float(np.linalg.norm(surface.points(new[None])[0] - points[row]))
        if not distance < miss[row]:
            continue
        for axis, period in enumerate(periods):
            near = uv[row, axis] if np.isfinite(uv[row, axis]) else uv[max(row - 1, 0), axis]
            if period > 0 and np.isfinite(near):
                new[axis] += round((near - new[axis]) / period) * period
        uv[row], miss[row] = new, distance


def _merge_ends(
    uses: Sequence[EdgeUse],
    curves: Sequence[EdgeCurve],
    starts: Ints,
    uv: Floats,
    flat: bool,
) -> Ints:
    """Return for each point the point it is one with: ends of edges that meet in one corner of the polygon.

    Each end has one partner at its vertex. A vertex with two ends needs no measuring; at one with more (a
    seam) the nearest pairs are taken first, so that no tolerance is needed.
    On a plane a vertex is one corner.
    """
    node_of = np.arange(len(uv))
    at_vertex: dict[int, list[int]] = {}
    for use, start, stop in zip(uses, starts[:-1].tolist(), (starts[1:] - 1).tolist(), strict=True):
        first, last = curves[use.edge].ends.tolist()
        at_vertex.setdefault(first, []).append(start)
        at_vertex.setdefault(last, []).append(stop)
    scale = None
    for ends in at_vertex.values():
        if flat or len(ends) <= 2:
            node_of[ends] = min(ends)
            continue
        if scale is None:
            scale = np.ptp(uv, axis=0)
            scale[scale <= 0] = 1.0
        _pair_nearest(ends, uv / scale, node_of)
    return node_of


def _pair_nearest(ends: list[int], scaled: Floats, node_of: Ints) -> None:
    distances = sorted(
        (math.dist(scaled[a], scaled[b]), a, b) for i, a in enumerate(ends) for b in ends[i + 1 :]
    )
    free = set(ends)
    for distance, a, b in distances:
        together = distance < 1e-9
        if together or (a in free and b in free):
            free -= {a, b}
            low, high = sorted((int(node_of[a]), int(node_of[b])))
            for end in ends:
                if node_of[end] == high:
                    node_of[end] = low
