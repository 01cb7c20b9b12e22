"""B-rep edges, sampled once so that all faces at an edge share its points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.GeomAbs import GeomAbs_CurveType
from OCP.gp import gp_Pnt, gp_Vec
from OCP.Standard import Standard_Failure

from cadskin._typing import Floats, Ints, Points
from cadskin.cad._occ import xyz

__all__ = ["EdgeCurve", "EdgeSamples", "read_edge", "sample_edge", "segments_for"]

SEGMENTS_OF_A_POLE = 6
_LINE = GeomAbs_CurveType.GeomAbs_Line
_CIRCLE = GeomAbs_CurveType.GeomAbs_Circle
_SMOOTH_PROBES = 33


@dataclass(frozen=True, eq=False)
class EdgeCurve:
    """The curve of an edge with its length and turning, measured once.

    Parameters
    ----------
    ends : (2,) int
        Vertices at the first and last parameter.
    parameters, arc : (k,) float
        Parameters and the arc length up to each [mm]; two of each for lines and circles.
    turn : float
        Total turning of the tangent [rad].
    degenerate : bool
        True where the edge is one point (a pole, an apex).
    tolerance : float
        The file's own tolerance of the edge, or the gap between curve and vertices where that is more [mm].
    adaptor : BRepAdaptor_Curve or None
    """

    ends: Ints
    parameters: Floats
    arc: Floats
    turn: float
    degenerate: bool
    tolerance: float
    adaptor: Any

    @property
    def length(self) -> float:
        """Length [mm]."""
        return float(self.arc[-1])

    @property
    def closed(self) -> bool:
        """Whether the edge starts and ends in one vertex."""
        return bool(self.ends[0] == self.ends[1])

    @property
    def straight(self) -> bool:
        """Whether more segments would change nothing."""
        return self.degenerate or self.turn < 1e-6


@dataclass(frozen=True, eq=False)
class EdgeSamples:
    """Points of an edge.

    Parameters
    ----------
    parameters : (n + 1,) float
    points : (n + 1, 3) float
        The first and last are the vertices [mm].
    sizes : (n + 1,) float
        Local distance of the points, at most the wanted edge length [mm].
    """

    parameters: Floats
    points: Points
    sizes: Floats

    @property
    def n_segments(self) -> int:
        """Number of segments."""
        return len(self.parameters) - 1


def read_edge(edge: Any, ends: Ints, vertices: Points) -> EdgeCurve:
    """Measure the curve of an edge."""
    tolerance = BRep_Tool.Tolerance_s(edge)
    if BRep_Tool.Degenerated_s(edge):
        span = np.array(BRep_Tool.Range_s(edge), dtype=np.float64)
        return EdgeCurve(ends, span, np.zeros(2), 0.0, True, tolerance, None)
    curve = BRepAdaptor_Curve(edge)
    span = np.array([curve.FirstParameter(), curve.LastParameter()])
    for vertex, parameter in zip(ends.tolist(), span.tolist(), strict=True):
        tolerance = max(tolerance, math.dist(xyz(curve.Value(parameter)), vertices[vertex]))
    kind = curve.GetType()
    width = abs(float(span[1] - span[0]))
    if kind == _LINE:
        return EdgeCurve(ends, span, np.array([0.0, width]), 0.0, False, tolerance, curve)
    if kind == _CIRCLE:
        length = width * curve.Circle().Radius()
        return EdgeCurve(ends, span, np.array([0.0, length]), width, False, tolerance, curve)
    probes = _probes_of(curve, kind)
    parameters = np.linspace(span[0], span[1], probes)
    arc, turn = _arc_and_turn(curve, parameters)
    return EdgeCurve(ends, parameters, arc, turn, False, tolerance, curve)


def _probes_of(curve: Any, kind: Any) -> int:
    if kind == GeomAbs_CurveType.GeomAbs_BSplineCurve:
        return int(np.clip(6 * (curve.NbKnots() - 1) + 1, _SMOOTH_PROBES, 1001))
    return _SMOOTH_PROBES


def _arc_and_turn(curve: Any, parameters: Floats) -> tuple[Floats, float]:
    """Arc length at each parameter (Simpson over the probes' middles) and the turning of the tangent."""
    middles = 0.5 * (parameters[1:] + parameters[:-1])
    both = np.zeros(len(parameters) + len(middles))
    both[::2], both[1::2] = parameters, middles
    tangents = np.zeros((len(both), 3))
    point, tangent = gp_Pnt(), gp_Vec()
    for row, parameter in zip(tangents, both.tolist(), strict=True):
        try:
            curve.D1(parameter, point, tangent)
        except Standard_Failure:  # no derivative at a singular end: the neighbours carry the estimate
            continue
        row[:] = xyz(tangent)
    speed = np.linalg.norm(tangents, axis=1)
    steps = np.diff(parameters) / 6.0 * (speed[:-2:2] + 4.0 * speed[1::2] + speed[2::2])
    arc = np.concatenate([[0.0], np.cumsum(np.abs(steps))])
    valid = speed > 1e-12 * max(float(speed.max()), 1e-300)
    units = tangents[valid] / speed[valid, None]
    cosines = np.clip(np.einsum("ni,ni->n", units[1:], units[:-1]), -1.0, 1.0)
    return arc, float(np.arccos(cosines).sum())


def segments_for(curve: EdgeCurve, edge_length: float, max_turn: float) -> int:
    """Return the number of segments for a wanted edge length [mm] and turning per segment [rad]."""
    if curve.degenerate:
        return SEGMENTS_OF_A_POLE
    count = max(1, round(curve.length / edge_length), math.ceil(curve.turn / max_turn - 1e-6))
    return max(count, 3) if curve.closed else count


def sample_edge(curve: EdgeCurve, n_segments: int, edge_length: float, vertices: Points) -> EdgeSamples:
    """Sample an edge with points at equal arc lengths."""
    parameters = _equal_steps(curve, n_segments)
    points = np.zeros((n_segments + 1, 3))
    points[0], points[-1] = vertices[curve.ends[0]], vertices[curve.ends[1]]
    if curve.degenerate:
        points[:] = points[0]
        return EdgeSamples(parameters, points, np.full(n_segments + 1, edge_length))
    value = curve.adaptor.Value
    for k in range(1, n_segments):
        points[k] = xyz(value(float(parameters[k])))
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    sizes = np.zeros(n_segments + 1)
    sizes[0], sizes[-1] = lengths[0], lengths[-1]
    sizes[1:-1] = 0.5 * (lengths[1:] + lengths[:-1])
    return EdgeSamples(parameters, points, np.minimum(sizes, edge_length))


def _equal_steps(curve: EdgeCurve, n_segments: int) -> Floats:
    first, last = float(curve.parameters[0]), float(curve.parameters[-1])
    if len(curve.parameters) == 2 or n_segments == 1 or not curve.length > 0:
        return np.linspace(first, last, n_segments + 1)
    steps = np.linspace(0.0, curve.length, n_segments + 1)
    parameters = np.interp(steps, curve.arc, curve.parameters)
    parameters[0], parameters[-1] = first, last
    return parameters
