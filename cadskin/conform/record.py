"""How conformity was reached, for the provenance of a population."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cadskin.conform.chain import Tally
    from cadskin.conform.simulate import ConformingSampler

__all__ = ["conformity_record"]


def conformity_record(sampler: ConformingSampler, tallies: list[Tally]) -> dict[str, Any]:
    """Return how conformity was reached, plain data for the provenance."""
    tried: dict[str, int] = {}
    refused: dict[str, int] = {}
    for tally in tallies:
        for total, part in ((tried, tally.tried), (refused, tally.refused)):
            for name, count in part.items():
                total[name] = total.get(name, 0) + count
    attempts = sum(tally.attempts for tally in tallies)
    return {
        "conform": {name: str(policy) for name, policy in sampler.policies.items()},
        "samplers": sorted({name for tally in tallies for name in tally.samplers}),
        "chains": sampler.setup.routes.records(),
        "acceptance": sum(tally.accepted for tally in tallies) / attempts if attempts else 1.0,
        "acceptance_by_tolerance": {name: 1 - refused.get(name, 0) / tried[name] for name in sorted(tried)},
        "unsupported": [{"tolerance": item.tolerance, "reason": item.reason} for item in sampler.unsupported],
    }
