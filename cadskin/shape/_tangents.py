"""Two unit vectors across a normal, for compiled code."""

from __future__ import annotations

import math
from typing import Any

from cadskin._jit import kernel

__all__ = ["fill_tangents"]


@kernel
def fill_tangents(normal: Any, first: Any, second: Any) -> None:
    """Write unit vectors (3,) that are right-handed with the unit normal (3,): first x second = normal.

    The first is the coordinate axis that is farthest from the normal, projected.
    """
    axis = 0
    for k in range(1, 3):
        if abs(normal[k]) < abs(normal[axis]):
            axis = k
    size = math.sqrt(max(1.0 - normal[axis] * normal[axis], 1e-300))
    for k in range(3):
        first[k] = ((1.0 if k == axis else 0.0) - normal[axis] * normal[k]) / size
    second[0] = normal[1] * first[2] - normal[2] * first[1]
    second[1] = normal[2] * first[0] - normal[0] * first[2]
    second[2] = normal[0] * first[1] - normal[1] * first[0]
