"""Where the points of a reference set lie: strategies of ISO/TS 12180-2 and 12781-2 in the unit square."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypeAlias, get_args

import numpy as np

from cadskin.errors import SpecificationError

if TYPE_CHECKING:
    from cadskin._typing import Floats

__all__ = ["SAMPLINGS", "Sampling", "unit_square"]

Sampling: TypeAlias = Literal["random", "grid", "sections", "generatrix", "helix", "bird cage"]
SAMPLINGS: tuple[Sampling, ...] = get_args(Sampling)
_TURNS = 12.0


def unit_square(n: int, sampling: Sampling, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return ``n`` points (u, v) of the unit square; u goes around (or along x), v along the axis (or y).

    Parameters
    ----------
    n : int
    sampling : {"random", "grid", "sections", "generatrix", "helix", "bird cage"}
        "grid" is uniform in both directions; "sections" few circles of many points, "generatrix" few lines
        along the axis, "bird cage" both of them, "helix" one line that winds up.
    rng : numpy.random.Generator
        Of the random points.

    Raises
    ------
    SpecificationError
        A strategy that is not known.
    """
    if sampling == "random":
        return rng.uniform(0, 1, n), rng.uniform(0, 1, n)
    if sampling == "helix":
        v = (np.arange(n) + 0.5) / n
        return np.mod(_TURNS * v, 1.0), v
    if sampling == "grid":
        return _rows(n, max(2, round(np.sqrt(n / 3.0))))
    few = max(2, min(12, n // 12))
    if sampling == "sections":
        return _rows(n, few)
    if sampling == "generatrix":
        v, u = _rows(n, few)
        return u, v
    if sampling == "bird cage":
        around, along = _rows(n // 2, few), _rows(n - n // 2, few)
        return np.concatenate([around[0], along[1]]), np.concatenate([around[1], along[0]])
    raise SpecificationError(f"unknown sampling {sampling!r}; choose one of {', '.join(SAMPLINGS)}")


def _rows(n: int, rows: int) -> tuple[Floats, Floats]:
    """Return ``n`` points in ``rows`` lines of constant second coordinate."""
    index = np.arange(n)
    row, column = index % rows, index // rows
    columns = int(column.max()) + 1
    return (column + 0.5) / columns, (row + 0.5) / rows
