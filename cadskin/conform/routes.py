"""Which sampler draws a block given what depends on it alone: one rule, the same for every sample.

========================  ==============================================================================
route                     used
========================  ==============================================================================
screened rejection        bands (flatness of planes) under a Gaussian model of up to 4096 numbers, where
                          at least 1 of 100 raw fields fits
exact HMC                 the same, where fewer fit
rejection, evaluated      everything else
slice sampling            everything else where rejection found nothing, under a Gaussian model
========================  ==============================================================================

``conditioned(sampler=...)`` overrides the rule. Rejection is exact; it comes first, for some tries, also
where a chain goes on: whether that happens does not depend on the field that is found: both have one law.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.conform.bands import flat_band
from cadskin.conform.chains import ChainRoute, chain_route
from cadskin.conform.policy import SamplerName, sampler_of
from cadskin.conform.reduced import ReducedBlock, reduced_block
from cadskin.conform.screening import acceptance_of
from cadskin.errors import ConformityError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin.conform.requirements import Requirement
    from cadskin.conform.streams import BlockSamplers

__all__ = ["FIRST_TRIES", "BlockRoute", "BlockRoutes"]

FIRST_TRIES = 64  # candidates before the acceptance is asked for
_LEAST_ACCEPTANCE = 0.01
_CHEAPER = 5  # candidates that are screened first, for one that is not


class BlockRoute:
    """A block whose own tolerances are bands.

    Parameters
    ----------
    block : ReducedBlock
    items : tuple of Requirement
        The tolerances of the bands, in their order.
    sampler : {"auto", "rejection", "hmc", "slice", "gibbs"}
    max_tries : int
        Of unscreened candidates.
    """

    def __init__(
        self, block: ReducedBlock, items: tuple[Requirement, ...], sampler: SamplerName, max_tries: int
    ) -> None:
        self.block, self.items, self.sampler = block, items, sampler
        self._tries = _CHEAPER * max_tries
        self._acceptance: float | None = None
        self._chain: ChainRoute | None = None

    @property
    def first_tries(self) -> int:
        """Candidates that are tried in any case."""
        if self.sampler in ("auto", "rejection"):
            return min(FIRST_TRIES, self._tries)
        return 0

    @property
    def tries(self) -> int:
        """Candidates that are tried in all; it may cost a pilot."""
        if self.sampler == "rejection":
            return self._tries
        if self.sampler == "auto" and self.acceptance >= _LEAST_ACCEPTANCE:
            return self._tries
        return self.first_tries

    @property
    def acceptance(self) -> float:
        """Share of raw fields that fit, from a pilot that depends on the block alone."""
        if self._acceptance is None:
            self._acceptance = acceptance_of(self.block)
        return self._acceptance

    @property
    def chain(self) -> ChainRoute:
        """The chain that goes on where rejection found nothing."""
        if self._chain is None:
            self._chain = chain_route(
                self.block, self.sampler if self.sampler in ("hmc", "slice", "gibbs") else "hmc"
            )
        return self._chain

    def record(self) -> dict[str, Any] | None:
        """Return the report of the chain as plain data; None where it was not needed."""
        if self._chain is None:
            return None
        names = [item.tolerance.id for item in self.items]
        return {"tolerances": names, **asdict(self._chain.report)}


class BlockRoutes:
    """The routes of all blocks, set up where they are needed.

    Parameters
    ----------
    samplers : BlockSamplers
    max_tries : int
    gaussian : bool
        Whether the model is known to be Gaussian: numbers from other samplers are not moved by chains.
    """

    def __init__(self, samplers: BlockSamplers, max_tries: int, *, gaussian: bool) -> None:
        self.samplers, self.max_tries = samplers, max_tries
        self.gaussian = gaussian
        self._routes: dict[int, BlockRoute | None] = {}

    def of(self, block: int, items: Sequence[Requirement]) -> BlockRoute | None:
        """Return the route of a block with its own requirements; None where they are no bands.

        Raises
        ------
        ConformityError
            A sampler was asked for that cannot draw this block.
        """
        if block not in self._routes:
            self._routes[block] = self._made(block, tuple(items))
        return self._routes[block]

    def records(self) -> list[dict[str, Any]]:
        """Return the reports of all chains that were needed, plain data for the provenance."""
        found = [route.record() for route in self._routes.values() if route is not None]
        return [record for record in found if record is not None]

    def _made(self, block: int, items: tuple[Requirement, ...]) -> BlockRoute | None:
        bands = [
            flat_band(item.flat, np.arange(item.feature.start, item.feature.stop), item.limit, item.label)
            for item in items
            if item.flat is not None and item.feature is not None and item.policy.method == "conditioned"
        ]
        found = None
        if bands and len(bands) == len(items) and self.gaussian:
            rows = np.asarray(self.samplers.blocks.rows[block])
            found = reduced_block(self.samplers.of_block(block), rows, bands)
        if found is not None:
            return BlockRoute(found, items, sampler_of(items), self.max_tries)
        asked = sampler_of(items)
        if asked in ("hmc", "gibbs"):
            raise ConformityError(
                f"{items[0].label}: sampler={asked!r} needs a Gaussian model of at most 4096 numbers and "
                "tolerances of flatness alone; take sampler='auto' or 'slice'"
            )
        return None
