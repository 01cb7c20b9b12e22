"""What an association returns: the ideal feature, how well it fits, and what is proved about it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias

import numpy as np

from cadskin._arrays import frozen
from cadskin.shape.ideal import Cone, Cylinder, Plane, Sphere, Torus

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points, Vectors
    from cadskin.shape.association.pose import Pose

__all__ = ["AssociatedFeature", "Association", "Certificate", "Circle", "Criterion", "Kind", "Line", "Proof"]

Kind: TypeAlias = Literal["plane", "line", "profile line", "circle", "cylinder", "sphere", "cone", "torus"]
Criterion: TypeAlias = Literal[
    "least squares",
    "minimum zone",
    "minimum circumscribed",
    "maximum inscribed",
    "constrained least squares",
    "constrained least squares, inside",
]
# Scope, bound [mm] and reason of a certificate.
Proof: TypeAlias = tuple[Literal["global", "local"], float | None, str]


@dataclass(frozen=True, eq=False)
class Line:
    """A straight line: ``origin`` (3,) [mm] and unit ``direction`` (3,)."""

    kind: ClassVar[str] = "line"
    origin: Points
    direction: Vectors

    def distance(self, points: Points) -> Floats:
        """Distance (k,) [mm] of points (k, 3) from the line, not negative."""
        relative = np.asarray(points) - self.origin
        across = relative - (relative @ self.direction)[:, None] * self.direction
        return np.asarray(np.linalg.norm(across, axis=1))


@dataclass(frozen=True, eq=False)
class Circle:
    """A circle in a section plane: ``centre`` (3,) [mm], unit ``normal`` (3,), ``radius`` [mm]."""

    kind: ClassVar[str] = "circle"
    centre: Points
    normal: Vectors
    radius: float

    def distance(self, points: Points) -> Floats:
        """Signed distance (k,) [mm] within the plane, positive outside."""
        return Line(self.centre, self.normal).distance(points) - self.radius


AssociatedFeature: TypeAlias = Plane | Line | Circle | Cylinder | Sphere | Cone | Torus


@dataclass(frozen=True)
class Certificate:
    """What is proved about an association.

    Parameters
    ----------
    holds : bool
        The optimality conditions hold to rounding (for least squares: the gradient vanishes).
    scope : {"global", "local"}
        Whether no better feature exists anywhere, or none in the neighbourhood.
    kkt : float
        Residual of the Kuhn-Tucker conditions, in mm per mm.
    violation : float
        How far a point reaches beyond the active ones [mm].
    bound : float or None
        A value that no feature can be better than, where one is known [mm].
    reason : str
        How the scope is known.
    """

    holds: bool
    scope: Literal["global", "local"]
    kkt: float
    violation: float
    bound: float | None
    reason: str


@dataclass(frozen=True, eq=False)
class Association:
    """An ideal feature associated with points (ISO 17450-1).

    Parameters
    ----------
    kind, criterion : str
    feature : Plane, Line, Circle, Cylinder, Sphere, Cone or Torus
    value : float
        The optimised quantity [mm]: the root mean square distance (least squares), the width of the zone
        (minimum zone; for a line in space the diameter of the enclosing cylinder), the radius (circumscribed,
        inscribed), or the largest gap (constrained least squares).
    residuals : (n,) float
        Signed distances from ``feature`` [mm].
    active : (k,) int
        Points that carry the optimum.
    sides : (k,) int
        +1 where the active point is on the outer side, -1 on the inner side.
    multipliers : (k,) float
        Kuhn-Tucker multipliers of the active points.
    certificate : Certificate
    unique : bool
        False where other features reach the same value.
    pose : Pose
        Frame and shape numbers of the feature; for further work.
    """

    kind: Kind
    criterion: Criterion
    feature: AssociatedFeature
    value: float
    residuals: Floats
    active: Ints
    sides: Ints
    multipliers: Floats
    certificate: Certificate
    unique: bool
    pose: Pose

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, "residuals", frozen(self.residuals, name="residuals"))
        for name in ("active", "sides"):
            object.__setattr__(self, name, frozen(getattr(self, name), dtype=np.int64, name=name))
        object.__setattr__(self, "multipliers", frozen(self.multipliers, name="multipliers"))

    @property
    def certified(self) -> bool:
        """Whether the certificate holds."""
        return self.certificate.holds

    @property
    def width(self) -> float:
        """Peak-to-valley of the residuals [mm]."""
        return float(np.ptp(self.residuals))

    @property
    def n_points(self) -> int:
        """Number of points."""
        return len(self.residuals)

    @property
    def radius(self) -> float | None:
        """Radius of a circle, cylinder or sphere [mm]."""
        value: Any = getattr(self.feature, "radius", None)
        return None if value is None else float(value)
