"""The statistical shape model: mean skin model, principal modes, and what can be said with them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from cadskin._arrays import frozen
from cadskin._random import child, seed_sequence
from cadskin.errors import StatisticsError
from cadskin.skin import SkinEnsemble, SkinModel
from cadskin.skin.provenance import provenance_of

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import ArrayLike

    from cadskin._typing import Floats, Ints, Progress, RNGLike
    from cadskin.shape import FeatureRef, NominalModel
    from cadskin.stats.posterior import Posterior
    from cadskin.stats.robust import Center

__all__ = ["Law", "StatisticalShapeModel"]

Law: TypeAlias = Literal["gaussian", "student", "kde"]


@dataclass(frozen=True, eq=False, repr=False)
class StatisticalShapeModel:
    """Mean and principal modes of a population of deviation fields.

    A part is ``x = mean + sum_k c_k sqrt(variances_k) modes_k + noise``, Z(8). Coefficients c are in units
    of the standard deviation ("-2" is Z(9) at -2 sigma) and modes are numbered from 1. Modes are orthonormal
    in the area mean ``<u, v> = sum_j weights_j u_j v_j``, so sqrt(variance) is the root mean square over the
    area, in mm, that one sigma of a mode moves the surface. Made by `fit`.

    Parameters
    ----------
    mean : (d,) float
        The mean skin model, Z(4) [mm].
    modes : (k, d) float
        Z(6); float32 where the parts were. Sign rule: the area mean is positive where it is at least a
        tenth; else the largest entry.
    variances : (k,) float
        Eigenvalues of the covariance Z(5) [mm²], falling.
    weights : (d,) float
        Share of the area of each sample; they sum to 1.
    total_variance : float
        Of the population, kept modes or not [mm²].
    part_weights : (n,) float
        How much each training part counted, 1 at most: 0 is a part that the robust mean refused.
    scores : (n, k) float
        Coefficients of the training parts in sigma units.
    gram : (n, n) float or None
        Inner products of the training fields about their plain mean [mm²]; None where data were missing.
    ddof : int
        1: covariance divided by n - 1; 0: by n, as Z(5) prints it.
    residual : float or None
        Standard deviation per sample [mm] of what the modes leave; None takes it from leave-one-out.
    center : str
        Kind of the mean.
    nominal : NominalModel or None
    rows : (d,) int or None
        Samples of the nominal model that the model describes.
    notes : tuple of str
        Alignment, missing data, and whatever else was decided on the way.
    """

    mean: Floats
    modes: Floats
    variances: Floats
    weights: Floats
    total_variance: float
    part_weights: Floats
    scores: Floats
    gram: Floats | None = None
    ddof: int = 1
    residual: float | None = None
    center: str = "arithmetic"
    nominal: NominalModel | None = None
    rows: Ints | None = None
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        """Check and freeze."""
        d, k, n = len(self.mean), len(self.variances), len(self.part_weights)
        shapes = {
            "mean": (d,), "modes": (k, d), "variances": (k,), "weights": (d,),
            "part_weights": (n,), "scores": (n, k), "gram": (n, n),
        }  # fmt: skip
        for key, shape in shapes.items():
            value = getattr(self, key)
            if value is not None:
                kind = np.float32 if key == "modes" and value.dtype == np.float32 else np.float64
                object.__setattr__(self, key, frozen(value, dtype=kind, shape=shape, name=key))
        if self.rows is not None:
            object.__setattr__(self, "rows", frozen(self.rows, dtype=np.int64, shape=(d,), name="rows"))
        object.__setattr__(self, "notes", tuple(self.notes))

    @classmethod
    def fit(
        cls,
        parts: Any,
        *,
        nominal: NominalModel | None = None,
        features: FeatureRef | None = None,
        weights: ArrayLike | None = None,
        center: Center = "arithmetic",
        ddof: int = 1,
        modes: int | None = None,
        share: float | None = None,
        progress: Progress | None = None,
    ) -> StatisticalShapeModel:
        """Learn mean and modes from parts.

        Parameters
        ----------
        parts : SkinEnsemble, (n, d) array, or sequence of parts or of (d,) arrays
            Deviations [mm]; NaN means "not measured". float32 arrays are multiplied in single precision and
            summed in double. A `numpy.memmap` is read by chunks.
        nominal, features, weights
            See `cadskin.stats.population.population`.
        center : {"arithmetic", "geometric_median", "tukey"}
            The mean, by one weight per part; `part_weights` shows them. The covariance has the same weights.
        ddof : int
            1 divides by n - 1, 0 by n as Z(5) prints it.
        modes : int, optional
            Number of modes kept; default all that have variance (with missing data half the parts).
        share : float, optional
            Keep the fewest modes whose share of the variance is at least this, Z(7).
        progress : callable, optional

        Raises
        ------
        StatisticsError
            Fewer than two parts, no variance at all, different lengths, a sample that too few parts observed.

        References
        ----------
        Zhang et al. 2013, doi:10.1177/0954405412466987, Z(4) to Z(9). The n x n eigenproblem instead of the
        d x d one: Sirovich, Q. Appl. Math. 45 (1987), doi:10.1090/qam/910462.

        Examples
        --------
        >>> fields = np.array([[0.0, 0.1], [0.2, 0.3], [0.1, 0.2]])
        >>> model = StatisticalShapeModel.fit(fields)
        >>> model.n_modes, round(model.total_variance, 6)
        (1, 0.01)
        >>> model.instance({1: 1}).round(6).tolist()
        [0.2, 0.3]
        """
        from cadskin.stats.fitting import fit_shape_model
        from cadskin.stats.population import population

        people = population(parts, nominal=nominal, features=features, weights=weights)
        return fit_shape_model(people, center=center, ddof=ddof, modes=modes, share=share, progress=progress)

    def __repr__(self) -> str:
        kept = float(self.variances.sum()) / self.total_variance if self.total_variance else 1.0
        return (
            f"StatisticalShapeModel({self.n_parts} parts, {len(self.mean)} samples, {self.n_modes} modes, "
            f"{100 * kept:.4g} % of the variance, {self.center} mean)"
        )

    @property
    def n_modes(self) -> int:
        """Number of modes kept."""
        return len(self.variances)

    @property
    def n_parts(self) -> int:
        """Number of training parts."""
        return len(self.part_weights)

    @property
    def effective_parts(self) -> float:
        """Number of equally weighted parts that would know as much: ``(sum q)² / sum q²``."""
        return float(self.part_weights.sum() ** 2 / (self.part_weights**2).sum())

    @cached_property
    def noise(self) -> float:
        """Standard deviation per sample [mm] of what the modes leave of a *new* part (leave-one-out)."""
        if self.residual is not None:
            return self.residual
        from cadskin.stats.diagnostics import leave_one_out

        error = leave_one_out(self).error
        return float(error[min(self.n_modes, len(error) - 1)])

    def instance(self, coefficients: Mapping[int, float] | ArrayLike) -> Floats:
        """Return the field (d,) [mm] with the given coefficients in sigma units, Z(8).

        Parameters
        ----------
        coefficients : mapping or (k,) array_like
            ``{1: -2}`` is minus two standard deviations of the first mode; an array gives the first modes.
            Z(9)'s +-3 is a bound of plausibility for each, not a value for all of them at once.

        Raises
        ------
        StatisticsError
            A mode that the model does not have.
        """
        return self.fields(self._vector(coefficients))

    def fields(self, coefficients: Floats) -> Floats:
        """Return the fields (..., d) [mm] of coefficients (..., k) of all modes, in sigma units."""
        return np.asarray(self.mean + (coefficients * self.sigmas).astype(self.modes.dtype) @ self.modes)

    @property
    def sigmas(self) -> Floats:
        """Square roots of the variances (k,) [mm]."""
        return np.sqrt(self.variances)

    def coefficients(self, field: ArrayLike) -> Floats:
        """Return the coefficients (k,) of a part in sigma units; NaN entries of the field are left out.

        Parameters
        ----------
        field : (d,) array_like
            Deviations [mm], of the model's samples.

        Raises
        ------
        StatisticsError
            Wrong length, or fewer entries observed than there are modes (`posterior` still works).
        """
        x = np.asarray(getattr(field, "deviation", field), dtype=np.float64)
        if self.rows is not None and self.nominal is not None and x.shape == (self.nominal.n_samples,):
            x = x[self.rows]
        if x.shape != self.mean.shape:
            raise StatisticsError(f"a field of this model has {len(self.mean)} values, got shape {x.shape}")
        seen = np.isfinite(x)
        if seen.all():
            weighted = ((x - self.mean) * self.weights).astype(self.modes.dtype)
            return np.asarray((self.modes @ weighted) / self.sigmas)
        if seen.sum() < self.n_modes:
            raise StatisticsError(
                f"{int(seen.sum())} observed values cannot determine {self.n_modes} coefficients; "
                "use posterior"
            )
        root = np.sqrt(self.weights[seen])
        design = (self.modes[:, seen] * root).T * self.sigmas
        return np.asarray(np.linalg.lstsq(design, (x - self.mean)[seen] * root, rcond=None)[0])

    def project(self, field: ArrayLike) -> Floats:
        """Return the field (d,) [mm] of the model that is nearest to a part: `instance` of `coefficients`."""
        return self.instance(self.coefficients(field))

    def truncate(self, *, modes: int | None = None, share: float | None = None) -> StatisticalShapeModel:
        """Return the model with fewer modes; the residual noise grows by what they held.

        Parameters
        ----------
        modes : int, optional
            Number of modes, 0 or more (see `leave_one_out` and `parallel_analysis` for how many).
        share : float, optional
            The fewest modes whose share of the variance is at least this. Z(7) prints "at most", which may
            keep none; with few parts the shares themselves are uncertain.

        Raises
        ------
        StatisticsError
            Both or none given, or more modes than there are.
        """
        count = self._count(modes, share)
        residual = self.residual
        if residual is not None:
            residual = float(np.hypot(residual, np.sqrt(self.variances[count:].sum())))
        return replace(
            self,
            modes=self.modes[:count],
            variances=self.variances[:count],
            scores=self.scores[:, :count],
            residual=residual,
        )

    def sample(
        self, *, size: int = 1, rng: RNGLike = None, law: Law = "gaussian", noise: bool = True
    ) -> Floats:
        """Return random new parts.

        Parameters
        ----------
        size : int
        rng : int, SeedSequence, BitGenerator, Generator or None
            Part i depends on the child stream i only.
        law : {"gaussian", "student", "kde"}
            Coefficients: independent standard normal; Student's t with n - 1 degrees of freedom, widened by
            1 + 1/n, as the few parts know it; or a smoothed bootstrap of the training parts' own scores.
        noise : bool
            Add white noise of the residual standard deviation; without it, samples are too smooth.

        Returns
        -------
        (size, d) float
            [mm].
        """
        from cadskin.stats.sampling import draw_coefficients

        seed = seed_sequence(rng)
        level = self.noise if noise else 0.0
        out = np.zeros((size, len(self.mean)))
        for i in range(size):
            generator = child(seed, i)
            c = draw_coefficients(self, generator, law)
            out[i] = self.fields(c)
            if level > 0.0:
                out[i] += level * generator.standard_normal(len(self.mean))
        return out

    def posterior(self, rows: ArrayLike, values: ArrayLike, *, noise: float) -> Posterior:
        """Return what is known of a whole part after some of its samples were measured.

        Parameters
        ----------
        rows : (m,) array_like of int
            Which entries of the field were measured.
        values : (m,) array_like of float
            Their deviations [mm]; NaN is left out.
        noise : float
            Standard uncertainty of one measured value [mm].

        Returns
        -------
        Posterior
            Mean, standard deviation and bands of the whole field.
        """
        from cadskin.stats.posterior import posterior

        return posterior(self, rows, values, noise=noise)

    def skin_model(self, field: ArrayLike) -> SkinModel:
        """Return a field of this model as a `SkinModel`; samples outside of the model stay nominal.

        Raises
        ------
        StatisticsError
            The model has no nominal model.
        """
        nominal, rows = self._placed()
        deviation = np.zeros(nominal.n_samples)
        deviation[rows] = field
        return SkinModel(nominal, deviation, provenance_of(nominal, repr(self), None))

    def ensemble(self, fields: ArrayLike) -> SkinEnsemble:
        """Return fields (N, d) of this model as a `SkinEnsemble`; see `skin_model`."""
        nominal, rows = self._placed()
        values = np.asarray(fields, dtype=np.float64)
        deviations = np.zeros((len(values), nominal.n_samples))
        deviations[:, rows] = values
        return SkinEnsemble(nominal, deviations, provenance_of(nominal, repr(self), None))

    def save(self, path: str | Path) -> Path:
        """Write the model to a .npz file (see `cadskin.stats.load_shape_model`)."""
        from cadskin.stats.archive import save_shape_model

        return save_shape_model(path, self)

    def _placed(self) -> tuple[NominalModel, Ints]:
        if self.nominal is None or self.rows is None:
            raise StatisticsError("this model knows no nominal model; give nominal= to fit or to load")
        return self.nominal, self.rows

    def _vector(self, coefficients: Mapping[int, float] | ArrayLike) -> Floats:
        vector = np.zeros(self.n_modes)
        if isinstance(coefficients, Mapping):
            for number, value in coefficients.items():
                if number != int(number) or not 1 <= number <= self.n_modes:
                    raise StatisticsError(f"no mode {number}; modes are numbered 1 to {self.n_modes}")
                vector[int(number) - 1] = value
            return vector
        given = np.asarray(coefficients, dtype=np.float64)
        if given.ndim != 1 or len(given) > self.n_modes:
            raise StatisticsError(f"at most {self.n_modes} coefficients, got shape {given.shape}")
        vector[: len(given)] = given
        return vector

    def _count(self, modes: int | None, share: float | None) -> int:
        from cadskin.stats.fitting import fewest_modes

        if (modes is None) == (share is None):
            raise StatisticsError("give either modes or share")
        if share is not None:
            count = fewest_modes(self.variances, share, self.total_variance)
        else:
            count = int(modes if modes is not None else 0)
        if not 0 <= count <= self.n_modes:
            raise StatisticsError(f"the model has {self.n_modes} modes, {count} were asked for")
        return count
