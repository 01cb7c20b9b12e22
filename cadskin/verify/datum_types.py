"""Datum features, established datums and datum frames as plain values (ISO 5459)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.shape.association import Pose

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors

__all__ = [
    "DatumCriterion",
    "DatumFeature",
    "DatumFrame",
    "DatumKind",
    "EstablishedDatum",
    "Standard",
    "criterion_of",
]

DatumKind: TypeAlias = Literal["plane", "cylinder", "sphere", "width", "complex"]
DatumCriterion: TypeAlias = Literal[
    "minimax", "least squares", "constrained least squares", "inscribed", "circumscribed"
]
Standard: TypeAlias = Literal["ISO 5459:2011", "ASME Y14.5.1-2019", "custom"]


@dataclass(frozen=True, eq=False)
class DatumFeature:
    """The points of a datum feature and how its datum is associated.

    Parameters
    ----------
    label : str
    kind : {"plane", "cylinder", "sphere", "width"}
    points : (n, 3) float
        For a width: the points of both faces.
    internal : bool
        Whether the material is outside (a hole, a slot).
    hint : (3,) float, optional
        Outward normal of a plane, direction of an axis; need not be exact.
    criterion : str, optional
        Only needed for ``standard="custom"``.
    opposite : (m, 3) float, optional
        Points of the second face of a width.
    radii : (n,) float, optional
        For a common datum of coaxial cylinders (A-B): the nominal radius at each point [mm].
    levels : (n,) float, optional
        For a common datum of parallel planes at different heights: the nominal height at each point along
        the hint [mm].
    orientation_only : bool
        The datum holds rotations only (ISO 5459 ><).
    """

    label: str
    kind: DatumKind
    points: Points
    internal: bool = False
    hint: Vectors | None = None
    criterion: DatumCriterion | None = None
    opposite: Points | None = None
    radii: Floats | None = None
    levels: Floats | None = None
    orientation_only: bool = False


@dataclass(frozen=True, eq=False)
class EstablishedDatum:
    """A datum: its situation feature and the association behind it.

    Parameters
    ----------
    label : str
    kind : str
    point : (3,) float
    direction : (3,) float
        Outward normal of a plane, direction of an axis, normal of a median plane; zero for a point.
    size : float or None
        Radius or width [mm].
    criterion : str
    certified : bool
    orientation_only : bool
        It holds rotations only.
    """

    label: str
    kind: DatumKind
    point: Points
    direction: Vectors
    size: float | None
    criterion: str
    certified: bool
    orientation_only: bool = False

    def text(self) -> str:
        """Return the operation that was applied, for the record."""
        only = ", orientation only" if self.orientation_only else ""
        return f"association of datum {self.label}: {self.kind}, {self.criterion}{only}"


@dataclass(frozen=True, eq=False)
class DatumFrame:
    """A datum system: frame, freedoms that are left, and its datums.

    Parameters
    ----------
    origin : (3,) float
    axes : (3, 3) float
        Columns x, y, z; z against the outward normal of a primary plane or along a primary axis.
    free : tuple of str
        Motions that the datums leave, in the frame's axes.
    datums : tuple of EstablishedDatum
    standard : str
    """

    origin: Points
    axes: Vectors
    free: tuple[str, ...]
    datums: tuple[EstablishedDatum, ...]
    standard: Standard

    @property
    def certified(self) -> bool:
        """Whether all associations are proved."""
        return all(datum.certified for datum in self.datums)

    @property
    def pose(self) -> Pose:
        """The frame as a pose."""
        return Pose(self.origin, self.axes, np.zeros(2))

    def operations(self) -> tuple[str, ...]:
        """Return the operations that were applied."""
        return (f"datum system by {self.standard}", *(datum.text() for datum in self.datums))


def criterion_of(feature: DatumFeature, standard: Standard) -> DatumCriterion:
    """Return the criterion of a datum feature under a standard.

    Raises
    ------
    SpecificationError
        ``custom`` without a criterion.
    """
    if standard == "custom" or feature.criterion is not None:
        if feature.criterion is None:
            raise SpecificationError(f"datum {feature.label}: standard 'custom' needs a criterion per datum")
        return feature.criterion
    if feature.kind == "plane":
        return "minimax" if standard == "ISO 5459:2011" else "constrained least squares"
    return "inscribed" if feature.internal else "circumscribed"
