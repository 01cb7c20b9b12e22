"""Markov chains on a reduced block: exact Hamiltonian Monte Carlo, slice sampling, truncated Gibbs sampling.

Every sample runs a chain of its own, from a start that its seed decides, for as many steps as pilot chains
need to forget theirs several times over, and then until all points fit. The law is the conditioned one up to
what is left of the start; the report says how fast the pilot chains mixed.

===========  ==========================================  ==============================================
method       one step                                    pays
===========  ==========================================  ==============================================
``hmc``      a trajectory of a quarter turn, reflected   nearly always: a step is nearly independent
``slice``    a random ellipse through the state          mild bands; has no settings
``gibbs``    every number in turn, given the others      to compare; in tight zones of rough fields
===========  ==========================================  ==============================================
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.special import ndtr

from cadskin.conform._bands import widest
from cadskin.conform._chains import coordinate_sweep, slice_step
from cadskin.conform._trajectory import heights_of, trajectory
from cadskin.deviation._philox import fill_page, stream_of
from cadskin.deviation.diagnostics import effective_sample_size, split_rhat
from cadskin.errors import ConformityError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from cadskin._typing import Floats
    from cadskin.conform.reduced import ReducedBlock

__all__ = ["ChainMethod", "ChainReport", "ChainRoute", "chain_route", "run_chain"]

ChainMethod = Literal["hmc", "slice", "gibbs"]

_FIRST_PAGE = 1 << 24  # of the chains; the pages before are candidates for rejection
_PAGES = 1 << 17  # of each chain
_STARTS = 60  # halvings of a start
_LEAST = {"hmc": 10, "slice": 60, "gibbs": 20}  # steps from a start
_MOST = {"hmc": 400, "slice": 20_000, "gibbs": 4000}
_PILOT = {"hmc": 60, "slice": 400, "gibbs": 60}  # steps of each pilot chain
_PILOTS = 4
_FORGET = 6.0  # autocorrelation times after which a start counts as forgotten
_ROUNDS = 6  # of giving the pilot chains more points
_GOOD = 0.3  # share of pilot states that fit on all points, for which no more are given
_MOST_POINTS = 2500
_EXTRA = 400  # steps that wait for a state that fits on all points


@dataclass(frozen=True)
class ChainReport:
    """How the pilot chains of a block went.

    Parameters
    ----------
    method : {"hmc", "slice", "gibbs"}
    steps : int
        That every sample makes from its start.
    rhat : float
        Largest split R-hat of the width of the band and of the length of the latent vector.
    independent_per_step : float
        Effective sample size over steps, of the slower one.
    passing : float
        Share of states that fit the band on all points, given that they fit on the subset.
    reflections : float
        Mean number per trajectory (hmc) or of tests per step (slice).
    points : int
        Of the subset.
    """

    method: ChainMethod
    steps: int
    rhat: float
    independent_per_step: float
    passing: float
    reflections: float
    points: int


@dataclass(frozen=True, eq=False)
class ChainRoute:
    """A block and the chain that samples it."""

    block: ReducedBlock
    report: ChainReport


def chain_route(
    block: ReducedBlock, method: ChainMethod = "hmc", *, seed: np.random.SeedSequence | None = None
) -> ChainRoute:
    """Return the chain of a block, its length set by pilot chains.

    Parameters
    ----------
    block : ReducedBlock
    method : {"hmc", "slice", "gibbs"}
    seed : SeedSequence, optional
        Of the pilot chains; a fixed one by default: the route depends on the block alone.

    Raises
    ------
    ConformityError
        No deviations that fit the bands were found, or none that fit on all points.
    """
    own = np.random.SeedSequence(20130501) if seed is None else seed
    for turn in range(_ROUNDS):
        traces, passing, reflections, support = _pilots(block, method, own)
        grown = block.with_points(support)
        points = grown.factor.shape[1]
        if (
            passing >= _GOOD
            or turn == _ROUNDS - 1
            or points > _MOST_POINTS
            or points == len(block.bands.centre)
        ):
            break
        block = grown
    if passing <= 0.0:
        raise ConformityError(
            f"{block.requirements[0].label}: no state of the pilot chains fits on all points; take a longer "
            "correlation length or a coarser mesh"
        )
    share = min(effective_sample_size(trace) / trace.size for trace in traces)
    rhat = max(split_rhat(trace) for trace in traces)
    steps = math.ceil(_FORGET / max(min(share, 1.0), 1e-6))
    steps = min(max(steps, _LEAST[method]), _MOST[method])
    report = ChainReport(method, steps, rhat, share, passing, reflections, len(block.bands.centre))
    return ChainRoute(block, report)


def run_chain(route: ChainRoute, state: NDArray[np.uint32], *, turn: int = 0) -> tuple[Floats, int]:
    """Return deviations (n,) [mm] of the block that fit all bands, and the steps that they took.

    Parameters
    ----------
    route : ChainRoute
    state : (4,) uint32
        Stream of the noise; see `cadskin.deviation._philox.stream_of`.
    turn : int
        Number of the chain: each uses other pages of the stream.

    Raises
    ------
    ConformityError
        No state of the chain fitted on all points.
    """
    block, report = route.block, route.report
    first = _FIRST_PAGE + _PAGES * turn
    z = _start(block, state, first)
    move = _mover(block, report.method, state, first + 1)
    for step in range(report.steps):
        move(z, step)
    for step in range(report.steps, report.steps + _EXTRA):
        move(z, step)
        field = block.fields(z[None, :])[0]
        if block.holds(field):
            return field, step + 1
    raise ConformityError(
        f"{block.requirements[0].label}: none of {_EXTRA} states of the chain fits on all points; take a "
        "longer correlation length or a coarser mesh"
    )


def _start(block: ReducedBlock, state: NDArray[np.uint32], number: int) -> Floats:
    """Return numbers that fit the bands of the subset: those of a page, halved as often as needed."""
    page = np.zeros((1, block.padded), dtype=np.float32)
    fill_page([state], number, page)
    z = page[0, : block.latent].astype(np.float64)
    for _ in range(_STARTS):
        if _share(block, z) <= 1.0:
            return z
        z *= 0.5
    worst = int(np.argmax(block.bands.offsets / block.bands.limits))
    raise ConformityError(
        f"{block.requirements[worst].label}: the mean of the model alone needs "
        f"{block.bands.offsets[worst]:.4g} mm, against a limit of {block.bands.limits[worst]:.4g} mm; "
        "correct the systematic deviation"
    )


def _share(block: ReducedBlock, z: Floats) -> float:
    """Return the largest width over its limit on the subset."""
    here = np.zeros(len(block.bands.centre))
    heights_of(z, block.factor, here)
    return float(widest(here, block.bands, np.zeros(len(here))))


def _mover(
    block: ReducedBlock, method: ChainMethod, state: NDArray[np.uint32], first: int
) -> Callable[[Floats, int], int]:
    """Return the step of a chain: it changes numbers in place and returns how much work that was."""
    page = np.zeros((1, block.padded), dtype=np.float32)

    def normals(number: int) -> Floats:
        fill_page([state], first + number, page)
        return np.asarray(page[0], dtype=np.float64)

    def hmc(z: Floats, step: int) -> int:
        velocity = normals(step)[: block.latent]
        return int(trajectory(z, velocity, block.factor, block.bands, 0.5 * math.pi)[0])

    def slice_(z: Floats, step: int) -> int:
        fresh = normals(2 * step)[: block.latent]
        uniforms = np.asarray(ndtr(normals(2 * step + 1)[:64]))
        angle = 2.0 * math.pi * float(uniforms[0])
        return int(slice_step(z, fresh, angle, uniforms[1:], block.factor, block.bands))

    def gibbs(z: Floats, step: int) -> int:
        coordinate_sweep(z, ndtr(normals(step)[: block.latent]), block.factor, block.bands)
        return 1

    moves: dict[ChainMethod, Callable[[Floats, int], int]] = {"hmc": hmc, "slice": slice_, "gibbs": gibbs}
    return moves[method]


def _pilots(
    block: ReducedBlock, method: ChainMethod, seed: np.random.SeedSequence
) -> tuple[Floats, float, float, Sequence[NDArray[np.int64]]]:
    """Return traces (2, chains, draws) of pilots, share that fits, work per step, and points that count."""
    length = _PILOT[method]
    traces = np.zeros((2, _PILOTS, length))
    support: list[set[int]] = [set(map(int, points)) for points in block.chosen]
    fitting = work = 0
    for chain in range(_PILOTS):
        state = stream_of(seed, chain)
        z = _start(block, state, _FIRST_PAGE)
        move = _mover(block, method, state, _FIRST_PAGE + 1)
        states = np.zeros((length, block.latent))
        for step in range(length):
            work += max(move(z, step), 0)
            states[step] = z
        fields = block.fields(states)
        for step, field in enumerate(fields):
            fits = True
            for band, points in zip(block.requirements, support, strict=True):
                heights = np.ascontiguousarray(field[band.rows])
                if not band.holds(heights):
                    fits = False
                    points.update(map(int, band.support(heights)))
            fitting += fits
            first = block.requirements[0]
            traces[0, chain, step] = first.width(np.ascontiguousarray(field[first.rows]))
        traces[1, chain] = (states**2).sum(axis=1)
    count = _PILOTS * length
    more = [np.array(sorted(points), dtype=np.int64) for points in support]
    half = length // 4  # the start is not part of what is judged
    return traces[:, :, half:], fitting / count, work / count, more
