"""The deviation model of a request: a process that suits the tolerances, with the wishes of single ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.worker.request import RequestError

if TYPE_CHECKING:
    from cadskin.deviation import DeviationModel
    from cadskin.shape import NominalModel
    from cadskin.spec import Specification

__all__ = ["Wish", "model_of_request", "wishes"]


@dataclass(frozen=True)
class Wish:
    """What one tolerance wants of the deviations on its faces.

    Parameters
    ----------
    tolerance : str
        Its id.
    text : str
        A model by name, ``field:kernel=matern32``; empty for the default field.
    length : float or None
        Correlation length [mm].
    share : float or None
        Standard deviation as a share of the tolerance.
    """

    tolerance: str
    text: str = ""
    length: float | None = None
    share: float | None = None

    def __bool__(self) -> bool:
        return bool(self.text) or self.length is not None or self.share is not None


def wishes(tolerances: list[dict[str, Any]]) -> list[Wish]:
    """Return the wishes of the tolerances that have any.

    Parameters
    ----------
    tolerances : list of dict
        As in a request: ``deviation`` is ``{text, length, share}``.

    Raises
    ------
    RequestError
        A length or share that is not positive.
    """
    found = []
    for row in tolerances:
        values = row.get("deviation") or {}
        label = row.get("name") or row.get("id")
        for key in ("length", "share"):
            value = values.get(key)
            if value is not None and not (isinstance(value, int | float) and 0 < value < np.inf):
                raise RequestError(
                    f"tolerance {label}: {key} of its deviations must be positive, got {value!r}"
                )
        text = str(values.get("text") or "")
        found.append(Wish(str(row.get("id") or ""), text, values.get("length"), values.get("share")))
    return [wish for wish in found if wish]


def model_of_request(
    nominal: NominalModel,
    spec: Specification,
    asked: list[Wish],
    *,
    length: float | None = None,
) -> DeviationModel:
    """Return the deviation model.

    Without wishes it is that of `cadskin.conform.capable_model`. A wish changes the field on the features of
    its tolerance; where several tolerances of one feature have wishes, the last one counts.

    Parameters
    ----------
    nominal : NominalModel
    spec : Specification
        Bound to the part.
    asked : list of Wish
    length : float, optional
        Correlation length of the whole part [mm].
    """
    from cadskin.conform import capable_model

    base = capable_model(nominal, spec, length=length)
    chosen = _wish_of_feature(nominal, spec, asked)
    if not chosen:
        return base
    sigma = np.array(base.sigma)
    groups: dict[Wish, list[int]] = {}
    for feature, wish in chosen.items():
        groups.setdefault(wish, []).append(feature)
    plain = [feature.id for feature in nominal.features if feature.id not in chosen]
    terms = [_restricted(base, nominal, plain)] if plain else []
    for wish, features in groups.items():
        terms.append(_restricted(_wished(wish, sigma, nominal, features, spec, base), nominal, features))
    return terms[0] if len(terms) == 1 else sum(terms[1:], terms[0])


def _wish_of_feature(nominal: NominalModel, spec: Specification, asked: list[Wish]) -> dict[int, Wish]:
    return {
        nominal.feature_of(face).id: wish for wish in asked for face in spec[wish.tolerance].feature.faces
    }


def _restricted(model: DeviationModel, nominal: NominalModel, features: list[int]) -> DeviationModel:
    return model.on([nominal.features[k].face_indices[0] for k in features])


def _wished(
    wish: Wish, sigma: Any, nominal: NominalModel, features: list[int], spec: Specification, base: Any
) -> DeviationModel:
    from cadskin.cli._models import deviation_model
    from cadskin.deviation import GaussianField

    rows = np.concatenate([np.arange(nominal.features[k].start, nominal.features[k].stop) for k in features])
    limit = spec[wish.tolerance].value
    level = float(sigma[rows].mean()) if wish.share is None or limit is None else wish.share * limit
    reach = base.length if wish.length is None else wish.length
    if not wish.text:
        return GaussianField(level, reach, base.kernel)
    return deviation_model(wish.text, sigma=level, length=reach)
