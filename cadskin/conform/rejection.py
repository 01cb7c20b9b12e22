"""Draw a cluster of blocks given its tolerances: by rejection, and by exact chains where rejection fails.

A block is drawn given what depends on it alone (form) by rejection, or as `cadskin.conform.routes` says; a
cluster by drawing its blocks, datums first, and rejecting all of them when a tolerance between them fails.
Both are exact. Where the first needs more than ``max_tries`` fields, a Markov chain goes on; where the second
needs more than ``joint_tries`` attempts, the blocks are drawn in turn, each given the others (Gibbs sampling
over blocks). Whether that happens does not depend on the state: the mixture keeps the law of the chains.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cadskin.conform.chains import run_chain
from cadskin.conform.policy import sampler_of
from cadskin.errors import ConformityError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin.conform.chain import Chain, Tally
    from cadskin.conform.clusters import Cluster
    from cadskin.conform.requirements import Requirement
    from cadskin.conform.routes import BlockRoute

__all__ = ["draw_cluster"]

_MOST_HALVINGS = 6  # that lengthen a chain


def draw_cluster(chain: Chain, cluster: Cluster) -> None:
    """Put deviations that meet all tolerances on the blocks of a cluster.

    Raises
    ------
    ConformityError
        None was found; the message names the tolerance that binds.
    """
    if not cluster.coupled:
        for block in cluster.blocks:
            _draw_block(chain, block, cluster.own[block])
        return
    rejecting = any(item.policy.method == "reject" for item in cluster.coupled)
    fitting = any(item.policy.method in ("target", "scale") for item in cluster.requirements())
    attempts = chain.setup.max_tries if rejecting or fitting else chain.setup.joint_tries
    for _ in range(attempts):
        chain.tally.attempts += 1
        if _attempt(chain, cluster):
            chain.tally.accepted += 1
            chain.tally.samplers.add("rejection")
            return
    if rejecting or fitting:
        raise ConformityError(_message(chain, cluster.requirements(), "attempts at the whole"))
    _in_turn(chain, cluster)
    chain.tally.samplers.add("blocks in turn")


def _attempt(chain: Chain, cluster: Cluster) -> bool:
    """Draw the blocks of a cluster afresh; tell whether all tolerances between them are met."""
    for block in cluster.blocks:
        chain.put(block, 0.0)
    for block in cluster.blocks:
        _draw_block(chain, block, cluster.own[block])
        between = cluster.completed_by(block)
        if not (chain.fitted(between) and chain.meets_all(between)):
            return False
        if any(item.policy.method in ("target", "scale") for item in between) and not chain.meets_all(
            cluster.own[block]
        ):
            return False
    return True


def _draw_block(chain: Chain, block: int, own: Sequence[Requirement]) -> None:
    """Draw a block given its own tolerances."""
    mine = tuple(own)
    if not mine:
        chain.put(block, chain.fields.fresh(block))
        return
    route = chain.setup.routes.of(block, mine)
    if route is not None:
        _by_route(chain, block, route)
        return
    wanted = sampler_of(mine)
    for _ in range(1 if wanted == "slice" else chain.setup.max_tries):
        chain.tally.attempts += 1
        if chain.propose(block, mine):
            chain.tally.accepted += 1
            chain.tally.samplers.add("rejection")
            return
    fitting = any(item.policy.method in ("target", "scale") for item in mine)
    free = not any(item.tolerance.datums for item in mine)
    given_up = fitting or wanted == "rejection"
    halvings = -1 if given_up else chain.shrink((block,), mine, rigid=free)
    if halvings < 0:
        raise ConformityError(_message(chain, mine, "fields of it"))
    for _ in range(chain.setup.slice_steps * 2 ** min(halvings, _MOST_HALVINGS)):
        chain.slice(block, mine)
    chain.tally.samplers.add("slice")


def _by_route(chain: Chain, block: int, route: BlockRoute) -> None:
    """Draw a block whose own tolerances are bands: by screened rejection, then by a chain of its numbers."""
    search = chain.searched(block, route)
    chain.tally.add(route, search)
    if search.found is None and route.sampler == "rejection":
        raise ConformityError(_message(chain, route.items, "fields of it"))
    if search.found is not None:
        chain.put(block, search.found)
        chain.tally.samplers.add("rejection")
        return
    deviations, _ = run_chain(route.chain, search.state, turn=chain.fields.chains_of(block))
    chain.put(block, deviations)
    chain.tally.samplers.add(route.chain.report.method)


def _in_turn(chain: Chain, cluster: Cluster) -> None:
    """Draw the blocks in turn, each given all others, from a start that meets all tolerances."""
    for block in cluster.blocks:
        _draw_block(chain, block, cluster.own[block])
    if chain.shrink(cluster.blocks, cluster.requirements()) < 0:
        raise ConformityError(_message(chain, cluster.requirements(), "attempts at the whole"))
    for _ in range(chain.setup.sweeps):
        for block in cluster.blocks:
            _redraw(chain, cluster, block)


def _redraw(chain: Chain, cluster: Cluster, block: int) -> None:
    """Draw a block given the others: by rejection, else by one step of slice sampling."""
    between = cluster.touching(block)
    own = cluster.own[block]
    if not between:
        _draw_block(chain, block, own)
        return
    kept = chain.block(block)
    for _ in range(chain.setup.joint_tries):
        if chain.propose(block, own) and chain.meets_all(between):
            return
    chain.put(block, kept)
    chain.slice(block, (*own, *between))


def _message(chain: Chain, items: Sequence[Requirement], what: str) -> str:
    """Say which tolerance binds, its best value against its limit, and what to do."""
    tally: Tally = chain.tally
    names = {item.tolerance.id: item for item in items}
    binding = max(names, key=lambda name: tally.refused.get(name, 0) / max(tally.tried.get(name, 0), 1))
    item, tried = names[binding], tally.tried.get(binding, 0)
    best = tally.best.get(binding)
    reached = "" if best is None else f"; the best one reaches {best:.4g} mm"
    if sampler_of(items) == "rejection" and chain.setup.mean is not None:
        way = (
            "take conditioned(sampler='auto'), which goes on with a Markov chain, a smaller sigma, or more "
            "tries"
        )
    elif chain.setup.mean is not None:
        way = "take a smaller sigma or a longer correlation length, calibrate it (cpk=1.33), or more tries"
    else:
        way = "take a smaller deviation, more tries, or a Gaussian model, for which slice sampling serves"
    return (
        f"{item.label} binds: it refused {tally.refused.get(binding, 0)} of {tried} {what}{reached}, "
        f"against a limit of {item.limit:.4g} mm; {way}"
    )
