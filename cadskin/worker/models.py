"""The deviation model that a tolerance of a request wishes for, as the ``model`` table of a spec file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from math import isfinite
from typing import Any

from cadskin.worker.request import RequestError

__all__ = ["model_table"]

_SCALES = ("sigma", "amplitude")  # parameters that can be a share of the tolerance


def model_table(wish: Mapping[str, Any], label: str) -> dict[str, Any]:
    """Return the ``model`` table of ``{text, length, share}``.

    Parameters
    ----------
    wish : mapping
        ``text`` names a model (``field:kernel=matern32``; the field by default), ``length`` is its
        correlation length [mm], ``share`` its standard deviation or amplitude as a share of the tolerance.
    label : str
        For messages.

    Raises
    ------
    RequestError
        A length or share that is not positive, or one that the model does not have.
    DeviationError
        No such model or parameter.

    Examples
    --------
    >>> model_table({"length": 12.0, "share": 0.1}, "T")
    {'field': {'sigma': '0.1 of tolerance', 'length': 12.0}}
    """
    from cadskin.cli._models import model_words
    from cadskin.deviation import model_class

    name, given = model_words(str(wish.get("text") or "field"))
    known = [item.name for item in fields(model_class(name))]  # type: ignore[arg-type]
    length, share = (_positive(wish, key, label) for key in ("length", "share"))
    if share is not None:
        scale = next((key for key in _SCALES if key in known), None)
        if scale is None:
            raise RequestError(f"{label}: the model {name!r} takes no share of the tolerance")
        given.setdefault(scale, f"{share:.12g} of tolerance")
    if length is not None:
        if "length" not in known:
            raise RequestError(f"{label}: the model {name!r} has no correlation length")
        given.setdefault("length", length)
    return {name: given}


def _positive(wish: Mapping[str, Any], key: str, label: str) -> float | None:
    value = wish.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not (isfinite(value) and value > 0):
        raise RequestError(f"{label}: {key} of its deviations must be positive, got {value!r}")
    return float(value)
