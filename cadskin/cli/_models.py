"""Deviation models and seeds from words of the command line."""

from __future__ import annotations

import hashlib
import secrets
from typing import TYPE_CHECKING, Any

from cadskin.errors import DeviationError

if TYPE_CHECKING:
    import numpy as np

    from cadskin.conform import BoundPart
    from cadskin.deviation import DeviationModel
    from cadskin.shape import NominalModel

__all__ = ["deviation_model", "fresh_seed", "model_words", "process", "seed_of_part"]


def deviation_model(text: str, **defaults: float) -> DeviationModel:
    """Return the model that ``text`` describes: ``NAME`` or ``NAME:key=value,key=value``.

    Parameters
    ----------
    text : str
        ``field``, ``noise``, ``field:length=12,kernel=matern32``, ...
    **defaults
        Parameters that the model takes unless ``text`` has them; those it does not know are left out.

    Raises
    ------
    DeviationError
        Unknown name or parameter, or a value without meaning.

    Examples
    --------
    >>> deviation_model("field:length=12", sigma=0.01, length=3.0)
    GaussianField(sigma=0.01 mm, length=12 mm)
    """
    from dataclasses import fields

    from cadskin.deviation import from_dict, model_class

    name, given = model_words(text)
    known = {item.name for item in fields(model_class(name))}  # type: ignore[arg-type]
    return from_dict({name: {key: value for key, value in defaults.items() if key in known} | given})


def model_words(text: str) -> tuple[str, dict[str, Any]]:
    """Return name and parameters of ``NAME:key=value,key=value``.

    Examples
    --------
    >>> model_words("field:length=12,kernel=matern32")
    ('field', {'length': 12.0, 'kernel': 'matern32'})
    """
    name, _, rest = text.partition(":")
    return name, dict(_pair(word, text) for word in rest.split(",") if word.strip())


def _pair(word: str, text: str) -> tuple[str, Any]:
    key, separator, value = (part.strip() for part in word.partition("="))
    if not separator or not key or not value:
        raise DeviationError(f"--model takes NAME:key=value,key=value, got {text!r}")
    try:
        return key, float(value)
    except ValueError:
        return key, value


def process(
    nominal: NominalModel,
    spec: BoundPart,
    text: str | None,
    *,
    sigma: float | None = None,
    length: float | None = None,
    cpk: float | None = None,
) -> DeviationModel:
    """Return the model of a part: that of its tolerances, with ``text`` instead of the default field.

    Parameters
    ----------
    nominal : NominalModel
    spec : BoundPart
    text : str or None
        As for `deviation_model`.
    sigma, length : float or None
        [mm].
    cpk : float or None
        Process capability that all spreads are scaled to.
    """
    from cadskin.conform import capability_scale, prepare_conforming, process_of
    from cadskin.conform.capable import correlation_length

    reach = rounded(correlation_length(nominal)) if length is None else length
    default = None if text is None else deviation_model(text, sigma=sigma or 1.0, length=reach)
    fitting = process_of(nominal, spec, default=default, length=reach)
    if cpk is None:
        return fitting
    factor = capability_scale(prepare_conforming(nominal, fitting, spec), cpk)
    return process_of(nominal, spec, default=default, length=reach, scale=factor)


def rounded(value: float) -> float:
    """Return a default with three significant digits, so that what is shown is what is used.

    Examples
    --------
    >>> rounded(62.3211818978)
    62.3
    """
    return float(f"{value:.3g}")


def fresh_seed() -> int:
    """Return a seed that nobody chose, short enough to be typed again."""
    return secrets.randbelow(2**32)


def seed_of_part(seed: int, part: str) -> np.random.SeedSequence:
    """Return the seed of one part: it depends on the part's name, not on what else is made.

    Examples
    --------
    >>> seed_of_part(7, "pin").entropy == seed_of_part(7, "pin").entropy != seed_of_part(7, "nut").entropy
    True
    """
    from numpy.random import SeedSequence

    digest = hashlib.sha256(part.encode()).digest()
    return SeedSequence([seed, *(int.from_bytes(digest[i : i + 4], "little") for i in (0, 4, 8, 12))])
