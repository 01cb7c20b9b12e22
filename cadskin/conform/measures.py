"""Linear measures of a part: weights w with ``measure = w @ deviation``, from a short text."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.skin.weld import prepare_weld

if TYPE_CHECKING:
    from collections.abc import Callable

    from cadskin._typing import Floats
    from cadskin.shape import NominalModel

__all__ = ["MEASURES", "measure"]


def measure(text: str, nominal: NominalModel) -> Floats:
    """Return the weights (n_c,) of a measure.

    ==============================  ====================================================================
    ``volume``                      added volume [mm³]
    ``mean(FACES)``                 mean deviation of faces over their area [mm]
    ``gap(FACES, FACES)``           what the mean distance of two facing surfaces grows by [mm]
    ``tilt(FACES)``                 slope of the best plane through the deviations, longer side [rad]
    ``distance(x y z, x y z)``      change of the distance of the two nearest vertices [mm]
    ==============================  ====================================================================

    A sign in front turns it round: ``-volume`` is the most that can be missing.

    Parameters
    ----------
    text : str
        FACES is a selector: ``>Z``, ``3``, ``%CYLINDER``.
    nominal : NominalModel

    Raises
    ------
    SpecificationError
        No such measure; the message lists what there is.
    SelectionError
        A selector that matches nothing.

    Examples
    --------
    >>> import cadquery as cq, cadskin as cs
    >>> part = cs.nominal(cq.Workplane().box(4, 4, 2), edge_length=1.0)
    >>> float((measure("volume", part) @ np.full(part.n_samples, 0.01)).round(9))  # 0.01 on 64 mm²
    0.64
    """
    match = re.fullmatch(r"\s*([+-]?)\s*([a-z]+)\s*(?:\((.*)\))?\s*", text)
    if match is None or match[2] not in MEASURES:
        raise SpecificationError(
            f"no measure is written {text!r}; there are volume, mean(FACES), gap(FACES, FACES), tilt(FACES) "
            "and distance(x y z, x y z)"
        )
    sign = -1.0 if match[1] == "-" else 1.0
    arguments = [word.strip() for word in (match[3] or "").split(",") if word.strip()]
    function, count = MEASURES[match[2]]
    if len(arguments) != count:
        raise SpecificationError(
            f"measure {match[2]!r} takes {count} arguments, {text!r} has {len(arguments)}"
        )
    return sign * function(nominal, *arguments)


def _areas(nominal: NominalModel) -> Floats:
    """Area that belongs to each sample (n_c,) [mm²]: a third of its triangles on its own feature."""
    corners = nominal.corner_samples
    third = np.repeat(nominal.surface.triangle_areas / 3.0, 3)
    return np.asarray(np.bincount(corners.ravel(), third, nominal.n_samples), dtype=np.float64)


def _volume(nominal: NominalModel) -> Floats:
    return _areas(nominal)


def _selector(text: str) -> str | int:
    return int(text) if text.isdigit() else text


def _mean(nominal: NominalModel, faces: str) -> Floats:
    areas, weights = _areas(nominal), np.zeros(nominal.n_samples)
    for feature in nominal.select(_selector(faces)):
        weights[feature.rows] = areas[feature.rows]
    return np.asarray(weights / weights.sum())


def _gap(nominal: NominalModel, first: str, second: str) -> Floats:
    return -_mean(nominal, first) - _mean(nominal, second)


def _tilt(nominal: NominalModel, face: str) -> Floats:
    feature = nominal.feature(_selector(face))
    centred = feature.points - feature.points.mean(axis=0)
    along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
    weights = np.zeros(nominal.n_samples)
    weights[feature.rows] = along / (along @ along)
    return weights


def _distance(nominal: NominalModel, first: str, second: str) -> Floats:
    points = nominal.surface.points
    ends = []
    for text in (first, second):
        try:
            place = np.array([float(word) for word in text.split()])
        except ValueError:
            place = np.zeros(0)
        if place.shape != (3,) or not np.isfinite(place).all():
            raise SpecificationError(f"distance takes two points x y z in mm, got {text!r}")
        ends.append(int(np.argmin(((points - place) ** 2).sum(axis=1))))
    direction = points[ends[1]] - points[ends[0]]
    length = float(np.linalg.norm(direction))
    if length == 0.0:
        raise SpecificationError(f"the nearest vertices of {first!r} and {second!r} are the same")
    moves = np.zeros(3 * len(points))
    moves[3 * ends[1] : 3 * ends[1] + 3] = direction / length
    moves[3 * ends[0] : 3 * ends[0] + 3] = -direction / length
    return np.asarray(prepare_weld(nominal).constraints.particular.T @ moves)


MEASURES: dict[str, tuple[Callable[..., Floats], int]] = {
    "volume": (_volume, 0),
    "mean": (_mean, 1),
    "gap": (_gap, 2),
    "tilt": (_tilt, 1),
    "distance": (_distance, 2),
}
"""Name -> function and number of arguments."""
