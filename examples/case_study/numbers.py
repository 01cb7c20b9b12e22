"""Numbers of the page that need a formula: mesh convergence, correlations, the printed form of Z(7)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

import cadskin as cs

from .fe_run import Drawn
from .process import VARIED, DrawingProcess
from .shapes import drawn_fields, field_flatness

RATIO = 1.5  # of the element lengths of one mesh and the next
FAMILY = ("coarse", "medium", "fine")  # of meshes that differ in nothing else


LEAST_ORDER = 0.5


@dataclass(frozen=True, eq=False)
class Convergence:
    """Flatness of the nominal process by mesh, and what Richardson makes of the family; mm."""

    flatness: dict[str, float]
    order: float | None = None  # None where a mesh is missing, or the three do not approach one value
    limit: float | None = None
    uncertainty: float | None = None  # grid convergence index of the medium mesh

    @property
    def spread(self) -> float:
        """Range over the meshes [mm]."""
        return float(np.ptp(list(self.flatness.values())))


def convergence(meshes: dict[str, Drawn], nominal: cs.NominalModel) -> Convergence:
    """Compare the nominal process on the meshes that were run.

    References
    ----------
    Roache, Annu. Rev. Fluid Mech. 29 (1997), doi:10.1146/annurev.fluid.29.1.123: Richardson extrapolation and
    grid convergence index, safety factor 1.25.
    """
    fields = drawn_fields(list(meshes.values()), nominal)
    flatness = {name: field_flatness(nominal, field) for name, field in zip(meshes, fields, strict=True)}
    if not set(FAMILY) <= set(flatness):
        return Convergence(flatness)
    return Convergence(flatness, *richardson(np.array([flatness[name] for name in FAMILY])))


def richardson(values: np.ndarray, ratio: float = RATIO) -> tuple[float | None, float | None, float | None]:
    """Return order, limit and uncertainty of the middle one of three values, coarse to fine.

    None where the values do not approach a limit with falling steps in one direction, or so slowly (an order
    below one half) that the meshes are not fine enough to tell one.

    Examples
    --------
    >>> from case_study.numbers import richardson
    >>> exact, h = 2.0, np.array([2.25, 1.5, 1.0])
    >>> [round(float(x), 6) for x in richardson(exact + 0.1 * h**2)[:2]]
    [2.0, 2.0]
    """
    first, second = values[0] - values[1], values[1] - values[2]
    if first * second <= 0 or abs(second) >= abs(first):
        return None, None, None
    order = float(np.log(first / second) / np.log(ratio))
    if order < LEAST_ORDER:
        return None, None, None
    limit = float(values[2] - second / (ratio**order - 1))
    return order, limit, 1.25 * abs(float(values[1]) - limit)


def correlations(scores: np.ndarray, processes: list[DrawingProcess]) -> dict[str, float]:
    """Return the correlation of scores (n,) with each process parameter."""
    return {
        name: float(np.corrcoef(scores, [getattr(process, name) for process in processes])[0, 1])
        for name in VARIED
    }


def chance(size: int) -> float:
    """Return the correlation that ``size`` unrelated pairs stay below in 95 of 100 cases (Student's t)."""
    t = float(student.ppf(0.975, size - 2))
    return t / float(np.sqrt(size - 2 + t * t))


def modes_by_printed_rule(model: cs.StatisticalShapeModel, share: float) -> int:
    """Return how many modes Z(7) keeps as it is printed: the most whose share is at most ``share``."""
    return int((np.cumsum(model.variances) / model.total_variance <= share).sum())
