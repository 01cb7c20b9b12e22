"""From a shape to what is drawn: moved points, colours per wedge, edge lines."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cadskin._typing import Floats, Ints, Points, Triangles, Vectors
from cadskin.export.colours import colormap_table, feature_colours
from cadskin.export.content import Content
from cadskin.export.wedges import Wedges, wedge_normals, wedges_of
from cadskin.view.raster import EDGE_SHARP, EDGE_SMOOTH

__all__ = ["Scene", "automatic_exaggeration", "scene_of"]

_SHARP_ANGLE = np.deg2rad(12.0)
_GREATEST_SHIFT = 0.012  # of the diagonal of the part
_GREATEST_SLOPE = 0.30  # of the drawn surface against the ideal one
_GREATEST_CURL = 0.30  # of the smallest radius of curvature
_GREATEST_WIDTH = 0.40  # of the mean width of a feature
_LEAST_WIDTH = 0.01  # of the diagonal
_UNKNOWN = 0.62  # grey level of what has no value
_STEPS = np.array([1.0, 2.0, 5.0])


@dataclass(frozen=True, eq=False)
class Scene:
    """What a renderer needs; the arrays are those of `cadskin.export.wedges.Wedges`.

    Parameters
    ----------
    points : (n, 3) float
        Drawn vertices [mm], displacement exaggerated.
    triangles : (m, 3) int
    rows : (m, 3) int
        Wedge of each corner.
    normals : (r, 3) float
    place : (r,) float
        Position in the colour table, 0 to 1.
    table : (k, 3) float
        sRGB in 0..1.
    edges : (e, 2) int
        Lines between vertices.
    edge_codes : (e,) int
        ``EDGE_SHARP`` or ``EDGE_SMOOTH``.
    labels : (m,) int
        Feature, or B-rep face, of each triangle.
    """

    points: Points
    triangles: Triangles
    rows: Triangles
    normals: Vectors
    place: Floats
    table: Floats
    edges: Ints
    edge_codes: Ints
    labels: Ints


def scene_of(
    content: Content,
    *,
    exaggeration: float = 1.0,
    low: float = 0.0,
    high: float = 1.0,
    table: Floats | None = None,
) -> Scene:
    """Return the scene of a shape.

    Parameters
    ----------
    content : Content
    exaggeration : float
        Factor on the displacement of a skin model.
    low, high : float
        Deviations [mm] at the ends of the colour table; a shape without deviation has a colour per feature.
    table : (k, 3) float
        sRGB colours of deviations, by default those of ``blue-red``.
    """
    wedges = wedges_of(content)
    points = content.points
    table = colormap_table() if table is None else table
    if content.nominal is not None and wedges.deviation is not None:
        ideal = content.nominal.surface.points
        points = ideal + exaggeration * (content.points - ideal)
    if wedges.deviation is not None:
        place = (wedges.deviation - low) / (high - low)
    else:
        row_labels = _label_of_row(content, wedges)
        count = int(row_labels.max(initial=0)) + 1
        table = feature_colours(count)
        place = row_labels / max(count - 1, 1)
    normals = wedge_normals(content, wedges, points)
    labels = content.surface.face_ids if content.feature_ids is None else content.feature_ids
    edges, codes = _edge_lines(content, wedges, normals, labels)
    scene = Scene(points, content.triangles, wedges.corners, normals, place, table, edges, codes, labels)
    return scene if np.isfinite(place).all() else _with_grey(scene)


def _with_grey(scene: Scene) -> Scene:
    """Give triangles with an unknown corner rows of their own, in a grey behind the end of the table."""
    unknown = ~np.isfinite(scene.place[scene.rows]).all(axis=1)
    own, inverse = np.unique(scene.rows[unknown], return_inverse=True)
    rows = scene.rows.copy()
    rows[unknown] = len(scene.place) + inverse.reshape(-1, 3)
    size = len(scene.table)
    known = np.clip(np.nan_to_num(scene.place), 0.0, 1.0) * (size - 1) / (2 * size - 1)
    return replace(
        scene,
        rows=rows,
        normals=np.concatenate([scene.normals, scene.normals[own]]),
        place=np.concatenate([known, np.ones(len(own))]),
        table=np.concatenate([scene.table, np.full((size, 3), _UNKNOWN)]),
    )


def automatic_exaggeration(content: Content) -> float:
    """Return a factor 1, 2, 5, 10, ... that shows the displacement and folds nothing.

    The drawn shift stays below 1.2 % of the part's diagonal, below 0.3 of the radius of curvature and below
    0.4 of the width of its feature, the drawn slope between neighbours below 0.3. One percent of the points
    may break the rule, and so may features narrower than 1 % of the diagonal, which are hardly seen.
    """
    if content.nominal is None or content.deviation is None or content.feature_ids is None:
        return 1.0
    deviation = np.nan_to_num(content.deviation)
    size = np.abs(deviation)
    if size.max(initial=0.0) == 0.0:
        return 1.0
    samples = content.nominal.samples
    sides = content.nominal.corner_samples[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    ideal = content.nominal.surface.points[samples.vertex_ids]
    length = np.linalg.norm(ideal[sides[:, 0]] - ideal[sides[:, 1]], axis=1)
    rise = np.abs(deviation[sides[:, 0]] - deviation[sides[:, 1]])
    features = content.nominal.features
    typical = np.array([np.quantile(size[f.rows], 0.9) if f.n_points else 0.0 for f in features])
    width = _widths(content, content.feature_ids)
    wide = width > _LEAST_WIDTH * content.nominal.surface.diagonal
    limits = (
        (_GREATEST_SLOPE, np.quantile(rise / np.maximum(length, 1e-12), 0.99)),
        (_GREATEST_CURL, np.quantile(size * np.abs(samples.curvatures).max(axis=1), 0.99)),
        (_GREATEST_SHIFT, np.quantile(size, 0.99) / max(content.nominal.surface.diagonal, 1e-12)),
        (_GREATEST_WIDTH, (typical[: len(width)][wide] / width[wide]).max(initial=0.0)),
    )
    return _round_down(min((most / value for most, value in limits if value > 0), default=1.0))


def _round_down(value: float) -> float:
    """Return the greatest of 1, 2, 5, 10, 20, ... that is not above ``value``, but at least 1."""
    if value < 1.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * _STEPS[_STEPS * power <= value * (1 + 1e-9)].max(initial=1.0))


def _label_of_row(content: Content, wedges: Wedges) -> Ints:
    """Return the feature of each wedge, or its B-rep face where there are no features."""
    if content.nominal is not None:
        return content.nominal.feature_ids()
    labels = np.zeros(len(wedges.vertex_ids), dtype=np.int64)
    labels[wedges.corners] = content.surface.face_ids[:, None]
    return labels


@dataclass(frozen=True, eq=False)
class _Borders:
    """Half-edges 3 t + k (corner k of triangle t to the next) where the label changes or the mesh ends."""

    one_side: Ints
    other_side: Ints
    open_end: Ints


def _borders(triangles: Triangles, labels: Ints) -> _Borders:
    start, stop = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    base = np.int64(triangles.max(initial=0) + 1)
    keys = np.minimum(start, stop) * base + np.maximum(start, stop)
    order = np.argsort(keys, kind="stable")
    paired = np.append(np.diff(keys[order]) == 0, False)
    alone = ~paired & ~np.append(False, paired[:-1])
    label = labels[order // 3]
    first = np.flatnonzero(paired)
    first = first[label[first] != label[first + 1]]
    return _Borders(order[first], order[first + 1], order[np.flatnonzero(alone)])


def _ends(table: Triangles, half_edges: Ints) -> tuple[Ints, Ints]:
    """Return the entries of ``table`` (m, 3) at both ends of half-edges."""
    triangle, corner = np.divmod(half_edges, 3)
    return table[triangle, corner], table[triangle, (corner + 1) % 3]


def _edge_lines(content: Content, wedges: Wedges, normals: Vectors, labels: Ints) -> tuple[Ints, Ints]:
    """Return the mesh edges (e, 2) between features and at open borders, and the code of each.

    An edge is smooth where the normals of its two sides agree within 12 degrees at both ends.
    """
    borders = _borders(content.triangles, labels)
    near_start, near_stop = _ends(wedges.corners, borders.one_side)
    far_stop, far_start = _ends(wedges.corners, borders.other_side)  # runs the other way
    reversed_side = wedges.vertex_ids[near_start] != wedges.vertex_ids[far_start]  # not on an oriented mesh
    far_start, far_stop = (
        np.where(reversed_side, far_stop, far_start),
        np.where(reversed_side, far_start, far_stop),
    )
    cosine = np.minimum(
        np.einsum("ij,ij->i", normals[near_start], normals[far_start]),
        np.einsum("ij,ij->i", normals[near_stop], normals[far_stop]),
    )
    codes = np.where(cosine < np.cos(_SHARP_ANGLE), EDGE_SHARP, EDGE_SMOOTH)
    lines = np.concatenate([borders.one_side, borders.open_end])
    edges = np.stack(_ends(content.triangles, lines), axis=1)
    return edges, np.concatenate([codes, np.full(len(borders.open_end), EDGE_SHARP)])


def _widths(content: Content, labels: Ints) -> Floats:
    """Return the mean width of each feature [mm]: twice its area over the length of its border."""
    borders = _borders(content.triangles, labels)
    half_edges = np.concatenate([borders.one_side, borders.other_side, borders.open_end])
    points = content.points if content.nominal is None else content.nominal.surface.points
    start, stop = _ends(content.triangles, half_edges)
    length = np.linalg.norm(points[start] - points[stop], axis=1)
    count = int(labels.max(initial=0)) + 1
    border = np.bincount(labels[half_edges // 3], weights=length, minlength=count)
    area = np.bincount(labels, weights=content.surface.triangle_areas, minlength=count)
    return 2 * area / np.where(border > 0, border, np.inf) + np.where(border > 0, 0.0, np.sqrt(area))
