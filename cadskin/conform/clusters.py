"""Clusters: blocks that tolerances couple through their datums, in the order in which they are drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin.conform.requirements import Requirement

__all__ = ["Cluster", "clusters_of"]


@dataclass(frozen=True, eq=False)
class Cluster:
    """Blocks whose deviations are conditioned together.

    Parameters
    ----------
    blocks : tuple of int
        Datums first.
    own : mapping of int to tuple of Requirement
        What depends on one block alone.
    coupled : tuple of Requirement
        What depends on several.
    """

    blocks: tuple[int, ...]
    own: dict[int, tuple[Requirement, ...]]
    coupled: tuple[Requirement, ...]

    def completed_by(self, block: int) -> tuple[Requirement, ...]:
        """Return the coupled requirements all of whose blocks are drawn once ``block`` is."""
        place = self.blocks.index(block)
        drawn = set(self.blocks[: place + 1])
        return tuple(item for item in self.coupled if block in item.blocks and item.blocks <= drawn)

    def touching(self, block: int) -> tuple[Requirement, ...]:
        """Return the coupled requirements that depend on ``block``."""
        return tuple(item for item in self.coupled if block in item.blocks)

    def requirements(self) -> tuple[Requirement, ...]:
        """Return all requirements."""
        return (*(item for block in self.blocks for item in self.own[block]), *self.coupled)


def clusters_of(n_blocks: int, requirements: Sequence[Requirement]) -> tuple[Cluster, ...]:
    """Return the clusters of all blocks.

    Parameters
    ----------
    n_blocks : int
    requirements : sequence of Requirement
        Those of the policy "none" count for nothing; "reject" couples all blocks.
    """
    active = [item for item in requirements if item.policy.method != "none"]
    pairs = [(min(item.blocks), block) for item in active for block in item.blocks]
    if any(item.policy.method == "reject" for item in active):
        pairs += [(0, block) for block in range(n_blocks)]
    ends = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    graph = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(n_blocks, n_blocks))
    labels = connected_components(graph, directed=False)[1]
    order = _drawing_order(n_blocks, active)
    clusters = []
    for label in range(int(labels.max(initial=-1)) + 1):
        blocks = tuple(block for block in order if labels[block] == label)
        mine = [item for item in active if item.blocks <= set(blocks)]
        own: dict[int, tuple[Requirement, ...]] = {
            block: tuple(item for item in mine if item.blocks == {block} and not _whole(item))
            for block in blocks
        }
        coupled = tuple(item for item in mine if len(item.blocks) > 1 or _whole(item))
        clusters.append(Cluster(blocks, own, coupled))
    return tuple(clusters)


def _whole(item: Requirement) -> bool:
    return item.policy.method == "reject"


def _drawing_order(n_blocks: int, requirements: Sequence[Requirement]) -> list[int]:
    """Order blocks so that a datum comes before what refers to it, where the references make no circle."""
    needs: dict[int, set[int]] = {block: set() for block in range(n_blocks)}
    for item in requirements:
        for block in item.own:
            needs[block] |= item.blocks - item.own
    depth = np.zeros(n_blocks, dtype=np.int64)
    for _ in range(n_blocks):
        deeper = np.array([1 + max((depth[k] for k in needs[b]), default=-1) for b in range(n_blocks)])
        if (deeper == depth).all() or deeper.max(initial=0) > n_blocks:
            break
        depth = deeper
    return [int(block) for block in np.lexsort((np.arange(n_blocks), depth))]
