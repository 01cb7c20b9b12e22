"""Dimensions: sizes and distances with their limits (ISO 14405)."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite
from typing import Literal, TypeAlias, get_args

from cadskin.errors import SpecificationError
from cadskin.spec.selection import FeatureSelection

__all__ = ["Dimension", "DimensionKind", "clean_sum"]

DimensionKind: TypeAlias = Literal["size", "location", "angular_size", "angular_location"]


def clean_sum(nominal: float, deviation: float) -> float:
    """Return a limit without the noise of the last bit: 6.35 + 0.0762 is 6.4262."""
    return float(f"{nominal + deviation:.15g}")


@dataclass(frozen=True)
class Dimension:
    """A size of one feature, or a distance or angle between two.

    Parameters
    ----------
    id : str
    kind : {"size", "location", "angular_size", "angular_location"}
    name : str
        ``diameter``, ``radius``, ``linear distance``, ...
    nominal : float or None
        [mm], or [rad] for an angle.
    lower, upper : float or None
        Limits of size, absolute [mm or rad]; None where there is none (a basic or reference dimension).
    feature : FeatureSelection
        The feature, or the first of two.
    second : FeatureSelection
        The second feature of a distance.
    fit : str or None
        Tolerance class of ISO 286, ``H7``; its limits are in `lower` and `upper`.
    qualifier : {"none", "basic", "reference"}
        A theoretically exact dimension, or one for information only.
    modifiers : tuple of str
        Further words of the file (``envelope requirement``, ``free state``, ...).
    raw_unit : str or None
        Unit as written.
    source : str or None
        Not compared.
    notes : tuple of str
        Not compared.
    """

    id: str
    kind: DimensionKind
    name: str = ""
    nominal: float | None = None
    lower: float | None = None
    upper: float | None = None
    feature: FeatureSelection = field(default_factory=FeatureSelection)
    second: FeatureSelection = field(default_factory=FeatureSelection)
    fit: str | None = None
    qualifier: Literal["none", "basic", "reference"] = "none"
    modifiers: tuple[str, ...] = ()
    raw_unit: str | None = None
    source: str | None = field(default=None, compare=False)
    notes: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        """Check the numbers and their order."""
        if self.kind not in get_args(DimensionKind):
            raise SpecificationError(
                f"dimension {self.id}: kind {self.kind!r} is none of {', '.join(get_args(DimensionKind))}"
            )
        for key in ("nominal", "lower", "upper"):
            value = getattr(self, key)
            if value is not None and not isfinite(value):
                raise SpecificationError(f"dimension {self.id}: {key} must be finite, got {value}")
        if self.lower is not None and self.upper is not None and self.lower > self.upper:
            raise SpecificationError(
                f"dimension {self.id}: the lower limit {self.lower:g} is above the upper limit {self.upper:g}"
            )

    @property
    def angular(self) -> bool:
        """True where the numbers are angles [rad]."""
        return self.kind.startswith("angular")

    @property
    def deviations(self) -> tuple[float | None, float | None]:
        """Signed lower and upper limit deviation from the nominal; None where it cannot be told."""
        if self.nominal is None:
            return None, None
        return (
            None if self.lower is None else self.lower - self.nominal,
            None if self.upper is None else self.upper - self.nominal,
        )

    def __str__(self) -> str:
        from cadskin.spec.frames import dimension_text

        return dimension_text(self)
