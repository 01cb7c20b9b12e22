"""Few of many places that stand for all of them: the extreme ones, and the rest evenly spread."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._jit import kernel

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints

__all__ = ["spread_subset"]

_DIRECTIONS = 32


def spread_subset(places: Floats, count: int, *, keep: Ints | None = None) -> Ints:
    """Return sorted indices of ``count`` of the places (n, 2), each next one farthest from the others.

    The outermost places in 32 directions and those of ``keep`` come first: bands are turned about them.
    """
    angles = np.linspace(0.0, 2.0 * np.pi, _DIRECTIONS, endpoint=False)
    directions = np.stack([np.cos(angles), np.sin(angles)])
    first = np.argmax(places @ directions, axis=0)
    if keep is not None:
        first = np.concatenate([keep, first])
    chosen = list(dict.fromkeys(int(k) for k in first))
    if len(places) <= max(count, len(chosen)):
        return np.arange(len(places), dtype=np.int64)
    columns = np.ascontiguousarray(places.T, dtype=np.float64)
    found = _farthest(columns, np.array(chosen, dtype=np.int64), max(count, len(chosen)))
    return np.asarray(np.unique(found), dtype=np.int64)


@kernel
def _farthest(places: Any, chosen: Any, count: int) -> Any:
    """Return ``chosen`` and further indices, each of the place (of (2, n)) farthest from those before."""
    out = np.zeros(count, dtype=np.int64)
    distance = np.full(places.shape[1], np.inf)
    for k in range(count):
        if k < chosen.size:
            out[k] = chosen[k]
        else:
            out[k] = np.argmax(distance)
        x, y = places[0, out[k]], places[1, out[k]]
        for i in range(distance.size):
            gap = (places[0, i] - x) ** 2 + (places[1, i] - y) ** 2
            distance[i] = min(distance[i], gap)
    return out
