"""A scan brought to the nominal part before it is evaluated."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, cast

from cadskin.cli._console import note, status
from cadskin.errors import SpecificationError

if TYPE_CHECKING:
    from cadskin.shape import NominalModel
    from cadskin.stats.registration import Alignment
    from cadskin.verify.scans import Scan

__all__ = ["aligned"]

_HOW = ("robust", "least_squares", "minimum_zone", "search")


def aligned(scan: Scan, nominal: NominalModel, how: str) -> Scan:
    """Return a scan in the coordinates of the nominal part; ``search`` also tries all rotations.

    Raises
    ------
    SpecificationError
        Another word.
    """
    from cadskin.stats.registration import register

    if how not in _HOW:
        raise SpecificationError(f"--align {how!r} is none of {', '.join(_HOW)}")
    alignment = cast("Alignment", "robust" if how == "search" else how)
    with status("aligning the scan"):
        found = register(
            scan.points, nominal, alignment=alignment, start="search" if how == "search" else None
        )
    note(f"aligned by {alignment}: {found.inliers:.1%} of the points count, scatter {found.scale:.3g} mm")
    for text in found.notes:
        note(text)
    return replace(scan, points=found.motion.apply(scan.points))
