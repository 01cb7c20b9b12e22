"""Row norms of a map that spreads only locally: far-apart unit vectors share one application.

Space is cut into cells of `CELL` correlation lengths. The probes of a group lie in cells of the same parity
on every axis, one per cell, so that every mesh point belongs to one probe, at most half a cell outside of
its cell; a response ends well before that.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cadskin._typing import Ints, Points

__all__ = ["CELL", "ProbeGroups", "probe_groups"]

CELL = 6.0


@dataclass(frozen=True, eq=False)
class ProbeGroups:
    """Groups of probes.

    Parameters
    ----------
    group : (k,) int
        Group of each probe.
    parity : (g, d) int
        Parity of the cells of each group.
    box : (k, d) int
        Cell of each probe, counted among the cells of its parity.
    """

    group: Ints
    parity: Ints
    box: Ints

    @property
    def count(self) -> int:
        """Number of groups."""
        return len(self.parity)

    def owners(self, group: int, points: Points) -> Ints:
        """Return the probe of ``group`` that each point (n, d) belongs to, -1 for none."""
        mine = np.flatnonzero(self.group == group)
        boxes = np.floor((points / CELL - self.parity[group] + 0.5) / 2).astype(np.int64)
        both = np.concatenate([self.box[mine], boxes])
        low, extent = both.min(axis=0), np.ptp(both, axis=0) + 1
        keys = np.ravel_multi_index(tuple((both - low).T), tuple(extent))
        order = np.argsort(keys[: len(mine)])
        sorted_keys = keys[: len(mine)][order]
        slot = np.minimum(np.searchsorted(sorted_keys, keys[len(mine) :]), len(mine) - 1)
        return np.where(sorted_keys[slot] == keys[len(mine) :], mine[order][slot], -1)


def probe_groups(probes: Points) -> ProbeGroups:
    """Return groups of probes (k, d), given in correlation lengths."""
    cells = np.floor(probes / CELL).astype(np.int64)
    parity = cells % 2
    _, cell = np.unique(cells, axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    order = np.argsort(cell, kind="stable")
    rank = np.zeros(len(probes), dtype=np.int64)
    rank[order] = np.arange(len(probes)) - np.searchsorted(cell[order], cell[order])
    label = np.column_stack([parity, rank])
    groups, group = np.unique(label, axis=0, return_inverse=True)
    return ProbeGroups(group.reshape(-1), groups[:, :-1], (cells - parity) // 2)
