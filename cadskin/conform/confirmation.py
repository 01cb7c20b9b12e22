"""A flatness on the welded mesh, bounded from above without evaluating it.

The weld moves the points of a plane along it as well (where an edge is pulled by the other face). A plane
``a + b x + c y`` within half a width of all heights is, after slides of at most s, within that and
``s |(b, c)|``: mostly far more than enough, and exact where nothing slides.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._jit import kernel

if TYPE_CHECKING:
    from cadskin._typing import Vectors
    from cadskin.conform.requirements import Requirement
    from cadskin.shape import NominalModel

__all__ = ["is_flat_enough"]

_ROUNDING = 1e-9  # relative distance from the limit that the evaluator's own rounding may take


def is_flat_enough(item: Requirement, nominal: NominalModel, displacement: Vectors) -> bool:
    """Tell whether a displacement (n, 3) [mm] of the mesh is known to meet a requirement of flatness.

    False where it is not known; the evaluator decides then.
    """
    if item.flat is None or item.feature is None:
        return False
    vertices = np.array(nominal.samples.vertex_ids[item.feature.rows], dtype=np.int64)
    normal = np.array(item.feature.faces[0].normal, dtype=np.float64)
    heights = np.zeros(len(vertices))
    slide = float(_heights_and_slide(np.array(displacement), vertices, normal, heights))
    _, upper, plane = item.flat.band(heights, item.limit * (1.0 - _ROUNDING))
    if upper > item.limit * (1.0 - _ROUNDING):
        return False
    slope = float(np.hypot(plane[1], plane[2])) / item.flat.extent
    return upper + 2.0 * slide * slope <= item.limit * (1.0 - _ROUNDING)


@kernel
def _heights_and_slide(displacement: Any, vertices: Any, normal: Any, heights: Any) -> Any:
    """Write the moves of vertices along the normal; return their longest move across it."""
    longest = 0.0
    for k in range(vertices.size):
        height, square = 0.0, 0.0
        for axis in range(3):
            height += displacement[vertices[k], axis] * normal[axis]
        for axis in range(3):
            square += (displacement[vertices[k], axis] - height * normal[axis]) ** 2
        heights[k] = height
        longest = max(longest, square)
    return np.sqrt(longest)
