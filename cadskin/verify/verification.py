"""Verify a made part, or a population of them, against a specification."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._progress import report
from cadskin.errors import CadskinError, SpecificationError
from cadskin.verify.evaluation import Evaluation, plain
from cadskin.verify.extraction import MadePart
from cadskin.verify.general import bound_to, with_general
from cadskin.verify.part_size import evaluate_size, has_size_limits
from cadskin.verify.tolerances import evaluate

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats, Progress
    from cadskin.shape import DiscreteShape, NominalModel
    from cadskin.skin import SkinEnsemble, SkinModel
    from cadskin.spec import Specification
    from cadskin.verify.datums import Standard

__all__ = ["EnsembleVerification", "Verification", "verify"]


@dataclass(frozen=True, eq=False)
class Verification:
    """The table of a part: one evaluation per tolerance, and what could not be evaluated.

    Parameters
    ----------
    evaluations : tuple of (str, Evaluation)
        Id of the tolerance and its evaluation.
    unresolved : tuple of (str, str)
        Id and reason of each tolerance that was not evaluated.
    standard : str
    """

    evaluations: tuple[tuple[str, Evaluation], ...]
    unresolved: tuple[tuple[str, str], ...] = ()
    standard: str = "ISO 5459:2011"

    @property
    def conforming(self) -> bool:
        """True when every tolerance was evaluated and is kept."""
        return not self.unresolved and all(found.ok is not False for _, found in self.evaluations)

    @property
    def certified(self) -> bool:
        """True when every value is proved."""
        return all(found.certified for _, found in self.evaluations)

    def __getitem__(self, name: str) -> Evaluation:
        """Return the evaluation of the tolerance with this id."""
        for key, found in self.evaluations:
            if key == name:
                return found
        raise SpecificationError(f"no tolerance {name!r} was evaluated")

    def rows(self) -> list[tuple[str, ...]]:
        """Return the table as text: id, characteristic, value, limit, verdict, certified."""
        out = []
        for name, found in self.evaluations:
            limit = "" if found.limit is None else f"{found.limit:.6g}"
            verdict = {True: "ok", False: "not conforming", None: ""}[found.ok]
            proof = "yes" if found.certified else "no"
            out.append((name, found.characteristic, f"{found.value:.9g}", limit, verdict, proof))
        return [*out, *((name, reason, "", "", "not evaluated", "") for name, reason in self.unresolved)]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {
            "conforming": self.conforming,
            "standard": self.standard,
            "evaluations": {name: found.to_dict() for name, found in self.evaluations},
            "unresolved": [{"tolerance": name, "reason": reason} for name, reason in self.unresolved],
        }

    def to_csv(self) -> str:
        """Return the table as CSV."""
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["tolerance", "characteristic", "value_mm", "limit_mm", "verdict", "certified"])
        writer.writerows(self.rows())
        return stream.getvalue()

    def __str__(self) -> str:
        rows = [("tolerance", "characteristic", "value", "limit", "verdict", "certified"), *self.rows()]
        widths = [max(len(row[k]) for row in rows) for k in range(6)]
        return "\n".join(
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in rows
        )


@dataclass(frozen=True, eq=False)
class EnsembleVerification:
    """Values of every tolerance on every part of a population.

    Parameters
    ----------
    tolerances : tuple of str
    limits : (m,) float
        NaN where a tolerance has no value.
    values : (N, m) float
        NaN where a tolerance could not be evaluated [mm].
    certified : (N, m) bool
    kept : (N, m) bool
        The verdict of each tolerance: of its value, or of its material requirement; False where it could
        not be evaluated.
    unresolved : tuple of (int, str, str)
        Part, tolerance and reason.
    """

    tolerances: tuple[str, ...]
    limits: Floats
    values: Floats
    certified: Bools
    kept: Bools
    unresolved: tuple[tuple[int, str, str], ...] = ()

    @property
    def conforming(self) -> Bools:
        """Whether each part conforms (N,)."""
        failed = np.zeros(len(self.values), dtype=bool)
        failed[[part for part, _, _ in self.unresolved]] = True
        return np.asarray(self.kept.all(axis=1) & ~failed)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {
            "tolerances": list(self.tolerances),
            "limits": plain(self.limits),
            "values": plain(self.values),
            "conforming": plain(self.conforming),
            "unresolved": [
                {"part": part, "tolerance": name, "reason": reason} for part, name, reason in self.unresolved
            ],
        }


def verify(
    actual: SkinModel | SkinEnsemble | DiscreteShape,
    spec: Specification,
    *,
    nominal: NominalModel | None = None,
    standard: Standard = "ISO 5459:2011",
    sections: int = 15,
    sizes: bool = False,
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
    bound = with_general(bound_to(spec, model), model)
    if isinstance(actual, SkinEnsemble):
        if sizes:
            raise SpecificationError("sizes are evaluated part by part; verify(skin, spec, sizes=True)")
        return _verify_all(actual, bound, standard, sections, progress)
    surface = actual.surface if isinstance(actual, SkinModel) else actual
    part = MadePart(surface, model)
    found = _verify_one(part, bound, standard, sections, progress)
    return _with_sizes(found, part, bound, sections) if sizes else found


def _with_sizes(found: Verification, part: MadePart, spec: Specification, sections: int) -> Verification:
    evaluations, unresolved = list(found.evaluations), list(found.unresolved)
    for dimension in filter(has_size_limits, spec.dimensions):
        try:
            evaluations.append((dimension.id, evaluate_size(dimension, part, sections=sections)))
        except CadskinError as error:
            unresolved.append((dimension.id, str(error)))
    return replace(found, evaluations=tuple(evaluations), unresolved=tuple(unresolved))


def _verify_one(
    part: MadePart, spec: Specification, standard: Standard, sections: int, progress: Progress | None
) -> Verification:
    evaluations, unresolved = [], [(item.entity, item.reason) for item in spec.unresolved]
    for index, tolerance in enumerate(spec):
        try:
            found = evaluate(tolerance, part, spec, standard=standard, sections=sections)
            evaluations.append((tolerance.id, found))
        except CadskinError as error:
            unresolved.append((tolerance.id, str(error)))
        report(progress, index + 1, len(spec))
    return Verification(tuple(evaluations), tuple(unresolved), standard)


def _verify_all(
    ensemble: SkinEnsemble, spec: Specification, standard: Standard, sections: int, progress: Progress | None
) -> EnsembleVerification:
    names = tuple(tolerance.id for tolerance in spec)
    values = np.full((len(ensemble), len(names)), np.nan)
    certified, kept = np.zeros(values.shape, dtype=bool), np.zeros(values.shape, dtype=bool)
    unresolved: list[tuple[int, str, str]] = []
    for index, skin in enumerate(ensemble):
        found = _verify_one(MadePart(skin.surface, ensemble.nominal), spec, standard, sections, None)
        for name, evaluation in found.evaluations:
            values[index, names.index(name)] = evaluation.value
            certified[index, names.index(name)] = evaluation.certified
            kept[index, names.index(name)] = evaluation.ok is not False
        unresolved.extend((index, name, reason) for name, reason in found.unresolved)
        report(progress, index + 1, len(ensemble))
    limits = np.array([np.nan if t.value is None else t.value for t in spec])
    return EnsembleVerification(names, limits, values, certified, kept, tuple(unresolved))
