"""Bands: requirements that are a seminorm of the deviations of one plane, whatever the datum lets free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from cadskin.conform._bands import exchange
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints
    from cadskin.conform.flat import FlatPlaces

__all__ = ["Band", "fixed_band", "flat_band", "level_band"]


@dataclass(frozen=True, eq=False)
class Band:
    """A zone of parallel planes that deviations have to fit.

    Parameters
    ----------
    kind : {0, 1, 3}
        Free parameters: none (a fixed zone about the nominal plane), the level (a zone of given direction),
        level and slopes (a form zone).
    rows : (n,) int
        Samples in it.
    limit : float
        Widest allowed [mm].
    flat : FlatPlaces or None
        Of kind 3.
    label : str
        What messages call it.
    """

    kind: Literal[0, 1, 3]
    rows: Ints
    limit: float
    flat: FlatPlaces | None = None
    label: str = "the zone"

    def __post_init__(self) -> None:
        if (self.kind == 3) != (self.flat is not None):
            raise DeviationError("a band of kind 3 needs the places of its points, others do not")
        if not (np.isfinite(self.limit) and self.limit > 0):
            raise DeviationError(f"{self.label}: the limit must be positive and finite, got {self.limit} mm")

    def width(self, heights: Floats) -> float:
        """Return the width that deviations (n,) need [mm]."""
        if self.flat is not None:
            return self.flat.bounds(heights)[1]
        if self.kind == 1:
            return float(np.ptp(heights))
        return 2.0 * float(np.abs(heights).max(initial=0.0))

    def holds(self, heights: Floats) -> bool:
        """Tell whether deviations (n,) fit."""
        if self.flat is not None:
            return self.flat.bounds(heights, self.limit)[1] <= self.limit
        return self.width(heights) <= self.limit

    def support(self, heights: Floats) -> Ints:
        """Return the points (up to 4) that say how wide the band of deviations (n,) is."""
        if self.flat is None:
            return np.array([int(np.argmin(heights)), int(np.argmax(heights))])
        reference, weights = self.flat.reference.copy(), np.zeros(4)
        exchange(self.flat.columns, np.ascontiguousarray(heights), 0.0, reference, weights, np.zeros(3))
        return reference


def flat_band(flat: FlatPlaces, rows: Ints, limit: float, label: str = "the zone") -> Band:
    """Return the band of a flatness."""
    return Band(3, rows, limit, flat, label)


def level_band(rows: Ints, limit: float, label: str = "the zone") -> Band:
    """Return the band of given direction and free level: ``max - min <= limit``."""
    return Band(1, rows, limit, None, label)


def fixed_band(rows: Ints, limit: float, label: str = "the zone") -> Band:
    """Return the fixed band about the nominal plane: ``|deviation| <= limit / 2``."""
    return Band(0, rows, limit, None, label)
