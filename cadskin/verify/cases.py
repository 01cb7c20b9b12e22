"""Evaluate a point-set case: a JSON file with the question, a CSV file with labelled points.

The reference answer of a case is never read; only ``reference.quantity`` is, the name of what is asked for.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.errors import ReadError, SpecificationError
from cadskin.verify.case_check import checked_question, without_nulls

if TYPE_CHECKING:
    from cadskin._typing import Points
    from cadskin.verify.evaluation import Evaluation

__all__ = ["Case", "evaluate_case", "read_case"]


@dataclass(frozen=True, eq=False)
class Case:
    """A question about labelled points.

    Parameters
    ----------
    id : str
    characteristic : str
    question : Mapping
        The JSON object without its reference answer.
    features : Mapping
        Points (n, 3) of each label [mm].
    quantity : str or None
        What is asked for; None for the characteristic itself.
    unread : tuple of str
        Entries of the file that no evaluation reads.
    """

    id: str
    characteristic: str
    question: Mapping[str, Any]
    features: Mapping[str, Points]
    quantity: str | None
    unread: tuple[str, ...] = ()

    def get(self, name: str, default: Any = None) -> Any:
        """Return an entry of the question."""
        return self.question.get(name, default)

    def points(self, label: str) -> Points:
        """Return the points of a feature.

        Raises
        ------
        SpecificationError
            There is none of this label.
        """
        found = self.features.get(label)
        if found is None:
            raise SpecificationError(
                f"case {self.id}: no points of feature {label!r}; the file has {', '.join(self.features)}"
            )
        return found

    def only(self) -> Points:
        """Return the points of the one feature."""
        named = [label for label in self.features if label != "outlier"]
        if len(named) == 1:
            return self.features[named[0]]
        if len(named) != 1:
            raise SpecificationError(
                f"case {self.id}: {self.characteristic} needs one feature, the file has "
                f"{', '.join(self.features)}"
            )
        return next(iter(self.features.values()))


def read_case(path: str | Path) -> Case:
    """Read a case.

    Parameters
    ----------
    path : path
        The JSON file; its ``csv`` entry names the points, relative to it.

    Raises
    ------
    ReadError
        A file that is missing or not what it should be.
    """
    source = Path(path)
    try:
        question = json.loads(source.read_text(encoding="utf-8"))
    except OSError as error:
        raise ReadError(f"{source}: cannot be read ({error.strerror})") from error
    except ValueError as error:
        raise ReadError(f"{source}: not a JSON file ({error})") from error
    question = without_nulls(question)
    if not isinstance(question, dict) or "characteristic" not in question:
        raise ReadError(f"{source}: not a case; an object with the entry 'characteristic' is expected")
    units = question.get("units", "mm")
    if units != "mm":
        raise ReadError(f"{source}: units {units!r}; cases are in mm")
    reference = question.pop("reference", None)
    quantity = reference.get("quantity") if isinstance(reference, dict) else question.get("quantity")
    name = str(question.get("id", source.stem))
    unread = checked_question(name, question)
    points = read_points(source.parent / question.get("csv", source.with_suffix(".csv").name))
    return Case(
        id=name,
        characteristic=str(question["characteristic"]),
        question=question,
        features=points,
        quantity=None if quantity is None else str(quantity),
        unread=unread,
    )


def read_points(path: Path) -> dict[str, Points]:
    """Read ``feature,x,y,z`` rows; returns the points (n, 3) of each label in the order of the file.

    Raises
    ------
    ReadError
    """
    rows: dict[str, list[list[float]]] = {}
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            reader = csv.reader(stream)
            header = [name.strip() for name in next(reader, [])]
            if header != ["feature", "x", "y", "z"]:
                raise ReadError(f"{path}: the first line must be 'feature,x,y,z', got {','.join(header)!r}")
            for line in reader:
                if line:
                    rows.setdefault(line[0], []).append([float(value) for value in line[1:4]])
                    if len(line) != 4:
                        raise ReadError(
                            f"{path}, line {reader.line_num}: 4 columns expected, got {len(line)}"
                        )
    except OSError as error:
        raise ReadError(f"{path}: cannot be read ({error.strerror})") from error
    except ValueError as error:
        if isinstance(error, ReadError):
            raise
        raise ReadError(f"{path}, line {reader.line_num}: {error}") from error
    if not rows:
        raise ReadError(f"{path}: no points")
    out = {label: np.array(values) for label, values in rows.items()}
    for label, values in out.items():
        if not np.isfinite(values).all():
            row = int(np.argmin(np.isfinite(values).all(axis=1)))
            raise ReadError(f"{path}: feature {label!r} holds NaN or infinity, first in its row {row}")
    return out


def evaluate_case(case: Case) -> Evaluation:
    """Evaluate what a case asks for.

    Raises
    ------
    SpecificationError
        A characteristic that is not known, or a question that is incomplete.
    AssociationError, GeometryError
        Points for which the answer does not exist.
    """
    from cadskin.verify import case_kinds

    name = case.characteristic.lower()
    for words, function in case_kinds.KINDS:
        if any(word in name for word in words):
            return _with_remarks(case_kinds.named(function(case), case), case)
    known = ", ".join(words[0] for words, _ in case_kinds.KINDS)
    raise SpecificationError(
        f"case {case.id}: unknown characteristic {case.characteristic!r}; known: {known}"
    )


def _with_remarks(found: Evaluation, case: Case) -> Evaluation:
    """Return the evaluation with a note on what the file says and nothing here reads."""
    if not case.unread:
        return found
    return replace(found, notes=(*found.notes, f"not read: {', '.join(case.unread)}"))
