"""Rejection in two stages: candidates are made on a few points, and in full only where these fit.

What does not fit on a subset of the points fits on all even less, so nothing is lost. Candidate t of a sample
is page t of one counter-based stream: the outcome depends on the sample alone, not on those drawn beside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cadskin.conform._chains import first_passing
from cadskin.deviation._philox import fill_page, stream_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from cadskin._typing import Floats
    from cadskin.conform.reduced import ReducedBlock

__all__ = ["Search", "acceptance_of", "search_of", "search_on"]

_BLOCK = 32  # fields that are made at once where making one alone costs as much
_WIDEST = 64  # candidates of a sample in one round
_PILOT = 1024  # candidates that an acceptance is told from


@dataclass
class Search:
    """The search for the conforming field of one sample.

    Attributes
    ----------
    state : (4,) uint32
        Stream of its candidates.
    first, next : int
        Number of the first and of the next candidate.
    refused : (c,) int
        Candidates that each band turned away.
    least : (c,) float
        Smallest width over its limit among these.
    found : (n,) float or None
        Deviations of the block that fit [mm].
    """

    state: NDArray[np.uint32]
    first: int
    next: int
    refused: NDArray[np.int64]
    least: Floats
    noise: NDArray[np.float32]
    found: Floats | None = None

    @property
    def tried(self) -> int:
        """Number of candidates so far."""
        return self.next - self.first


def search_of(block: ReducedBlock, state: NDArray[np.uint32], first: int = 0) -> Search:
    """Return a search that has not begun.

    Parameters
    ----------
    block : ReducedBlock
    state : (4,) uint32
        Stream of the sample; see `cadskin.deviation._philox.stream_of`.
    first : int
        Number of the first candidate.
    """
    count = len(block.bands.limits)
    page = np.zeros(block.padded, dtype=np.float32)
    return Search(state, first, first, np.zeros(count, dtype=np.int64), np.full(count, np.inf), page)


def search_on(searches: Sequence[Search], block: ReducedBlock, tries: int) -> None:
    """Carry searches of several samples on by at most ``tries`` candidates each."""
    stops = {id(search): search.next + tries for search in searches}
    width = 1
    going = [search for search in searches if search.found is None]
    while going and tries > 0:
        for start in range(0, len(going), _BLOCK):
            _round(block, going[start : start + _BLOCK], width, stops)
        width = min(2 * width, _WIDEST)
        going = [search for search in going if search.found is None and search.next < stops[id(search)]]


def _round(block: ReducedBlock, searches: Sequence[Search], width: int, stops: dict[int, int]) -> None:
    """Screen ``width`` candidates of each search; make the first that passes in full and test it."""
    passing = [s for s in searches if _screened(block, s, min(width, stops[id(s)] - s.next))]
    if not passing:
        return
    fields = block.fields(np.stack([search.noise[: block.latent] for search in passing]))
    for search, made in zip(passing, fields, strict=True):
        for c, band in enumerate(block.requirements):
            if not band.holds(np.ascontiguousarray(made[band.rows])):
                search.refused[c] += 1
                search.least[c] = min(search.least[c], 1.0)
                break
        else:
            search.found = made


def _screened(block: ReducedBlock, search: Search, count: int) -> bool:
    page = first_passing(
        *(search.state, search.next, count, block.factor32, block.bands),
        *(search.noise, search.refused, search.least),
    )
    search.next = search.next + count if page < 0 else page + 1
    return bool(page >= 0)


def acceptance_of(block: ReducedBlock, seed: np.random.SeedSequence | None = None) -> float:
    """Return the share of raw fields that fit all bands, from some hundred of them (0 where none does).

    The same for every sample: by default the seed is fixed.
    """
    state = stream_of(np.random.SeedSequence(20130501) if seed is None else seed, _BLOCK)
    page = np.zeros((1, block.padded), dtype=np.float32)
    search, numbers, kept = search_of(block, state), [], 0
    while search.next < _PILOT:
        if _screened(block, search, _PILOT - search.next):
            numbers.append(search.next - 1)
    for start in range(0, len(numbers), _BLOCK):
        rows = []
        for number in numbers[start : start + _BLOCK]:
            fill_page([state], number, page)
            rows.append(page[0, : block.latent].copy())
        kept += sum(block.holds(made) for made in block.fields(np.stack(rows)))
    return kept / _PILOT
