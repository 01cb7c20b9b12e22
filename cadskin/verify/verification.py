"""Verify a made part, or a population of them, against a specification."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin._progress import report
from cadskin.errors import SpecificationError
from cadskin.verify.prepared import PreparedVerification, prepare
from cadskin.verify.results import EnsembleVerification, Verification
from cadskin.verify.workers import verified_parts

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cadskin._typing import Progress
    from cadskin.shape import DiscreteShape, NominalModel
    from cadskin.skin import SkinEnsemble, SkinModel
    from cadskin.spec import Specification
    from cadskin.verify.datums import Standard

__all__ = ["EnsembleVerification", "Verification", "verify"]


def verify(
    actual: SkinModel | SkinEnsemble | DiscreteShape,
    spec: Specification,
    *,
    nominal: NominalModel | None = None,
    standard: Standard = "ISO 5459:2011",
    sections: int = 15,
    sizes: bool = False,
    sampling: bool = False,
    workers: int = 1,
    progress: Progress | None = None,
) -> Verification | EnsembleVerification:
    """Evaluate every tolerance of a specification.

    Parameters
    ----------
    actual : SkinModel, SkinEnsemble or DiscreteShape
        A mesh needs face labels and ``nominal``, and lies in the coordinates of the nominal model.
    spec : Specification
        Bound to the faces of the part; else it is bound here.
    nominal : NominalModel, optional
    standard : {"ISO 5459:2011", "ASME Y14.5.1-2019"}
        Of the datum associations.
    sections : int
        Sections, surface lines or circles of a feature.
    sizes : bool
        Also evaluate the sizes with limits of the specification (one part, not a population): local two-point
        sizes of cylinders.
    sampling : bool
        Also estimate, part by part, what the surface between the points has on top of each value
        (``details["sampling_shortfall"]``).
    workers : int
        Processes for a population; the values do not depend on it.
    progress : callable, optional

    Returns
    -------
    Verification or EnsembleVerification
        What could not be evaluated stands in ``unresolved``, with the reason.

    Raises
    ------
    SpecificationError
        A mesh without its nominal model.
    """
    from cadskin.skin import SkinEnsemble, SkinModel

    model = actual.nominal if isinstance(actual, SkinModel | SkinEnsemble) else nominal
    if model is None:
        raise SpecificationError("a mesh is verified against a nominal model; give nominal=")
    prepared = prepare(model, spec, standard=standard, sections=sections)
    if not isinstance(actual, SkinEnsemble):
        return prepared.evaluate(actual, sizes=sizes, sampling=sampling, progress=progress)
    if sizes or sampling:
        raise SpecificationError(
            "sizes and sampling are evaluated part by part; verify(skin, spec, sizes=True)"
        )
    if workers == 1:
        return _table(prepared, _one_by_one(actual, prepared, progress), len(actual))
    found = verified_parts(
        model,
        prepared.spec,
        actual.deviations,
        standard=standard,
        sections=sections,
        workers=workers,
        progress=progress,
    )
    return _table(prepared, found, len(actual))


def _one_by_one(
    ensemble: SkinEnsemble, prepared: PreparedVerification, progress: Progress | None
) -> Iterator[Verification]:
    for index, skin in enumerate(ensemble):
        yield prepared.evaluate(skin)
        report(progress, index + 1, len(ensemble))


def _table(prepared: PreparedVerification, parts: Iterable[Verification], count: int) -> EnsembleVerification:
    columns = {tolerance.id: column for column, tolerance in enumerate(prepared.spec)}
    values = np.full((count, len(columns)), np.nan)
    certified, kept = np.zeros(values.shape, dtype=bool), np.zeros(values.shape, dtype=bool)
    unresolved: list[tuple[int, str, str]] = []
    for index, found in enumerate(parts):
        for name, evaluation in found.evaluations:
            values[index, columns[name]] = evaluation.value
            certified[index, columns[name]] = evaluation.certified
            kept[index, columns[name]] = evaluation.ok is not False
        unresolved.extend((index, name, reason) for name, reason in found.unresolved)
    limits = np.array([np.nan if t.value is None else t.value for t in prepared.spec])
    return EnsembleVerification(tuple(columns), limits, values, certified, kept, tuple(unresolved))
