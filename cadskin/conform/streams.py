"""Random fields by number: field t of a sample depends on the seed, the sample and t alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.deviation._philox import stream_of
from cadskin.skin.simulate import child_seed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from cadskin._typing import Floats
    from cadskin.conform.blocks import Blocks
    from cadskin.deviation import DeviationModel, Sampler
    from cadskin.shape import NominalModel

__all__ = ["FIRST_SAMPLES", "SEARCHED_SAMPLES", "BlockFields", "BlockSamplers", "first_fields"]

_FIRST = 4  # fields of a sample that are drawn together with those of other samples
FIRST_SAMPLES = 8
SEARCHED_SAMPLES = 32
_SHARED = 32  # the first fields are drawn for all blocks at once
_BATCH = 32  # then as many at a time for one block


class BlockSamplers:
    """The samplers of a model: one for the whole part, and one per block where more fields are needed."""

    def __init__(self, nominal: NominalModel, model: DeviationModel, blocks: Blocks) -> None:
        self.nominal, self.model, self.blocks = nominal, model, blocks
        self.whole = model.prepare(nominal)
        self._of_block: dict[int, Sampler] = {}

    def of_block(self, block: int) -> Sampler:
        """Return the sampler of one block."""
        if len(self.blocks) == 1:
            return self.whole
        if block not in self._of_block:
            import warnings

            with warnings.catch_warnings():  # said for the whole part already
                warnings.simplefilter("ignore")
                self._of_block[block] = self.model.prepare(self.nominal, self.blocks.features[block])
        return self._of_block[block]


class BlockFields:
    """The fields of one sample, by block and number.

    Parameters
    ----------
    samplers : BlockSamplers
    seed : SeedSequence
        Of the sample.
    first : (k, n_c) float, optional
        Its first fields, from `first_fields`.
    """

    def __init__(
        self, samplers: BlockSamplers, seed: np.random.SeedSequence, first: Floats | None = None
    ) -> None:
        self.samplers, self.seed = samplers, seed
        self._first = first
        self._shared: Floats | None = None
        self._batch: dict[int, tuple[int, Floats]] = {}
        self._next = np.zeros(len(samplers.blocks), dtype=np.int64)
        self._candidates: dict[int, int] = {}
        self._chains: dict[int, int] = {}

    def fresh(self, block: int) -> Floats:
        """Return the next field of a block on its rows (k,) [mm]."""
        number = int(self._next[block])
        self._next[block] += 1
        rows = self.samplers.blocks.rows[block]
        if self._first is not None and number < len(self._first):
            return np.asarray(self._first[number, rows])
        if number < _SHARED:
            if self._shared is None:
                self._shared = self.samplers.whole.draw([child_seed(self.seed, t) for t in range(_SHARED)])
            return np.asarray(self._shared[number, rows])
        start = _SHARED + (number - _SHARED) // _BATCH * _BATCH
        if self._batch.get(block, (-1,))[0] != start:
            own = child_seed(child_seed(self.seed, _SHARED), block)
            fields = self.samplers.of_block(block).draw(
                [child_seed(own, t) for t in range(start, start + _BATCH)]
            )
            self._batch[block] = (start, np.ascontiguousarray(fields[:, rows]))
        return np.asarray(self._batch[block][1][number - start])

    def stream(self, block: int) -> NDArray[np.uint32]:
        """Return the stream (4,) of the normal numbers of a block, for candidates and chains of them."""
        return stream_of(self.seed, block)

    def candidates_of(self, block: int) -> int:
        """Return the number of the next candidate from the stream of a block."""
        return self._candidates.get(block, 0)

    def note_candidates(self, block: int, following: int) -> None:
        """Keep the number of the candidate that follows those used."""
        self._candidates[block] = following

    def chains_of(self, block: int) -> int:
        """Return how many chains of a block there were before, and count one more."""
        before = self._chains.get(block, 0)
        self._chains[block] = before + 1
        return before

    def generator(self, stream: int) -> np.random.Generator:
        """Return a generator of the sample that no field uses."""
        return np.random.default_rng(child_seed(child_seed(self.seed, _SHARED + 1), stream))


def first_fields(samplers: BlockSamplers, seeds: Sequence[np.random.SeedSequence]) -> Floats:
    """Return the first fields (len(seeds), k, n_c) of samples [mm], drawn at once: a field costs less so."""
    drawn = samplers.whole.draw([child_seed(seed, t) for seed in seeds for t in range(_FIRST)])
    return drawn.reshape(len(seeds), _FIRST, -1)
