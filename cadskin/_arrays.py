"""Checked, read-only arrays for the frozen value objects."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cadskin.errors import GeometryError


def frozen(
    values: ArrayLike,
    *,
    dtype: Any = np.float64,
    shape: tuple[int | None, ...] | None = None,
    name: str = "array",
    finite: bool = True,
) -> NDArray[Any]:
    """Return a C-contiguous read-only array, checked for shape and finiteness.

    The array is copied only where it has to be: a writeable input is copied, so that nobody else holds a
    writeable view of it.

    Parameters
    ----------
    values : array_like
    dtype : dtype
    shape : tuple of int or None
        Expected shape, None for any length of that axis.
    name : str
        Used in the error message.
    finite : bool
        Refuse NaN and infinity.

    Raises
    ------
    GeometryError
        Wrong shape, or a value that is not finite.

    Examples
    --------
    >>> frozen([[0, 0, 1]], shape=(None, 3)).flags.writeable
    False
    """
    given = np.asarray(values)
    array: NDArray[Any] = np.ascontiguousarray(given, dtype=dtype)
    if shape is not None and (
        array.ndim != len(shape)
        or any(want is not None and want != have for want, have in zip(shape, array.shape, strict=True))
    ):
        want = "(" + ", ".join("n" if s is None else str(s) for s in shape) + ")"
        raise GeometryError(f"{name} has shape {array.shape}, expected {want}")
    if finite and array.dtype.kind == "f" and not np.isfinite(array).all():
        bad = int(np.argmin(np.isfinite(array).reshape(len(array), -1).all(axis=1))) if array.ndim else 0
        raise GeometryError(f"{name} holds NaN or infinity, first in row {bad}")
    if array.flags.writeable:
        if np.shares_memory(array, given):
            array = array.copy()
        array.flags.writeable = False
    return array
