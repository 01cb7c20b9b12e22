"""Which faces are seen from where."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from cadskin._typing import Floats, Vectors
from cadskin.export.content import Shape, content_of
from cadskin.view.camera import CANDIDATES, fit
from cadskin.view.raster import visible_area
from cadskin.view.scene import scene_of
from cadskin.view.software import _nearest

__all__ = ["seen_areas", "views_of"]

_LEAST_COSINE = 0.25
_FROM_BELOW = 0.2  # how much more of a face must be seen from below to look from there
_SEEN = 0.35  # share of what the best view shows of a face, from which on it counts as seen


def seen_areas(shape: Shape, *, pixels: int = 160) -> Floats:
    """Return the area [mm²] that each standard view shows of each label of a shape, hidden parts left out.

    Parameters
    ----------
    shape : NominalModel, SkinModel or DiscreteShape
    pixels : int
        Side of the trial pictures.

    Returns
    -------
    (n_views, n_labels) float
        Rows as `cadskin.view.camera.CANDIDATES`.
    """
    scene = scene_of(content_of(shape))
    count = int(scene.labels.max(initial=-1)) + 1
    areas = []
    for direction in CANDIDATES:
        camera = fit(np.array(direction), scene.points, (2, 2, pixels - 2, pixels - 2))
        corners, _, owner = _nearest(scene, camera, (pixels, pixels), 1)
        seen = visible_area(corners, scene.triangles, owner, _LEAST_COSINE) / camera.scale**2
        labelled = scene.labels >= 0
        areas.append(np.bincount(scene.labels[labelled], weights=seen[labelled], minlength=count))
    return np.array(areas, dtype=np.float64).reshape(len(CANDIDATES), count)


def views_of(labels: Iterable[int], areas: Floats) -> tuple[Vectors, ...]:
    """Return the view that shows most of some faces, and a second one for those it does not show.

    Parameters
    ----------
    labels : iterable of int
        The faces.
    areas : (n_views, n_labels) float
        See `seen_areas`.

    Returns
    -------
    tuple of (3,) array
        One or two directions from the part to the eye.

    Examples
    --------
    >>> import numpy as np
    >>> areas = np.zeros((8, 2))
    >>> areas[2, 0] = areas[5, 1] = 1.0  # no view shows both faces
    >>> len(views_of([0, 1], areas)), len(views_of([1], areas))
    (2, 1)
    """
    chosen = [label for label in dict.fromkeys(labels) if 0 <= label < areas.shape[1]]
    own = areas[:, chosen]
    best = own.max(axis=0, initial=0.0)
    shown = own[:, best > 0] / best[best > 0]
    from_below = _FROM_BELOW * (np.array(CANDIDATES)[:, 2] < 0)
    first = int(np.argmax(shown.sum(axis=1) - from_below))
    missed = shown[first] < _SEEN
    picked = [first]
    if missed.any():
        picked.append(int(np.argmax(shown[:, missed].sum(axis=1) - from_below)))
    return tuple(np.array(CANDIDATES[index]) for index in picked)
