"""Unit Gaussian fields on the points of one patch: exact (dense Cholesky) and low rank (Karhunen-Loeve)."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._jit import fast_kernel, kernel
from cadskin.deviation._linear import columns_of, matrix_product, write_columns
from cadskin.deviation.kernels import correlation_matrix, correlation_of, kernel_code, squared_distance
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, Points

__all__ = [
    "DenseField",
    "FactorField",
    "LowRankField",
    "PatchField",
    "SampledPlaces",
    "WholeField",
    "low_rank_factor",
    "unit_cholesky",
]


@dataclass(frozen=True, eq=False)
class SampledPlaces:
    """Where the values of a patch go.

    Parameters
    ----------
    samples : (k,) uint32
        Columns of the deviations.
    points : (k,) uint32
        Row of the patch's points for each of them.
    scale : (k,) float
        Standard deviation [mm].
    """

    samples: NDArray[np.uint32]
    points: NDArray[np.uint32]
    scale: Floats


class PatchField(ABC):
    """A linear map from standard normal numbers to a Gaussian field of unit variance on n points.

    Attributes
    ----------
    latent : int
        Number of normal numbers of one field.
    note : str
        The route and its certificate.
    """

    latent: int
    note: str

    @abstractmethod
    def write(
        self, noise: NDArray[np.float32], scratch: NDArray[np.float32], places: SampledPlaces, out: Floats
    ) -> None:
        """Write the fields of noise (COLUMNS, latent) into the columns of ``out`` that the places name.

        ``scratch`` (n, COLUMNS) is there for those who need the whole field; memory that is not touched costs
        nothing.
        """


class WholeField(PatchField):
    """A field that is made on all points at once.

    Attributes
    ----------
    place_of_point : (n,) uint32
        Row of each point in the fields that `columns` returns.
    """

    place_of_point: NDArray[np.uint32]

    @abstractmethod
    def columns(self, noise: NDArray[np.float32], scratch: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the fields (n, COLUMNS) of noise (COLUMNS, latent), in ``scratch`` (n, COLUMNS)."""

    def write(
        self, noise: NDArray[np.float32], scratch: NDArray[np.float32], places: SampledPlaces, out: Floats
    ) -> None:
        """Make the field, then scale it at the places."""
        columns = self.columns(noise, scratch)
        write_columns(columns, self.place_of_point[places.points], places.scale, places.samples, out)


class FactorField(WholeField):
    """A field F z with a given factor.

    Parameters
    ----------
    factor : (n, k) float
        A row per point.
    note : str
    triangular : bool
        True where ``factor`` is lower triangular.
    """

    def __init__(self, factor: Floats, note: str, *, triangular: bool = False) -> None:
        self.factor = np.ascontiguousarray(factor, dtype=np.float32)
        self.triangular = triangular
        self.place_of_point = np.arange(len(factor), dtype=np.uint32)
        self.latent = self.factor.shape[1]
        self.note = note

    def columns(self, noise: NDArray[np.float32], scratch: NDArray[np.float32]) -> NDArray[np.float32]:
        """Multiply by the factor."""
        matrix_product(self.factor, columns_of(noise), self.triangular, scratch)
        return scratch


def unit_cholesky(covariance: Floats, what: str) -> Floats:
    """Return the lower Cholesky factor of a correlation matrix, its rows scaled to unit variance.

    A jitter of 1e-10 to 1e-6 on the diagonal makes up for rounding.

    Raises
    ------
    DeviationError
        The matrix is not positive definite.
    """
    n = len(covariance)
    for jitter in (1e-10, 1e-8, 1e-6):
        try:
            factor = np.linalg.cholesky(covariance + jitter * np.eye(n))
        except np.linalg.LinAlgError:
            continue
        return np.asarray(factor / np.linalg.norm(factor, axis=1, keepdims=True), dtype=np.float64)
    raise DeviationError(
        f"{what} is not positive definite (smallest eigenvalue {np.linalg.eigvalsh(covariance)[0]:.3g}); "
        "use a shorter length, kernel='exponential', or metric='surface'"
    )


