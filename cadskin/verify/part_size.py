"""Sizes of the specification on made parts: local two-point sizes against the limits (ISO 14405-1, LP)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.shape.ideal import Cylinder
from cadskin.verify.evaluation import Evaluation
from cadskin.verify.extraction import axial_sections
from cadskin.verify.part_form import axis_pose
from cadskin.verify.size import local_diameters

if TYPE_CHECKING:
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
        for ring in axial_sections(part, feature.face_indices, pose, sections):
            found.append(factor * local_diameters(ring, pose.axis))
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
