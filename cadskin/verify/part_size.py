"""Sizes of the specification on made parts: local two-point sizes against the limits (ISO 14405-1, LP)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import AssociationError, SpecificationError
from cadskin.shape.ideal import Cylinder
from cadskin.verify._circles import gaussian_circles
from cadskin.verify.evaluation import Evaluation
from cadskin.verify.extraction import axial_sections
from cadskin.verify.part_form import axis_pose
from cadskin.verify.size import diameters_about

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin._typing import Floats, Points
    from cadskin.shape.association import Pose
    from cadskin.spec import Dimension
    from cadskin.verify.extraction import MadePart

__all__ = ["evaluate_size", "has_size_limits"]


def has_size_limits(dimension: Dimension) -> bool:
    """Tell whether a dimension is a size with limits."""
    return dimension.kind == "size" and (dimension.lower is not None or dimension.upper is not None)


def evaluate_size(dimension: Dimension, part: MadePart, *, sections: int = 15) -> Evaluation:
    """Evaluate the local sizes of cylinders: every two-point size lies within the limits.

    Parameters
    ----------
    dimension : Dimension
        A size with limits on cylinders, without modifiers (the default of ISO 14405-1).
    part : MadePart
    sections : int

    Returns
    -------
    Evaluation
        Its value is the local size that is farthest beyond a limit, or nearest to one; ``details`` has the
        smallest and the largest.

    Raises
    ------
    SpecificationError
        Another feature, or a modifier such as the envelope requirement.
    AssociationError
        No section is a full turn.
    """
    if dimension.modifiers:
        raise SpecificationError(
            f"dimension {dimension.id}: size with {', '.join(dimension.modifiers)} is not supported"
        )
    features = part.features(dimension.feature.faces)
    if not features or not all(isinstance(feature.ideal, Cylinder) for feature in features):
        raise SpecificationError(
            f"dimension {dimension.id}: the size of anything but cylinders is not supported"
        )
    factor = 0.5 if dimension.name == "radius" else 1.0
    found = []
    for feature in features:
        pose = axis_pose(feature, part.points(feature.face_indices))
        rings = axial_sections(part, feature.face_indices, pose, sections)
        found += [factor * diameters for diameters in _local_sizes(rings, pose)]
    if not found:
        raise AssociationError(f"dimension {dimension.id}: two-point sizes need a full turn of the feature")
    sizes = np.concatenate(found)
    smallest, largest = float(sizes.min()), float(sizes.max())
    low = np.inf if dimension.lower is None else smallest - dimension.lower
    high = np.inf if dimension.upper is None else dimension.upper - largest
    return Evaluation(
        characteristic="size",
        value=smallest if low < high else largest,
        quantity="local two-point size LP nearest to its limit",
        certified=True,
        n_points=len(sizes),
        limit=dimension.lower if low < high else dimension.upper,
        details={"smallest": smallest, "largest": largest},
        operations=(
            "extraction: sections across the Gaussian axis",
            "filtration: none",
            "size: two-point LP",
        ),
        verdict=bool(low >= 0 and high >= 0),
    )


def _local_sizes(rings: Sequence[Points], pose: Pose) -> list[Floats]:
    """Return the two-point sizes of sections across an axis; a section through a wavy rim is none."""
    flat = np.ascontiguousarray(pose.local(np.concatenate(rings))[:, :2])
    starts = np.cumsum([0, *(len(ring) for ring in rings)])
    circles, settled = gaussian_circles(flat, starts)
    found = []
    for k in np.flatnonzero(settled):
        diameters = diameters_about(flat[starts[k] : starts[k + 1]] - circles[k, :2])
        if diameters is not None:
            found.append(diameters)
    return found
