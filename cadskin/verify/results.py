"""The tables of a verification: of one part, and of a population."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.verify.evaluation import Evaluation, plain

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats

__all__ = ["EnsembleVerification", "Verification"]


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
