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
    """Groups of probes, and the boxes of space that belong to them.

    Parameters
    ----------
    group : (k,) int
        Group of each probe.
    family : (g,) int
        Family of each group: the parity of its cells; groups of one family follow each other.
    parity : (f, d) int
        Parity of the cells of each family.
    box : (k, d) int
        Cell of each probe, counted among the cells of its family.
    """

    group: Ints
    family: Ints
    parity: Ints
    box: Ints

    @property
    def count(self) -> int:
        """Number of groups."""
        return len(self.family)

    def boxes(self, family: int, points: Points) -> tuple[Ints, Ints]:
        """Return the box number of each probe (k,), -1 outside of the family, and of each point (n,)."""
        mine = np.flatnonzero(self.family[self.group] == family)
        around = np.floor((points / CELL - self.parity[family] + 0.5) / 2).astype(np.int64)
        both = np.concatenate([self.box[mine], around])
        low = both.min(axis=0)
        key = np.ravel_multi_index(tuple((both - low).T), tuple(np.ptp(both, axis=0) + 1))
        _, number = np.unique(key, return_inverse=True)
        of_probe = np.full(len(self.group), -1, dtype=np.int64)
        of_probe[mine] = number[: len(mine)]
        return of_probe, number[len(mine) :]


def probe_groups(probes: Points) -> ProbeGroups:
    """Return groups of probes (k, d), given in correlation lengths."""
    cells = np.floor(probes / CELL).astype(np.int64)
    parity = cells % 2
    _, cell = np.unique(cells, axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    order = np.argsort(cell, kind="stable")
    rank = np.zeros(len(probes), dtype=np.int64)
    rank[order] = np.arange(len(probes)) - np.searchsorted(cell[order], cell[order])
    parities, family = np.unique(parity, axis=0, return_inverse=True)
    label, group = np.unique(np.column_stack([family.reshape(-1), rank]), axis=0, return_inverse=True)
    return ProbeGroups(group.reshape(-1), label[:, 0], parities, (cells - parity) // 2)
