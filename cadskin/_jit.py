"""One decorator for the compiled kernels: cached on disk where that is possible."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, TypeVar

import numba

__all__ = ["fast_kernel", "kernel"]

_log = logging.getLogger(__name__)
_Function = TypeVar("_Function", bound=Callable[..., Any])


def kernel(function: _Function) -> _Function:
    """Compile a function of arrays and numbers to machine code on its first call, without the GIL.

    Where neither the package folder nor the user's cache folder can be written the code is compiled anew in
    every process; the log says so.
    """
    return _compiled(function, {})


def fast_kernel(function: _Function) -> _Function:
    """Compile as `kernel` does, with sums that may be reordered (``fastmath``): no NaN or infinity inside."""
    return _compiled(function, {"fastmath": True})


def _compiled(function: _Function, extra: dict[str, Any]) -> _Function:
    options: Any = {"nogil": True, "error_model": "numpy", **extra}
    try:
        compiled: _Function = numba.njit(cache=True, **options)(function)
    except RuntimeError as error:  # numba finds no folder for its cache
        _log.warning("kernel %s is not cached on disk: %s", function.__name__, error)
        compiled = numba.njit(**options)(function)
    return compiled
