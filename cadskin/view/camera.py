"""Where the eye stands: directions, the best of several, and the fit of a part into a frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from cadskin._arrays import frozen
from cadskin._typing import Floats, Points
from cadskin.errors import ExportError

__all__ = ["CANDIDATES", "VIEWS", "Camera", "View", "fit", "view_direction"]

View: TypeAlias = "Literal['auto', 'iso', 'front', 'back', 'left', 'right', 'top', 'bottom'] | ArrayLike"

_ELEVATION = np.deg2rad(31.0)


def _around(azimuth_degrees: float, elevation: float) -> tuple[float, float, float]:
    azimuth = np.deg2rad(azimuth_degrees)
    x, y = np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth)
    return float(x), float(y), float(np.sin(elevation))


# Not exactly isometric: there, opposite corners of a cube would fall on each other.
CANDIDATES = tuple(
    _around(azimuth, sign * _ELEVATION) for sign in (1, -1) for azimuth in (-57.0, -123.0, 33.0, 147.0)
)
VIEWS: dict[str, tuple[float, float, float]] = {
    "iso": CANDIDATES[0],
    "front": (0.0, -1.0, 0.0),
    "back": (0.0, 1.0, 0.0),
    "left": (-1.0, 0.0, 0.0),
    "right": (1.0, 0.0, 0.0),
    "top": (0.0, 0.0, 1.0),
    "bottom": (0.0, 0.0, -1.0),
}


@dataclass(frozen=True, eq=False)
class Camera:
    """A parallel projection.

    Parameters
    ----------
    axes : (3, 3) float
        Rows: to the right, up, and out of the picture towards the eye.
    centre : (3,) float
        Point shown at ``middle`` [mm].
    middle : (2,) float
        Its place in the picture [pixel], y downward.
    scale : float
        Pixels per mm.
    """

    axes: Floats
    centre: Points
    middle: Floats
    scale: float

    def __post_init__(self) -> None:
        """Freeze."""
        for key, shape in (("axes", (3, 3)), ("centre", (3,)), ("middle", (2,))):
            object.__setattr__(self, key, frozen(getattr(self, key), shape=shape, name=key))

    def project(self, points: Points) -> Points:
        """Return ``x y depth`` (k, 3) [pixel]; y grows downward, depth towards the eye."""
        local = (points - self.centre) @ self.axes.T * self.scale
        local[:, 0] += self.middle[0]
        local[:, 1] = self.middle[1] - local[:, 1]
        return np.asarray(local)


def view_direction(view: View) -> Floats:
    """Return the unit direction from the part to the eye of a named view (not ``auto``) or of a vector.

    Raises
    ------
    ExportError
        Unknown name, or not a direction.
    """
    if isinstance(view, str):
        if view not in VIEWS:
            raise ExportError(f"there is no view {view!r}; known are auto, {', '.join(VIEWS)}, or a vector")
        return np.array(VIEWS[view])
    vector = np.asarray(view, dtype=np.float64)
    length = float(np.linalg.norm(vector)) if vector.shape == (3,) else np.nan
    if not (np.isfinite(length) and length > 0):
        raise ExportError(f"view must be a name or a vector of three finite numbers, got {view!r}")
    return np.asarray(vector / length)


def fit(direction: Floats, points: Points, frame: tuple[float, float, float, float]) -> Camera:
    """Return the camera that shows ``points`` (k, 3) as large as the frame allows.

    Parameters
    ----------
    direction : (3,) float
        Unit vector from the part to the eye.
    points : (k, 3) float
        [mm]
    frame : tuple of float
        Left, top, right, bottom [pixel].
    """
    axes = _axes(direction)
    local = points @ axes.T
    low, high = local.min(axis=0), local.max(axis=0)
    left, top, right, bottom = frame
    extent = np.maximum(high - low, 1e-12)
    scale = min((right - left) / extent[0], (bottom - top) / extent[1])
    middle = np.array([(left + right) / 2, (top + bottom) / 2])
    return Camera(axes, (low + high) / 2 @ axes, middle, float(scale))


def _axes(direction: Floats) -> Floats:
    """Return right, up, eye; z points up in the picture, y where the eye looks along z."""
    up = np.array([0.0, 0.0, 1.0]) if abs(direction[2]) < 0.999 else np.array([0.0, 1.0, 0.0])
    right = np.cross(up, direction)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(direction, right), direction])
