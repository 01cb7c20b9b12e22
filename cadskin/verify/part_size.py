"""Sizes of the specification on made parts, against their limits (ISO 14405-1)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Literal, cast

import numpy as np

from cadskin.errors import AssociationError, SpecificationError
from cadskin.shape.association import associate
from cadskin.shape.ideal import Cylinder, Plane, Sphere, Torus
from cadskin.verify._circles import gaussian_circles
from cadskin.verify.datums import DatumCriterion, DatumFeature, establish_one
from cadskin.verify.evaluation import Evaluation
from cadskin.verify.extraction import axial_sections
from cadskin.verify.part_form import axis_pose, median_surface_points
from cadskin.verify.size import RANKS, SizeCriterion, diameters_about, global_size, rank

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin._typing import Floats, Points
    from cadskin.shape import Feature
    from cadskin.shape.association import Pose
    from cadskin.spec import Dimension
    from cadskin.verify.extraction import MadePart

__all__ = ["evaluate_size", "has_size_limits"]

# AP242 names -> letters of ISO 14405-1; "" has no meaning for the value of one part.
_LETTERS = {
    "two point size": "LP",
    "least squares association criterion": "GG",
    "maximum inscribed association criterion": "GX",
    "minimum circumscribed association criterion": "GN",
    "envelope requirement": "E",
    "maximum size": "SX",
    "minimum size": "SN",
    "average size": "SA",
    "average": "SA",
    "median size": "SM",
    "mid range size": "SD",
    "range of sizes": "SR",
    "free state": "",
    "free state condition": "",
    "continuous feature": "",
    "statistical": "",
}
_RADII = ("radius", "spherical radius")
_QUANTITIES = {"LP": "local two-point size", "GG": "size", "GX": "size", "GN": "size"}


def has_size_limits(dimension: Dimension) -> bool:
    """Tell whether a dimension is a size with limits."""
    return dimension.kind == "size" and (dimension.lower is not None or dimension.upper is not None)


def evaluate_size(dimension: Dimension, part: MadePart, *, sections: int = 15) -> Evaluation:
    """Evaluate a size with limits on the features of a made part (ISO 14405-1).

    Parameters
    ----------
    dimension : Dimension
        Of cylinders, spheres, or two opposite planes; by default local two-point sizes (LP). Modifiers may
        choose ``GG``, ``GX`` or ``GN`` (least squares, maximum inscribed, minimum circumscribed), a rank of
        the local sizes (``SX``, ``SN``, ``SA``, ``SM``, ``SD``, ``SR``, ``SQ``), or the envelope requirement
        ``E``, by letters or by their AP242 names. A radius is the Gaussian one: arcs have no two-point size.
    part : MadePart
    sections : int

    Returns
    -------
    Evaluation
        Its value is the size that is farthest beyond a limit, or nearest to one; ``details`` has the smallest
        and the largest.

    Raises
    ------
    SpecificationError
        Another feature or modifier.
    AssociationError
        No section is a full turn, or no inscribed element exists.
    """
    words = _words(dimension)
    criterion = next((word for word in words if word in ("LP", "GG", "GX", "GN")), None)
    ranks = [word for word in words if word in RANKS]
    if criterion is None:
        criterion = "GG" if dimension.name in _RADII else "LP"
    factor = 0.5 if dimension.name in _RADII else 1.0
    found, certified, internal = [], True, False
    for features in _features_of_size(dimension, part):
        sizes, proved = _sizes(dimension, part, features, criterion, sections)
        found.append(factor * (np.array([rank(sizes, word) for word in ranks]) if ranks else sizes))
        certified, internal = certified and proved, features[0].internal
    values = np.concatenate(found)
    name = " ".join([criterion, *ranks])
    result = _judged(dimension, values, f"{_QUANTITIES[criterion]} {name}, nearest to its limit", certified)
    if "E" not in words:
        return result
    mating = "GX" if internal else "GN"
    widest = [_sizes(dimension, part, one, mating, sections) for one in _features_of_size(dimension, part)]
    envelope = factor * np.concatenate([sizes for sizes, _ in widest])
    return _enveloped(dimension, result, envelope, mating, all(proved for _, proved in widest))


def _words(dimension: Dimension) -> tuple[str, ...]:
    """Return the modifiers as letters of ISO 14405-1.

    Raises
    ------
    SpecificationError
        One that is not known here.
    """
    found, unknown = [], []
    for modifier in dimension.modifiers:
        word = _LETTERS.get(modifier.lower().replace("_", " "), modifier.upper())
        if word in ("", "LP", "GG", "GX", "GN", "E") or word in RANKS:
            found.append(word)
        else:
            unknown.append(modifier)
    if unknown:
        raise SpecificationError(f"dimension {dimension.id}: size with {', '.join(unknown)} is not supported")
    return tuple(found)


def _features_of_size(dimension: Dimension, part: MadePart) -> list[tuple[Feature, ...]]:
    """Return the features of a size: each round one by itself, or the two planes of a width."""
    features = part.features((*dimension.feature.faces, *dimension.second.faces))
    whole = Cylinder | Sphere | Torus if dimension.name in _RADII else Cylinder | Sphere
    if features and all(isinstance(feature.ideal, whole) for feature in features):
        return [(feature,) for feature in features]
    planes = len(features) == 2 and all(isinstance(feature.ideal, Plane) for feature in features)
    if planes and float(features[0].faces[0].normal @ features[1].faces[0].normal) < -0.999:
        return [(features[0], features[1])]
    kinds = ", ".join(dict.fromkeys(feature.kind for feature in features)) or "no feature"
    raise SpecificationError(
        f"dimension {dimension.id}: the size of {kinds} is not supported; of cylinders, spheres and two "
        "opposite planes it is"
    )


def _sizes(
    dimension: Dimension, part: MadePart, features: tuple[Feature, ...], criterion: str, sections: int
) -> tuple[Floats, bool]:
    """Return the sizes (n,) of one feature of size by a criterion, and whether they are proved."""
    feature = features[0]
    points = part.points(feature.face_indices)
    if isinstance(feature.ideal, Plane):
        return _widths(part, features, criterion)
    if isinstance(feature.ideal, Torus):
        found = associate(points, "torus", "least squares", axis=feature.ideal.axis)
        return np.array([2.0 * float(found.pose.shape[0])]), found.certified
    kind: Literal["cylinder", "sphere"] = "sphere" if isinstance(feature.ideal, Sphere) else "cylinder"
    if criterion != "LP":
        axis = getattr(feature.ideal, "axis", None)
        one = global_size(points, kind, cast("SizeCriterion", criterion), axis=axis)
        return np.array([one.value]), one.certified
    if kind == "sphere":
        return _through_centre(dimension, points), True
    pose = axis_pose(feature, points)
    local = _local_sizes(axial_sections(part, feature.face_indices, pose, sections), pose)
    if not local:
        raise AssociationError(f"dimension {dimension.id}: two-point sizes need a full turn of the feature")
    return np.concatenate(local), True


def _through_centre(dimension: Dimension, points: Points) -> Floats:
    """Return the two-point sizes of a sphere: each point and the one opposite, interpolated from three."""
    from scipy.spatial import cKDTree

    rays = points - associate(points, "sphere", "least squares").pose.origin
    radii = np.linalg.norm(rays, axis=1)
    units = rays / radii[:, None]
    apart, near = cKDTree(units).query(-units, k=3)
    opposite = apart[:, 0] < 3.0 * float(np.sqrt(4.0 * np.pi / len(points)))
    if not opposite.any():
        raise AssociationError(
            f"dimension {dimension.id}: no point of the sphere has one opposite to it; ask for its Gaussian "
            "size (GG)"
        )
    weights = 1.0 / np.maximum(apart[opposite], 1e-12)
    beyond = (radii[near[opposite]] * weights).sum(axis=1) / weights.sum(axis=1)
    return np.asarray(radii[opposite] + beyond)


def _widths(part: MadePart, features: tuple[Feature, ...], criterion: str) -> tuple[Floats, bool]:
    """Return the distances of two opposite planes: point by point, or of two parallel associated planes."""
    first, second = (part.points(feature.face_indices) for feature in features)
    if criterion == "LP":
        median = median_surface_points(part, features)
        return np.asarray(2.0 * np.linalg.norm(median - first, axis=1)), True
    normal = np.asarray(features[0].faces[0].normal)
    if criterion == "GG":
        axes = np.linalg.svd(np.concatenate([first - first.mean(axis=0), second - second.mean(axis=0)]))[2]
        return np.array([abs(float((first.mean(axis=0) - second.mean(axis=0)) @ axes[2]))]), True
    word: DatumCriterion = "inscribed" if criterion == "GX" else "circumscribed"
    apart = (features[1].faces[0].centre - features[0].faces[0].centre) @ normal
    width = DatumFeature("width", "width", first, bool(apart > 0), normal, word, second)
    found = establish_one(width, standard="custom")
    return np.array([float(found.size or 0.0)]), found.certified


def _judged(dimension: Dimension, sizes: Floats, quantity: str, certified: bool) -> Evaluation:
    smallest, largest = float(sizes.min()), float(sizes.max())
    low = np.inf if dimension.lower is None else smallest - dimension.lower
    high = np.inf if dimension.upper is None else dimension.upper - largest
    note = ("statistical: its process is not judged",) if "statistical" in dimension.modifiers else ()
    return Evaluation(
        characteristic="size",
        value=smallest if low < high else largest,
        quantity=quantity,
        certified=certified,
        n_points=len(sizes),
        limit=dimension.lower if low < high else dimension.upper,
        details={"smallest": smallest, "largest": largest},
        operations=(
            "extraction: sections across the Gaussian axis, or the points of the feature",
            "filtration: none",
            f"size: {quantity.partition(',')[0]}",
        ),
        notes=note,
        verdict=bool(low >= 0 and high >= 0),
    )


def _enveloped(
    dimension: Dimension, local: Evaluation, envelope: Floats, mating: str, certified: bool
) -> Evaluation:
    """Return the verdict of the envelope requirement: no mating size beyond the maximum material size.

    ISO 14405-1, E: local sizes keep the least material limit, the mating size keeps the other.
    """
    inside = mating == "GX"
    worst = float(envelope.min() if inside else envelope.max())
    limit = dimension.lower if inside else dimension.upper
    fits = limit is None or (worst >= limit if inside else worst <= limit)
    least = dimension.upper if inside else dimension.lower
    extreme = local.details["largest" if inside else "smallest"]
    kept = least is None or (extreme <= least if inside else extreme >= least)
    return replace(
        local,
        certified=local.certified and certified,
        details={**local.details, "mating_size": worst},
        operations=(*local.operations, f"envelope requirement: {mating}"),
        verdict=bool(fits and kept),
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
