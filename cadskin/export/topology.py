"""The one question about topology that a writer asks."""

from __future__ import annotations

import numpy as np

from cadskin._typing import Triangles

__all__ = ["is_closed"]


def is_closed(triangles: Triangles) -> bool:
    """Tell whether every directed edge has exactly one partner in the other direction.

    Examples
    --------
    >>> is_closed(np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))
    True
    >>> is_closed(np.array([[0, 2, 1]]))
    False
    """
    tails = triangles.ravel()
    heads = np.roll(triangles, -1, axis=1).ravel()
    base = np.int64(triangles.max(initial=0) + 1)
    forward = np.sort(tails * base + heads)
    backward = np.sort(heads * base + tails)
    return bool((forward[1:] != forward[:-1]).all() and (forward == backward).all())
