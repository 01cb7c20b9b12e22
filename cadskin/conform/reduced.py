"""A Gaussian block on few of its points: what rejection screens with, and what chains move.

The deviations are ``mean + z @ factor`` with independent standard normal ``z``. On a subset of the points a
band needs at most the width that it needs on all: what fails there fails. What passes is made in full and
tested on all points. Chains of ``z`` given the bands of the subset, kept where all points pass, follow the
exact conditioned law.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cadskin.conform._bands import Bands, first_reference
from cadskin.conform._subset import spread_subset
from cadskin.conform._trajectory import heights_of
from cadskin.deviation._philox import padded_count

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin._typing import Floats, Ints
    from cadskin.conform.bands import Band
    from cadskin.deviation import Sampler

__all__ = ["ReducedBlock", "reduced_block"]

_MOST_LATENT = 4096
_FEW = 300  # points of a band
_MOST_NUMBERS = 6_000_000  # of a factor: 48 MB
_JITTER = 1e-6  # of places, in units of their extent: no three of them are exactly on one line


@dataclass(frozen=True, eq=False)
class ReducedBlock:
    """A block on a subset of the points of its bands.

    Parameters
    ----------
    sampler : Sampler
        With ``latent`` and ``transform``.
    rows : (n,) int
        Samples of the block, in order.
    mean : (n,) float
        Of the model [mm].
    requirements : tuple of Band
        Their rows count within the block.
    chosen : tuple of (m_c,) int
        Points of each band.
    factor : (k, m) float
    factor32 : (k, m) float32
    bands : Bands
        On the chosen points.
    whole : (k, n) float32 or None
        The factor at all samples, where it is small.
    """

    sampler: Sampler
    rows: Ints
    mean: Floats
    requirements: tuple[Band, ...]
    chosen: tuple[Ints, ...]
    factor: Floats
    factor32: Floats
    bands: Bands
    whole: Floats | None

    @property
    def latent(self) -> int:
        """Number of standard normal numbers."""
        return len(self.factor)

    @property
    def padded(self) -> int:
        """Length of a page of noise."""
        return padded_count(self.latent)

    def fields(self, latent: Floats) -> Floats:
        """Return the deviations (j, n) [mm] of standard normal numbers (j, k)."""
        if self.whole is None:
            made: Floats = self.sampler.transform(latent)[:, self.rows]
            return made
        out = np.zeros((len(latent), len(self.rows)), dtype=np.float32)
        for row, numbers in zip(out, np.ascontiguousarray(latent, dtype=np.float32), strict=True):
            heights_of(numbers, self.whole, row)
        return self.mean + out

    def holds(self, field: Floats) -> bool:
        """Tell whether deviations (n,) fit all bands."""
        return all(band.holds(np.ascontiguousarray(field[band.rows])) for band in self.requirements)

    def with_points(self, more: Sequence[Ints]) -> ReducedBlock:
        """Return the block on more points of each band."""
        chosen = tuple(np.union1d(old, new) for old, new in zip(self.chosen, more, strict=True))
        return _assembled(self.sampler, self.rows, self.mean, self.requirements, chosen, self.whole)


def reduced_block(sampler: Sampler, rows: Ints, bands: Sequence[Band]) -> ReducedBlock | None:
    """Return the reduced block of a Gaussian sampler; None where its numbers are too many or not known.

    Parameters
    ----------
    sampler : Sampler
        Of a Gaussian model; its ``transform`` maps standard normal numbers to deviations.
    rows : (n,) int
        Samples of the block, in order.
    bands : sequence of Band
        Not empty; their rows are among those of the block.
    """
    latent = sampler.latent
    if not 0 < latent <= _MOST_LATENT:
        return None
    chosen = []
    for band in bands:
        if band.flat is None:
            step = max(1, -(-len(band.rows) // _FEW))
            chosen.append(np.arange(0, len(band.rows), step, dtype=np.int64))
        else:
            chosen.append(spread_subset(band.flat.places, _FEW, keep=band.flat.reference))
    if latent * sum(map(len, chosen)) > _MOST_NUMBERS:
        return None
    mean = sampler.transform(np.zeros((1, latent), dtype=np.float32))[0, rows]
    own = tuple(replace(band, rows=np.searchsorted(rows, band.rows)) for band in bands)
    whole = None
    if latent * len(rows) <= _MOST_NUMBERS:
        whole = (_factor(sampler, rows) - mean).astype(np.float32)
    return _assembled(sampler, rows, mean, own, tuple(chosen), whole)


def _assembled(
    sampler: Sampler,
    rows: Ints,
    mean: Floats,
    bands: tuple[Band, ...],
    chosen: tuple[Ints, ...],
    whole: Floats | None,
) -> ReducedBlock:
    few = np.concatenate([band.rows[points] for band, points in zip(bands, chosen, strict=True)])
    stops = np.cumsum([len(points) for points in chosen])
    starts = stops - [len(points) for points in chosen]
    kinds = [(band.kind, a, b) for band, a, b in zip(bands, starts, stops, strict=True)]
    factor = _factor(sampler, rows[few]) - mean[few] if whole is None else whole[:, few].astype(np.float64)
    places, references = _shaken_places(bands, chosen)
    packed = Bands(
        centre=np.ascontiguousarray(mean[few]),
        kinds=np.array(kinds, dtype=np.int64),
        limits=np.array([band.limit for band in bands]),
        offsets=np.array([band.width(np.ascontiguousarray(mean[band.rows])) for band in bands]),
        places=places,
        references=references,
    )
    return ReducedBlock(
        sampler=sampler,
        rows=rows,
        mean=mean,
        requirements=bands,
        chosen=chosen,
        factor=np.ascontiguousarray(factor),
        factor32=np.ascontiguousarray(factor, dtype=np.float32),
        bands=packed,
        whole=whole,
    )


def _shaken_places(bands: Sequence[Band], chosen: Sequence[Ints]) -> tuple[Floats, Ints]:
    """Return the places (2, m) of the chosen points, and where the exchange of each band starts (c, 4)."""
    places, references = [], np.zeros((len(bands), 4), dtype=np.int64)
    for c, (band, points) in enumerate(zip(bands, chosen, strict=True)):
        few = np.zeros((len(points), 2)) if band.flat is None else band.flat.places[points]
        if band.flat is not None:
            references[c] = first_reference(few)
        places.append(few + _JITTER * np.random.default_rng(c).uniform(-1.0, 1.0, few.shape))
    return np.ascontiguousarray(np.concatenate(places).T), references


def _factor(sampler: Sampler, rows: Ints) -> Floats:
    """Return the deviations (k, m) of each unit vector of the latent numbers at some samples."""
    latent = sampler.latent
    out = np.zeros((latent, len(rows)))
    unit = np.zeros((32, latent), dtype=np.float32)
    for start in range(0, latent, 32):
        stop = min(start + 32, latent)
        unit[:] = 0.0
        unit[np.arange(stop - start), np.arange(start, stop)] = 1.0
        out[start:stop] = sampler.transform(unit)[: stop - start, rows]
    return out
