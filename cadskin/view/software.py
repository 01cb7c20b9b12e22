"""The software engine: a scene and a camera to pixels, on any machine."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from cadskin._typing import Floats, Ints, Vectors
from cadskin.export.colours import to_linear, to_srgb
from cadskin.view.camera import CANDIDATES, Camera, fit
from cadskin.view.canvas import Colour, hex_colour
from cadskin.view.raster import fill_triangles, mark_outlines, occlusion, shade, stamp_lines, visible_area
from cadskin.view.scene import Scene

__all__ = ["BACKGROUND", "best_direction", "render"]

BACKGROUND: Colour = hex_colour("#fbfcfd")
_SHARP_LINE: Colour = hex_colour("#20262e")
_SMOOTH_LINE: Colour = hex_colour("#7f8894")
_FACTOR = 3  # side of the box of subpixels behind one pixel
# Direction (right, up, eye), strength, wrap; the last row is the ambient light.
_LIGHTS = (
    (-0.50, 0.75, 0.50, 0.46, 0.60),
    (0.15, 0.00, 1.00, 0.40, 0.10),
    (0.0, 0.0, 0.0, 0.35, 0.0),
)
_OCCLUSION_REACH = 0.045  # of the smaller side of the picture
_OCCLUSION_SAMPLES = 24
_OCCLUSION_STRENGTH = 0.85
_UNLIT = ((0.0, 0.0, 0.0, 1.0, 0.0),)


def render(
    scene: Scene,
    camera: Camera,
    size: tuple[int, int],
    *,
    edges: bool = True,
    lit: bool = True,
    background: Colour = BACKGROUND,
) -> Floats:
    """Return the picture (height, width, 3) of a scene, sRGB in 0..1.

    Parameters
    ----------
    scene : Scene
    camera : Camera
        In pixels of the picture.
    size : tuple of int
        Width and height [pixel].
    edges : bool
        Draw B-rep edges and outlines.
    lit : bool
        False: every point has exactly the colour of its deviation.
    background : tuple of float
        sRGB.
    """
    width, height = size
    corners, depth, owner = _nearest(scene, camera, size, _FACTOR)
    marks = np.zeros(depth.shape, dtype=np.uint8)
    line = max(min(width, height) / 900, 0.75)
    if edges:
        extent = np.ptp(corners[:, 2])
        mark_outlines(depth, marks, max(round(1.2 * line * _FACTOR), 1), max(0.004 * extent, 6.0))
        ends = corners[scene.edges]
        stamp_lines(ends, scene.edge_codes, depth, marks, 0.80 * line * _FACTOR)
    linear, shares = shade(
        corners,
        scene.triangles,
        scene.rows,
        np.ascontiguousarray(scene.normals @ camera.axes.T),
        np.ascontiguousarray(scene.place, dtype=np.float64),
        to_linear(scene.table),
        owner,
        marks,
        _unit_lights(_LIGHTS if lit else _UNLIT),
        _sky(depth) if lit else np.ones((height, width)),
        to_linear(np.array(background)),
        _FACTOR,
    )
    # Lines are laid over the finished colours: mixed in linear light they would look thin.
    share = shares[:, :, 1:]
    lines = share @ np.array([_SMOOTH_LINE, _SHARP_LINE])
    return np.asarray(to_srgb(linear) * (1 - share.sum(axis=2, keepdims=True)) + lines)


def _sky(depth: NDArray[np.float32]) -> Floats:
    """Return the share of light (height, width) that reaches each pixel into holes and corners."""
    reach = _OCCLUSION_REACH * min(depth.shape)
    index = np.arange(_OCCLUSION_SAMPLES) + 0.5
    radius, angle = np.sqrt(index / _OCCLUSION_SAMPLES), index * 2.399963229728653  # the golden angle
    offsets = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    seen = occlusion(depth, _FACTOR, reach, offsets)
    return np.asarray(1.0 - _OCCLUSION_STRENGTH * (1.0 - uniform_filter(seen, 4)))


def best_direction(scene: Scene, *, pixels: int = 160) -> Vectors:
    """Return the standard direction (3,) from which most of the part's surface is seen.

    Each feature counts with the square root of its area, so that a small hole that can be seen from one side
    only is worth more than a bit of a large plane; the view from front, right and above wins ties.
    """
    area = 0.5 * np.linalg.norm(
        np.cross(
            scene.points[scene.triangles[:, 1]] - scene.points[scene.triangles[:, 0]],
            scene.points[scene.triangles[:, 2]] - scene.points[scene.triangles[:, 0]],
        ),
        axis=1,
    )
    best, best_score = CANDIDATES[0], -1.0
    for k, direction in enumerate(CANDIDATES):
        camera = fit(np.array(direction), scene.points, (2, 2, pixels - 2, pixels - 2))
        corners, _, owner = _nearest(scene, camera, (pixels, pixels), 1)
        seen = visible_area(corners, scene.triangles, owner, 0.25) / camera.scale**2
        score = _score(seen, area, scene.labels) - (0.0 if k == 0 else 0.03 if k < 4 else 0.10)
        if score > best_score:
            best, best_score = direction, score
    return np.array(best)


def _score(seen: Floats, area: Floats, labels: Ints) -> float:
    total = np.bincount(labels + 1, weights=area)
    visible = np.minimum(np.bincount(labels + 1, weights=seen), total)
    weight = np.sqrt(total)
    return float((weight * visible / np.maximum(total, 1e-30)).sum() / max(weight.sum(), 1e-30))


def _nearest(
    scene: Scene, camera: Camera, size: tuple[int, int], factor: int
) -> tuple[Floats, NDArray[np.float32], NDArray[np.int32]]:
    """Return projected points (n, 3), depth and nearest triangle of each subpixel."""
    width, height = size
    corners = camera.project(scene.points) * factor
    depth = np.full((height * factor, width * factor), -np.inf, dtype=np.float32)
    owner = np.full(depth.shape, -1, dtype=np.int32)
    fill_triangles(corners, scene.triangles, depth, owner)
    return corners, depth, owner


def _unit_lights(lights: tuple[tuple[float, ...], ...]) -> Floats:
    array = np.array(lights)
    length = np.linalg.norm(array[:, :3], axis=1, keepdims=True)
    array[:, :3] /= np.where(length > 0, length, 1.0)
    return array
