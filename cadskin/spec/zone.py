"""The tolerance zone (ISO 1101, clause 7): its shape, and where it lies."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Literal, TypeAlias, get_args

from cadskin.errors import SpecificationError

__all__ = ["AreaShape", "AreaUnit", "ToleranceZone", "ZoneShape"]

ZoneShape: TypeAlias = Literal["width", "diameter", "spherical_diameter"]
AreaShape: TypeAlias = Literal["square", "rectangular", "circular", "cylindrical", "spherical"]


@dataclass(frozen=True)
class AreaUnit:
    """A restricted area, anywhere on the feature: its shape (AP242 ``area_unit_type``) and size [mm]."""

    shape: AreaShape = "square"
    size: float | None = None
    second: float | None = None

    def __post_init__(self) -> None:
        """Check the shape and that the sizes are finite."""
        if not all(isfinite(size) for size in (self.size, self.second) if size is not None):
            raise SpecificationError("the sizes of an area per unit must be finite")
        if self.shape not in get_args(AreaShape):
            raise SpecificationError(
                f"area per unit {self.shape!r} is none of {', '.join(get_args(AreaShape))}"
            )


@dataclass(frozen=True)
class ToleranceZone:
    """What a tolerance zone is beside its width.

    Parameters
    ----------
    shape : {"width", "diameter", "spherical_diameter"}
        Whether the value is the distance of two surfaces, or a diameter (⌀, S⌀).
    form : str or None
        Name of the zone form in AP242 where it is not the usual one of `shape`.
    projected : float or None
        Length of a projected zone Ⓟ [mm].
    projected_offset : float or None
        Start of the projected zone above the surface [mm].
    outside : float or None
        Unequally disposed: the part of the value that lies outside of the material (ASME Ⓤ) [mm].
    maximum : float or None
        Largest value that the zone may reach through material modifiers (MAX) [mm].
    per_length : float or None
        The value holds on each length of this size [mm].
    per_area : AreaUnit or None
        The value holds on each area of this size.
    combined : bool or None
        True for one common zone of all members (CZ), False for separate ones (SZ), None if unsaid.
    angle : float or None
        Angle of a run-out zone or an oriented zone [rad].
    """

    shape: ZoneShape = "width"
    form: str | None = None
    projected: float | None = None
    projected_offset: float | None = None
    outside: float | None = None
    maximum: float | None = None
    per_length: float | None = None
    per_area: AreaUnit | None = None
    combined: bool | None = None
    angle: float | None = None

    def __post_init__(self) -> None:
        """Check that the numbers are finite and lengths not negative."""
        if self.shape not in get_args(ZoneShape):
            raise SpecificationError(f"zone {self.shape!r} is none of {', '.join(get_args(ZoneShape))}")
        for key in ("projected", "projected_offset", "outside", "maximum", "per_length", "angle"):
            value = getattr(self, key)
            if value is not None and not isfinite(value):
                raise SpecificationError(f"zone: {key} must be finite, got {value}")
        for key in ("projected", "maximum", "per_length"):
            value = getattr(self, key)
            if value is not None and value < 0:
                raise SpecificationError(f"zone: {key} must not be negative, got {value}")

    def bounds(self, value: float) -> tuple[float, float]:
        """Return the lowest and highest signed deviation [mm] that a profile zone of this value allows.

        Positive is out of the material. Without an unequal disposition the zone is symmetric.

        References
        ----------
        ASME Y14.5-2018, 11.3 (Ⓤ); ISO 1660 (UZ).

        Examples
        --------
        >>> ToleranceZone(outside=0.1).bounds(0.3)
        (-0.19999999999999998, 0.1)
        """
        if self.outside is None:
            return -value / 2, value / 2
        return self.outside - value, self.outside

    def offset(self, value: float) -> float:
        """Return the shift of the zone's middle from the nominal surface, the number behind UZ in ISO [mm].

        Positive is out of the material. ASME states the amount outside, ISO the shift of the middle:
        ``shift = outside - value / 2``.
        """
        return 0.0 if self.outside is None else self.outside - value / 2

    @staticmethod
    def outside_of_offset(value: float, offset: float) -> float:
        """Return the ASME Ⓤ amount [mm] of an ISO UZ shift [mm] for a tolerance value [mm]."""
        return offset + value / 2
