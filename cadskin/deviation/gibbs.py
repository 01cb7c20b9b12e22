"""The Gibbs sampler of the source paper: a Gaussian Markov random field drawn site by site."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cadskin.deviation._gibbs_kernels import colours, sweep, truncated_sweep
from cadskin.deviation._linear import COLUMNS
from cadskin.deviation._parameters import array_of, choice, finite, is_listed, number_of, positive, whole
from cadskin.deviation._patches import PatchPoints, check_triangles, patch_points
from cadskin.deviation._philox import fill_page, padded_count, stream_of
from cadskin.deviation._shares import needs_numbers, number_or_share
from cadskin.deviation._surface import SurfaceField
from cadskin.deviation.base import MM, DeviationModel
from cadskin.deviation.diagnostics import ChainDiagnostics, diagnose
from cadskin.deviation.registry import register
from cadskin.deviation.samplers import Sampler
from cadskin.errors import CadskinWarning, DeviationError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, Ints
    from cadskin.shape import Feature, NominalModel

__all__ = ["Gibbs", "GibbsRun", "GibbsSampler"]

_RHAT_LIMIT = 1.1  # half a chain holds some five independent states; the start is forgotten
_MONITORED = 8  # points of a patch whose traces are kept, besides the mean


@register
@dataclass(frozen=True, eq=False, repr=False)
class Gibbs(DeviationModel):
    """A Gaussian Markov random field by Gibbs sampling, with or without limits at every point.

    The law is a Whittle field, the solution of (kappa² - Laplace) x = white noise on the surface with an even
    standard deviation, given that every value lies between the limits. Away from free edges it is that of
    ``GaussianField(sigma, length, "whittle", metric="surface")``, which carries the surface on beyond them.
    Each sample is its own chain: ``sweeps`` sweeps over all points, each point drawn from its conditional law
    given the others. Without limits the exact sampler is thousands of times
    faster; a chain needs some (length / edge length)^4 sweeps, and `prepare` warns when its trial chains have
    not met.

    Parameters
    ----------
    sigma : float
        Standard deviation without limits [mm], > 0.
    length : float
        Correlation length [mm], > 0.
    sweeps : int
        Sweeps of each chain; the last state is the sample.
    lower, upper : float or (n_c,) float, optional
        Limits [mm].
    start : float
        Value at which all points start, in sigma; the law does not depend on it after enough sweeps.
    order : str
        ``sequential`` or ``chromatic`` (points of one colour of a graph colouring together).

    Raises
    ------
    DeviationError
        Parameters without meaning, or limits that exclude everything.

    Warns
    -----
    CadskinWarning
        Split R-hat of trial chains from far apart starts is above 1.1 after ``sweeps`` sweeps.

    References
    ----------
    Zhang et al. 2013, doi:10.1177/0954405412466987, equation (1) and figure 1.

    Examples
    --------
    >>> Gibbs(0.01, 5, lower=-0.02, upper=0.02)
    Gibbs(sigma=0.01 mm, length=5 mm, lower=-0.02 mm, upper=0.02 mm)
    """

    name: ClassVar[str] = "gibbs"
    sigma: Any = field(metadata=MM)
    length: float = field(metadata=MM)
    sweeps: int = 1000
    lower: Any = field(default=None, metadata=MM)
    upper: Any = field(default=None, metadata=MM)
    start: float = 0.0
    order: str = "sequential"

    def __post_init__(self) -> None:
        """Check the parameters."""
        object.__setattr__(self, "sigma", number_or_share(self.sigma, "sigma", self))
        object.__setattr__(self, "length", positive(self.length, "length", "mm", self))
        object.__setattr__(self, "sweeps", whole(self.sweeps, "sweeps", 1, self))
        object.__setattr__(self, "start", finite(self.start, "start", "sigma", self))
        choice(self.order, ("sequential", "chromatic"), "order", self)
        for key in ("lower", "upper"):
            value = getattr(self, key)
            if value is not None:
                one = not is_listed(value)
                limit = (
                    number_of(value, key, self) if one else array_of(value, (None,), key, self, finite=False)
                )
                if np.isnan(limit).any():
                    raise DeviationError(f"Gibbs: {key} holds NaN")
                object.__setattr__(self, key, limit)

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> GibbsSampler:
        """Build the precision matrices and run trial chains."""
        needs_numbers(self)
        sampler = GibbsSampler(self, nominal, patch_points(nominal, features))
        worst = max((d.rhat for d in sampler.diagnostics.values()), default=1.0)
        if worst > _RHAT_LIMIT:
            warnings.warn(
                f"{self}: after {self.sweeps} sweeps chains from far apart starts have not met "
                f"(split R-hat {worst:.3g}, should be below {_RHAT_LIMIT}); use more sweeps, a shorter "
                "length, or, without limits, GaussianField(kernel='whittle', metric='surface')",
                CadskinWarning,
                stacklevel=3,
            )
        return sampler


@dataclass(frozen=True, eq=False)
class GibbsRun:
    """Chains that were watched.

    Parameters
    ----------
    states : (chains, n_c) float
        Last state of each chain [mm].
    traces : dict of (chains, kept) float
        Mean of each patch, and values at some points [mm].
    """

    states: Floats
    traces: dict[str, Floats]

    def diagnostics(self) -> dict[str, ChainDiagnostics]:
        """Return R-hat and effective sample sizes of every trace."""
        return {key: diagnose(trace) for key, trace in self.traces.items()}


class GibbsSampler(Sampler):
    """`Gibbs` made ready for a part.

    Attributes
    ----------
    diagnostics : dict of ChainDiagnostics
        Of trial chains with over-dispersed starts, the second half of their sweeps.
    """

    def __init__(self, model: Gibbs, nominal: NominalModel, patches: Sequence[PatchPoints]) -> None:
        self.model = model
        self.n_samples = nominal.n_samples
        low, high = _limits(model, nominal)
        for patch in patches:
            check_triangles(patch, model)
        self.patches = [_PatchChain(model, patch, low, high) for patch in patches]
        seeds = np.random.SeedSequence(0).spawn(COLUMNS)
        starts = np.linspace(-10.0, 10.0, COLUMNS)
        trial = self.run(seeds, sweeps=model.sweeps, burn_in=model.sweeps // 2, starts=starts)
        self.diagnostics = trial.diagnostics() if model.sweeps - model.sweeps // 2 >= 4 else {}
        self.notes = tuple(
            f"{key}: split R-hat {d.rhat:.3f}, effective sample size {d.bulk:.0f} of {COLUMNS} x "
            f"{model.sweeps - model.sweeps // 2} draws"
            for key, d in self.diagnostics.items()
            if key.endswith("mean")
        )

    def fill(self, seeds: Sequence[np.random.SeedSequence], out: Floats) -> None:
        """Run one chain per seed."""
        for first in range(0, len(seeds), COLUMNS):
            run = self.run(
                seeds[first : first + COLUMNS], sweeps=self.model.sweeps, burn_in=self.model.sweeps
            )
            out[first : first + COLUMNS] = run.states

    def run(
        self,
        seeds: Sequence[np.random.SeedSequence],
        *,
        sweeps: int,
        burn_in: int = 0,
        thinning: int = 1,
        starts: Floats | None = None,
    ) -> GibbsRun:
        """Run up to `COLUMNS` chains and keep traces.

        Parameters
        ----------
        seeds : sequence of SeedSequence
            One per chain.
        sweeps, burn_in, thinning : int
            Traces are kept every ``thinning`` sweeps after the first ``burn_in``.
        starts : (chains,) float, optional
            Start value of each chain in sigma; that of the model by default.
        """
        if not 0 < len(seeds) <= COLUMNS:
            raise DeviationError(f"one to {COLUMNS} chains can run at once, got {len(seeds)}")
        begin = np.full(COLUMNS, self.model.start)
        begin[: len(seeds)] = self.model.start if starts is None else starts
        states = np.zeros((len(seeds), self.n_samples))
        traces: dict[str, Floats] = {}
        for number, patch in enumerate(self.patches):
            streams = [stream_of(seed, number) for seed in seeds]
            x, kept = patch.run(streams, sweeps, burn_in, thinning, begin)
            states[:, patch.samples] = self.model.sigma * x.T[: len(seeds), patch.point_of_sample]
            for key, trace in kept.items():
                traces[f"patch {number} {key}"] = self.model.sigma * trace[: len(seeds)]
        return GibbsRun(states, traces)


class _PatchChain:
    """Sweeps over one patch, in units of sigma."""

    def __init__(self, model: Gibbs, patch: PatchPoints, low: Floats | None, high: Floats | None) -> None:
        unit = SurfaceField(patch.points / model.length, patch.triangles, "whittle", collar=False)
        precision = unit.precision()
        diagonal = precision.diagonal()
        precision.setdiag(0.0)
        precision.eliminate_zeros()
        self.starts = precision.indptr.astype(np.int64)
        self.columns = precision.indices.astype(np.int64)
        rows = np.repeat(np.arange(len(diagonal)), np.diff(self.starts))
        self.weights = (-precision.data / diagonal[rows]).astype(np.float32)
        self.deviation = (1.0 / np.sqrt(diagonal)).astype(np.float32)
        self.order: Ints = np.arange(len(diagonal))
        if model.order == "chromatic":
            self.order = np.argsort(colours(self.starts, self.columns), kind="stable")
        self.samples, self.point_of_sample = patch.samples, patch.point_of_sample
        self.low = self.high = None
        if low is not None and high is not None:
            self.low, self.high = (np.zeros(len(diagonal)) for _ in range(2))
            self.low[patch.point_of_sample] = low[patch.samples]
            self.high[patch.point_of_sample] = high[patch.samples]

    def run(
        self, streams: Sequence[NDArray[np.uint32]], sweeps: int, burn_in: int, thinning: int, begin: Floats
    ) -> tuple[Floats, dict[str, Floats]]:
        n = len(self.deviation)
        noise = np.zeros((COLUMNS, padded_count(n)), dtype=np.float32)
        x = np.tile(begin.astype(np.float32), (n, 1))
        if self.low is not None and self.high is not None:
            x = np.clip(x, self.low[:, None], self.high[:, None])
        watched = np.unique(np.linspace(0, n - 1, _MONITORED).astype(int))
        kept: list[NDArray[Any]] = []
        per_page = noise.shape[1] // n  # a page of numbers serves several sweeps of a small patch
        for number in range(sweeps):
            page, part = divmod(number, per_page)
            if part == 0:
                fill_page(streams, page, noise)
            self._sweep(noise[:, part * n : (part + 1) * n], x)
            if number >= burn_in and (number - burn_in) % thinning == 0:
                kept.append(np.concatenate([x.mean(axis=0, keepdims=True), x[watched]]))
        names = ["mean", *(f"point {i}" for i in watched)]
        if not kept:
            return x.astype(np.float64), {}
        traces = np.stack(kept, axis=-1).astype(np.float64)
        return x.astype(np.float64), dict(zip(names, traces, strict=True))

    def _sweep(self, noise: NDArray[np.float32], x: NDArray[Any]) -> None:
        common = (self.order, self.starts, self.columns, self.weights, self.deviation, noise)
        if self.low is None:
            sweep(*common, x)
        else:
            truncated_sweep(*common, self.low, self.high, x)


def _limits(model: Gibbs, nominal: NominalModel) -> tuple[Floats | None, Floats | None]:
    """Limits per sample in units of sigma, or None twice."""
    if model.lower is None and model.upper is None:
        return None, None
    values = []
    for key, missing in (("lower", -np.inf), ("upper", np.inf)):
        given = getattr(model, key)
        array = np.asarray(missing if given is None else given, dtype=np.float64)
        if array.ndim and array.shape != (nominal.n_samples,):
            raise DeviationError(
                f"Gibbs: {key} has {len(array)} values, the part has {nominal.n_samples} feature samples"
            )
        values.append(np.broadcast_to(array / model.sigma, (nominal.n_samples,)))
    low, high = values
    bad = np.flatnonzero(~(low < high))
    if len(bad):
        raise DeviationError(
            f"Gibbs: at sample {bad[0]} the lower limit {low[bad[0]] * model.sigma:.6g} mm is not below the "
            f"upper one {high[bad[0]] * model.sigma:.6g} mm: nothing is left ({len(bad)} samples in all)"
        )
    return low, high