class DenseField(FactorField):
    """Exact: the Cholesky factor of the correlation matrix; for some hundred points.

    Parameters
    ----------
    points : (n, d) float
        Divided by the correlation length.
    kernel : str
    """

    def __init__(self, points: Points, kernel: str) -> None:
        covariance = correlation_matrix(points, points, kernel)
        factor = unit_cholesky(covariance, f"the covariance with kernel {kernel!r}")
        super().__init__(factor, f"dense Cholesky of {len(points)} points", triangular=True)


class LowRankField(FactorField):
    """Truncated Karhunen-Loeve expansion, its span found by a pivoted Cholesky factorisation.

    The pivot with the largest residual variance comes next, until that variance is below ``tolerance``: a
    certificate for every point. The rows are then scaled to unit variance.

    Parameters
    ----------
    points : (n, d) float
        Divided by the correlation length.
    kernel : str
    tolerance : float
        Largest variance that may be missing at a point before the scaling.
    max_rank : int

    Raises
    ------
    DeviationError
        ``max_rank`` does not reach the tolerance.

    References
    ----------
    Harbrecht, Peters, Schneider: On the low-rank approximation by the pivoted Cholesky decomposition, Appl.
    Numer. Math. 62 (2012), doi:10.1016/j.apnum.2011.10.001.
    """

    def __init__(self, points: Points, kernel: str, *, tolerance: float = 1e-4, max_rank: int = 1500) -> None:
        factor, defect = low_rank_factor(points, kernel, tolerance=tolerance, max_rank=max_rank)
        if defect > tolerance:
            raise DeviationError(
                f"{factor.shape[1]} Karhunen-Loeve terms leave a variance defect of {defect:.3g}, more than "
                f"{tolerance:.3g}; use method='two_level' or 'vecchia'"
            )
        self.defect = defect
        super().__init__(
            factor,
            f"Karhunen-Loeve with {factor.shape[1]} terms for {len(points)} points, "
            f"variance defect {defect:.2g}",
        )


def low_rank_factor(points: Points, kernel: str, *, tolerance: float, max_rank: int) -> tuple[Floats, float]:
    """Return a factor (n, k) of the correlation, its rows of unit length, and the largest defect before that.

    The defect is over the tolerance where ``max_rank`` columns do not reach it.
    """
    scaled = np.ascontiguousarray(points, dtype=np.float64)
    factor, defect = _pivoted_cholesky(scaled, kernel_code(kernel), tolerance, min(max_rank, len(scaled)))
    return factor.T / np.linalg.norm(factor, axis=0)[:, None], float(defect)


@kernel
def _first_largest(values: Any) -> int:
    """Index of the largest value; of nearly equal ones the first, so that rounding does not choose."""
    limit = values.max() * (1.0 - 1e-9)
    for i in range(values.size):
        if values[i] >= limit:
            return i
    return 0


@fast_kernel
def _pivoted_cholesky(points: Any, code: int, tolerance: float, max_rank: int) -> Any:
    """Rows (k, n) of the pivoted Cholesky factor, and the largest residual variance."""
    n = points.shape[0]
    residual = np.ones(n)
    rows = np.zeros((max_rank, n))
    rank = 0
    while rank < max_rank:
        pivot = _first_largest(residual)
        if residual[pivot] <= tolerance:
            break
        row = rows[rank]
        for j in range(n):
            row[j] = correlation_of(squared_distance(points, pivot, points, j), code)
        for k in range(rank):
            factor = rows[k, pivot]
            for j in range(n):
                row[j] -= factor * rows[k, j]
        inverse = 1.0 / math.sqrt(residual[pivot])
        for j in range(n):
            row[j] *= inverse
            residual[j] -= row[j] * row[j]
        residual[pivot] = 0.0
        rank += 1
    return rows[:rank].copy(), residual.max()
