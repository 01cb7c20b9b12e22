"""Parameters of models as plain values and as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

__all__ = ["plain", "same", "text"]


def same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        try:
            return bool(np.array_equal(np.asarray(a), np.asarray(b), equal_nan=True))
        except TypeError:
            return False
    return bool(a is b or a == b)


def plain(value: Any) -> Any:
    """Numbers, strings, lists and tables only, as TOML has them."""
    if hasattr(value, "to_dict"):  # a model inside of a model
        return value.to_dict()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (tuple, list)):
        return [plain(item) for item in value]
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    return value


def text(value: Any, unit: str) -> str:
    if isinstance(value, (float, int)) and not isinstance(value, bool):
        return f"{value + 0.0:.12g}" + (f" {unit}" if unit else "")
    if isinstance(value, np.ndarray):
        value = tuple(value.tolist())
    if isinstance(value, (list, tuple)) and len(value) > 8:
        return f"<{_summary(value)}>" + (f" {unit}" if unit else "")
    return repr(value) + (f" {unit}" if unit and not isinstance(value, str) else "")


def _summary(values: Sequence[Any]) -> str:
    """Return what a long row of values is: how many, from where to where, and their mean."""
    count = f"{len(values)} values"
    numbers = np.asarray(values) if all(isinstance(one, (int, float)) for one in values) else np.zeros(0)
    if not numbers.size or not np.isfinite(numbers).all():
        return count
    return f"{count}, {numbers.min():.3g}..{numbers.max():.3g}, mean {numbers.mean():.3g}"
