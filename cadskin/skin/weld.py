"""The weld: one scalar per feature sample becomes one displacement per vertex (DESIGN.md, decision 1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from cadskin._arrays import frozen
from cadskin.shape.check import inverted_triangles
from cadskin.skin._constraints import VertexConstraints, vertex_constraints
from cadskin.skin._spread import Spread, edge_spread, face_spread
from cadskin.skin._unfold import unfold

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from cadskin._typing import Floats, Vectors
    from cadskin.shape import NominalModel

__all__ = ["WeldOperator", "WeldReport", "prepare_weld", "vertex_deviation", "weld", "weld_report"]

FLAT = 0.02
"""A triangle whose projected area falls to this part of its nominal area is unfolded."""


@dataclass(frozen=True, eq=False)
class WeldOperator:
    """The linear part of the weld, factorised once per nominal model.

    Parameters
    ----------
    constraints : VertexConstraints
    along_edges, into_faces : Spread
    """

    constraints: VertexConstraints
    along_edges: Spread
    into_faces: Spread

    def displacement(self, deviation: Floats) -> Vectors:
        """Return the displacement (n, 3) [mm] of a deviation field (n_c,) [mm]; linear in it."""
        moved: Vectors = (self.constraints.particular @ deviation).reshape(-1, 3)
        self.along_edges.apply(moved)
        self.into_faces.apply(moved)
        return moved

    def realised(self, displacement: Vectors) -> Floats:
        """Return the deviation (n_c,) [mm] that a displacement (n, 3) realises at each sample."""
        return np.asarray(self.constraints.equations @ displacement.ravel(), dtype=np.float64)


_OPERATORS: WeakKeyDictionary[NominalModel, WeldOperator] = WeakKeyDictionary()


def prepare_weld(nominal: NominalModel) -> WeldOperator:
    """Return the weld operator of a nominal model (kept as long as the model lives)."""
    if nominal not in _OPERATORS:
        constraints = vertex_constraints(nominal)
        _OPERATORS[nominal] = WeldOperator(
            constraints,
            edge_spread(nominal, constraints.rank, constraints.free),
            face_spread(nominal, constraints.rank, constraints.free),
        )
    return _OPERATORS[nominal]


def weld(nominal: NominalModel, deviation: ArrayLike) -> Vectors:
    """Turn a deviation field into vertex displacements.

    A vertex of the features f moves by the shortest d with ``n_f . d = delta_f`` for all of them, n_f being
    the exact nominal normals. What an edge moves along a face is spread into the face along the tangent
    planes, so that every other sample keeps its deviation to rounding. Where triangles would fold none the
    less (rough fields beyond about a third of the edge length), vertices slide along their faces and edges
    until none does.

    Parameters
    ----------
    nominal : NominalModel
    deviation : (n_c,) array_like of float
        Deviation along the nominal normal at each feature sample [mm], + = material added.

    Returns
    -------
    (n, 3) float
        Displacement of each vertex of ``nominal.surface`` [mm].

    Raises
    ------
    GeometryError
        Wrong length, or NaN.

    Notes
    -----
    - The realised deviation is the component of the displacement along the nominal normal at the sample. On a
      plane it is the distance to the plane. On a curved face it is the distance to the face up to
      ``kappa t² / 2`` for a tangential shift t, kappa being the curvature in its direction.
    - Features that meet under less than 10° (`cadskin.shape.patches.TANGENT_ANGLE`) share the mean of their
      deviations there.
    - Where four or more features meet with deviations that contradict each other, the sum of the squared
      residuals is least; `weld_report` tells both.
    - Without folds the displacement is linear in the deviation. Self-intersections are not looked for here;
      see `cadskin.skin.faults.check_skin`.

    Examples
    --------
    >>> import cadquery as cq, cadskin as cs
    >>> part = cs.nominal(cq.Workplane().box(4, 4, 2), edge_length=1.0)
    >>> grown = part.surface.with_points(part.surface.points + cs.weld(part, [0.1] * part.n_samples))
    >>> round(grown.volume, 9)
    38.808
    """
    field = frozen(deviation, shape=(nominal.n_samples,), name="deviation")
    operator = prepare_weld(nominal)
    displacement = operator.displacement(field)
    surface = nominal.surface
    folded = inverted_triangles(surface.points + displacement, surface.points, surface.triangles, tol=FLAT)
    if folded.any():
        displacement = unfold(surface, displacement, operator.constraints.free)
    return frozen(displacement)


@dataclass(frozen=True)
class WeldReport:
    """How well a weld could follow its deviation field.

    Parameters
    ----------
    max_residual : float
        Largest difference between the realised and the prescribed deviation [mm].
    residual_feature : str
        Feature where it is.
    max_disagreement : float
        The part of it that comes from tangent features asking for different deviations at one vertex [mm].
    n_disagreeing : int
        Samples where tangent features disagree by more than 1e-9 mm.
    n_overdetermined : int
        Samples where more features meet than a point can follow, with a residual above 1e-9 mm.
    n_inverted : int
        Triangles that are turned over against the nominal ones.
    max_displacement : float
        Longest move of a vertex [mm].
    max_slide_error : float
        Largest ``|kappa| t² / 2`` for a slide t along a face of curvature kappa in its direction [mm]: to
        second order, by so much the distance to the face differs from the realised deviation.
    """

    max_residual: float
    residual_feature: str
    max_disagreement: float
    n_disagreeing: int
    n_overdetermined: int
    n_inverted: int
    max_displacement: float
    max_slide_error: float


def weld_report(nominal: NominalModel, deviation: ArrayLike, displacement: Vectors) -> WeldReport:
    """Compare what a displacement realises with the deviation field (n_c,) that was asked for."""
    operator = prepare_weld(nominal)
    constraints = operator.constraints
    residual = np.abs(operator.realised(displacement) - np.asarray(deviation, dtype=np.float64))
    worst = int(np.argmax(residual)) if len(residual) else 0
    wrong = residual > 1e-9
    surface = nominal.surface
    inverted = inverted_triangles(surface.points + displacement, surface.points, surface.triangles)
    feature = next((f.name for f in nominal.features if f.start <= worst < f.stop), "")
    return WeldReport(
        max_residual=float(residual.max(initial=0.0)),
        residual_feature=feature,
        max_disagreement=float(residual[constraints.shared].max(initial=0.0)),
        n_disagreeing=int((wrong & constraints.shared).sum()),
        n_overdetermined=int((wrong & constraints.overdetermined & ~constraints.shared).sum()),
        n_inverted=int(inverted.sum()),
        max_displacement=float(np.linalg.norm(displacement, axis=1).max(initial=0.0)),
        max_slide_error=float(_slide_errors(nominal, displacement).max(initial=0.0)),
    )


def _slide_errors(nominal: NominalModel, displacement: Vectors) -> Floats:
    """Return |kappa(t)| t² / 2 for the tangential part t of the move at each sample (n_c,) [mm]."""
    samples = nominal.samples
    moves = displacement[samples.vertex_ids]
    along = np.einsum("kai,ki->ka", samples.directions, moves)
    error = 0.5 * np.abs((samples.curvatures * along**2).sum(axis=1))
    return np.asarray(np.where(samples.singular, 0.0, error))


def vertex_deviation(nominal: NominalModel, deviation: Floats) -> Floats:
    """Return one deviation per vertex (n,) [mm]: that of largest magnitude among its features, 0 without any.

    Parameters
    ----------
    nominal : NominalModel
    deviation : (n_c,) float
        [mm].
    """
    values = np.asarray(deviation, dtype=np.float64)
    result = np.zeros(nominal.surface.n_points)
    order = np.argsort(np.abs(values), kind="stable")
    result[nominal.samples.vertex_ids[order]] = values[order]  # of equal indices the last one stays
    return frozen(result)
