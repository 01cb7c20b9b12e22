"""The tolerance that holds where a user names none: a general tolerance by size."""

from __future__ import annotations

from bisect import bisect_left

from cadskin.errors import GeometryError

__all__ = ["general_tolerance"]

# ISO 2768-2:1989, table 1 (straightness and flatness), class K: up to and including this length [mm] -> [mm].
# Withdrawn in 2021 in favour of ISO 22081, which has no table; drawings go on citing "ISO 2768-mK".
LENGTHS = (10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0)
CLASS_K = (0.05, 0.1, 0.2, 0.4, 0.6, 0.8)


def general_tolerance(length: float) -> float:
    """Return the flatness that ISO 2768-2 class K grants a surface of this length [mm].

    Parameters
    ----------
    length : float
        Longest side of the part's bounding box [mm]; the standard takes the longer side of each surface, so
        one value for the part is the loosest that any face may have.

    Returns
    -------
    float
        Tolerance [mm]; beyond 3000 mm, where the table ends, that of its last row.

    Examples
    --------
    >>> [general_tolerance(length) for length in (8, 10, 10.1, 60, 5000)]
    [0.05, 0.05, 0.1, 0.2, 0.8]
    """
    if not length > 0.0:
        raise GeometryError(f"a part of {length} mm has no size, so it has no general tolerance")
    return CLASS_K[min(bisect_left(LENGTHS, length), len(CLASS_K) - 1)]
