"""The process of a specification: what its tolerances name, what its sizes ask for, and a default elsewhere.

==========================  ==============================================================================
feature                     deviation
==========================  ==============================================================================
of tolerances with a model  the sum of the models that its tolerances name (``model = {field = {...}}``)
of no such tolerance        the default: a Gaussian field with a standard deviation of an eighth of its
                            narrowest tolerance, made better where pilot parts exceed a limit
with limits of size         in addition a normal offset about the middle of the limits, with a twelfth of
                            their width as its standard deviation (`cadskin.conform.sizes`)
with an unequal zone (UZ)   in addition the offset to the middle of its narrowest profile zone
==========================  ==============================================================================

Parameters that a named model leaves out: ``sigma`` is an eighth of its tolerance and ``amplitude`` a half
("from tolerance"), ``length`` a fifth of the longest side of the part.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from cadskin.conform.bound import bound_part
from cadskin.conform.capable import capable_model, correlation_length
from cadskin.conform.sizes import middle_models
from cadskin.deviation import DeviationModel, SumModel, from_dict, model_class
from cadskin.errors import CadskinError, SpecificationError

if TYPE_CHECKING:
    from cadskin.conform.bound import BoundPart
    from cadskin.shape import NominalModel
    from cadskin.spec import Specification, Tolerance

__all__ = ["model_of_tolerance", "process_of"]


def process_of(
    nominal: NominalModel,
    spec: Specification | BoundPart,
    *,
    default: DeviationModel | None = None,
    length: float | None = None,
    scale: float = 1.0,
) -> DeviationModel:
    """Return the deviation model of a part that its specification asks for; see the table of this module.

    Parameters
    ----------
    nominal : NominalModel
    spec : Specification or BoundPart
    default : DeviationModel, optional
        Where no tolerance names a model; `capable_model` by default.
    length : float, optional
        Correlation length of the default [mm]; a fifth of the longest side by default.
    scale : float
        All standard deviations and amplitudes are multiplied by it, the middle of sizes is not.

    Raises
    ------
    SpecificationError
        A tolerance names a model that does not exist or that it cannot parametrise; the message names it.

    Examples
    --------
    >>> import cadquery as cq, cadskin as cs
    >>> part = cs.nominal(cq.Workplane().box(20, 20, 4), edge_length=1.0)
    >>> crowned = cs.flatness(">Z", 0.04, model={"paraboloid": {}})
    >>> spec = cs.Specification(crowned, default=cs.surface_profile(None, 0.1))
    >>> process_of(part, spec).terms[0]
    Paraboloid(amplitude=0.02 mm).on(5)
    """
    part = bound_part(spec, nominal)
    bound = part.spec
    reach = correlation_length(nominal) if length is None else length
    terms: list[DeviationModel] = []
    taken: set[int] = set()
    for tolerance in bound:
        if tolerance.model is not None and tolerance.feature.faces:
            features = {
                nominal.feature_of(face).id: nominal.feature_of(face) for face in tolerance.feature.faces
            }
            model = model_of_tolerance(tolerance, length=reach)
            places = [feature.face_indices[0] for feature in features.values()]
            terms.append(
                (model if scale == 1.0 else scale * model).on(places[0] if len(places) == 1 else places)
            )
            taken |= features.keys()
    free = [feature for feature in nominal.features if feature.id not in taken]
    if free:
        usual = capable_model(nominal, part, length=reach, scale=scale) if default is None else default
        terms.append(usual.on([feature.face_indices[0] for feature in free]) if taken else usual)
    terms += middle_models(bound, nominal, scale=scale)
    return terms[0] if len(terms) == 1 else SumModel(tuple(terms))


def model_of_tolerance(tolerance: Tolerance, *, length: float) -> DeviationModel:
    """Return the model that a tolerance names, with numbers for what it leaves out.

    Raises
    ------
    SpecificationError
        No model, no value to take a share of, or no such model or parameter.
    """
    label = f"tolerance {tolerance.id} ({tolerance.type})"
    if tolerance.model is None or not tolerance.value:
        raise SpecificationError(f"{label}: it has no model, or no value that a model could take a share of")
    defaults = {"sigma": "from tolerance", "amplitude": "from tolerance", "length": length}
    try:
        return from_dict(_filled(tolerance.model, defaults)).resolved(tolerance=tolerance.value)
    except CadskinError as error:
        raise SpecificationError(f"{label}: {error}") from error


def _filled(table: Mapping[str, Any], defaults: Mapping[str, Any]) -> dict[str, Any]:
    """Return a model's table, and those inside of it, with the defaults for parameters left out."""
    if len(table) != 1:
        return dict(table)  # refused by `from_dict`, which says why
    ((name, values),) = table.items()
    if not isinstance(values, Mapping):
        return dict(table)
    known = {item.name for item in fields(model_class(name))}  # type: ignore[arg-type]
    inside = {key: _filled_value(value, defaults) for key, value in values.items()}
    return {name: {key: value for key, value in defaults.items() if key in known} | inside}


def _filled_value(value: Any, defaults: Mapping[str, Any]) -> Any:
    if isinstance(value, list | tuple):
        return [_filled_value(item, defaults) for item in value]
    if isinstance(value, Mapping) and len(value) == 1 and isinstance(next(iter(value.values())), Mapping):
        return _filled(value, defaults)
    return value
