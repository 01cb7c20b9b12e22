"""Extraction (ISO 17450-1): points of features on a made part, and sections of them.

A made part is a mesh whose triangles know their B-rep face: a skin model, or any mesh with face labels in the
place of the nominal model. Values are those of the extracted points: vertices, and points interpolated on
mesh edges between them (in the cylinder coordinates of the feature, so that no chord cuts into a round
surface).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import AssociationError, SelectionError
from cadskin.shape.association import Pose, frame_about
from cadskin.shape.association._kernels import PLANE
from cadskin.verify.median import split_sections
from cadskin.verify.part_geometry import Memory, PartGeometry, edges_of
from cadskin.verify.part_patches import WORLD, nominal_patch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin._typing import Floats, Ints, Points, Vectors
    from cadskin.shape import DiscreteShape, Feature, NominalModel

__all__ = ["MadePart", "axial_sections", "meridian_sections", "ring_sections"]


@dataclass(frozen=True, eq=False)
class MadePart:
    """A made part: its surface, labelled by face, and its nominal model.

    Parameters
    ----------
    surface : DiscreteShape
        The mesh of the part as made, in the coordinates of the nominal model.
    nominal : NominalModel
    shared : PartGeometry, optional
        What follows from the nominal model, where other made parts of it know that already.
    memory : Memory
        Associations of the same points, which several tolerances ask for.
    thinned : (frozenset of int, (k,) int), optional
        Of the features with these ids only these vertices are extracted.
    """

    surface: DiscreteShape
    nominal: NominalModel
    shared: PartGeometry | None = None
    memory: Memory = field(default_factory=Memory)
    thinned: tuple[frozenset[int], Ints] | None = None

    @cached_property
    def geometry(self) -> PartGeometry:
        """What follows from the nominal model."""
        return PartGeometry(self.nominal) if self.shared is None else self.shared

    @cached_property
    def same_vertices(self) -> bool:
        """Whether the mesh has the vertices of the nominal mesh (a skin model)."""
        made, nominal = self.surface, self.nominal.surface
        return made.n_points == nominal.n_points and (
            made.triangles is nominal.triangles or np.array_equal(made.triangles, nominal.triangles)
        )

    def features(self, faces: Sequence[int]) -> tuple[Feature, ...]:
        """Return the features of B-rep faces, each once."""
        return self.geometry.features(faces)

    def vertex_ids(self, faces: Sequence[int]) -> Ints:
        """Return the vertices (k,) of the features of faces.

        Raises
        ------
        SelectionError
            The mesh has no triangle of them.
        """
        found = self.geometry.vertex_ids(faces) if self.same_vertices else np.unique(self.triangles(faces))
        if self.thinned is None or not {one.id for one in self.features(faces)} <= self.thinned[0]:
            return found
        return np.intersect1d(found, self.thinned[1])

    def triangles(self, faces: Sequence[int]) -> Ints:
        """Return the triangles (t, 3) of the features of faces."""
        if self.same_vertices:
            return self.geometry.triangles(faces)
        indices = self.geometry.indices(faces)
        chosen = self.surface.triangles[np.isin(self.surface.face_ids, indices)]
        if not len(chosen):
            raise SelectionError(f"the mesh has no triangle with the labels {list(indices)}")
        return chosen

    def points(self, faces: Sequence[int]) -> Points:
        """Return the extracted points (k, 3) of faces [mm]."""
        return np.ascontiguousarray(self.surface.points[self.vertex_ids(faces)])

    def nominal_points(self, faces: Sequence[int]) -> Points:
        """Return the nominal points (m, 3) of faces [mm]."""
        return np.ascontiguousarray(self.nominal.surface.points[self.geometry.vertex_ids(faces)])

    def edges(self, faces: Sequence[int]) -> Ints:
        """Return the mesh edges (e, 2) of faces, each once."""
        return self.geometry.edges(faces) if self.same_vertices else edges_of(self.triangles(faces))


def axial_sections(part: MadePart, faces: Sequence[int], pose: Pose, count: int) -> list[Points]:
    """Return sections of a round feature across its axis.

    Parameters
    ----------
    part : MadePart
    faces : sequence of int
    pose : Pose
        Frame of the associated feature; its third axis is the axis.
    count : int
        Number of sections, evenly spaced over the inner 90 % of the length.

    Returns
    -------
    list of (k, 3) float
        Points where mesh edges cross the sections, on the surface between their ends in cylinder coordinates.

    Raises
    ------
    AssociationError
        No section holds three points.
    """
    local, features = pose.local(part.surface.points), part.features(faces)
    heights, sections = local[:, 2], []
    for feature in features:  # pieces of an interrupted feature share the sections
        edges = part.edges(feature.face_indices)
        used = heights[np.unique(edges)]
        if (edges[:, 0] == edges[:, 1]).all():  # a cloud: the sections it was measured in
            cloud = part.surface.points[np.unique(edges)]
            sections += [ring for ring in split_sections(cloud, pose.axis) if len(ring) >= 3]
            continue
        low, high = float(used.min()), float(used.max())
        levels = low + (high - low) * np.linspace(0.05, 0.95, -(-count // len(features)))
        for level in levels:
            rows, fraction = _crossings(heights, edges, float(level))
            angle, radius = _polar(local, edges[rows], fraction)
            ring = np.column_stack(
                [radius * np.cos(angle), radius * np.sin(angle), np.full(len(angle), level)]
            )
            if len(ring) >= 3:
                sections.append(pose.origin + ring @ pose.axes.T)
    if not sections:
        raise AssociationError("no section of the feature holds three points; mesh it finer")
    return sections


def ring_sections(part: MadePart, faces: Sequence[int], pose: Pose, count: int) -> list[Points]:
    """Return circles of a face across an axis: where its mesh edges cross cylinders about the axis."""
    local = pose.local(part.surface.points)
    edges = part.edges(faces)
    radii = np.linalg.norm(local[:, :2], axis=1)
    used = radii[np.unique(edges)]
    levels = float(used.min()) + float(np.ptp(used)) * np.linspace(0.1, 0.95, count)
    rings = []
    for level in levels:
        rows, fraction = _crossings(radii, edges, float(level))
        ends = local[edges[rows]]
        crossing = ends[:, 0] + fraction[:, None] * (ends[:, 1] - ends[:, 0])
        if len(crossing) >= 3:
            rings.append(pose.origin + crossing @ pose.axes.T)
    if not rings:
        raise AssociationError("no circle of the face holds three points; mesh it finer")
    return rings


def meridian_sections(
    part: MadePart, faces: Sequence[int], pose: Pose, count: int
) -> list[tuple[Points, Vectors]]:
    """Return surface lines of a round feature along its axis, each with the normal of its section plane."""
    local = pose.local(part.surface.points)
    edges = part.edges(faces)
    lines = []
    for turn in np.pi * np.arange(count) / count:
        side = -local[:, 0] * np.sin(turn) + local[:, 1] * np.cos(turn)
        ahead = local[:, 0] * np.cos(turn) + local[:, 1] * np.sin(turn)
        rows, fraction = _crossings(side, edges, 0.0)
        _, radius = _polar(local, edges[rows], fraction)
        height = _between(local[:, 2], edges[rows], fraction)
        sign = np.sign(_between(ahead, edges[rows], fraction))
        normal = pose.axes @ np.array([-np.sin(turn), np.cos(turn), 0.0])
        outward = pose.axes @ np.array([np.cos(turn), np.sin(turn), 0.0])
        for half in (1.0, -1.0):
            chosen = sign == half
            if chosen.sum() >= 3:
                place = (
                    pose.origin
                    + np.outer(half * radius[chosen], outward)
                    + np.outer(height[chosen], pose.axis)
                )
                lines.append((place, normal))
    if not lines:
        raise AssociationError("no surface line of the feature holds three points; mesh it finer")
    return lines


def plane_lines(
    part: MadePart, faces: Sequence[int], pose: Pose, direction: Vectors, count: int
) -> list[tuple[Points, Vectors]]:
    """Return lines of a plane along ``direction``, each with the normal of its section plane."""
    axes = frame_about(pose.axis, direction)
    local = (part.surface.points - pose.origin) @ axes
    edges = part.edges(faces)
    used = local[np.unique(edges), 1]
    levels = float(used.min()) + float(np.ptp(used)) * np.linspace(0.05, 0.95, count)
    lines = []
    for level in levels:
        rows, fraction = _crossings(local[:, 1], edges, float(level))
        ends = part.surface.points[edges[rows]]
        crossing = ends[:, 0] + fraction[:, None] * (ends[:, 1] - ends[:, 0])
        if len(crossing) >= 3:
            lines.append((crossing, np.ascontiguousarray(axes[:, 1])))
    if not lines:
        raise AssociationError("no line of the plane holds three points; mesh it finer")
    return lines


def plane_cuts(
    part: MadePart, faces: Sequence[int], normal: Vectors, count: int, *, feature: Feature | None = None
) -> list[tuple[Points, Vectors]]:
    """Return lines of faces in ``count`` section planes across ``normal``, each with that normal.

    Parameters
    ----------
    part : MadePart
    faces : sequence of int
    normal : (3,) float
    count : int
    feature : Feature, optional
        A curved one: points on mesh edges are then lifted from the chord by what the nominal chord lies off
        the nominal surface (a mesh with the vertices of the nominal one only).
    """
    heights, edges = part.surface.points @ normal, part.edges(faces)
    used = heights[np.unique(edges)]
    levels = float(used.min()) + float(np.ptp(used)) * np.linspace(0.05, 0.95, count)
    lines = []
    for level in levels:
        rows, fraction = _crossings(heights, edges, float(level))
        crossing = _along(part.surface.points, edges[rows], fraction)
        if feature is not None and part.same_vertices and len(crossing):
            crossing = crossing + _lift(part, feature, edges[rows], fraction)
        if len(crossing) >= 3:
            lines.append((crossing, np.asarray(normal)))
    if not lines:
        raise AssociationError("no section of the face holds three points; mesh it finer")
    return lines


def _along(points: Points, edges: Ints, fraction: Floats) -> Points:
    ends = points[edges]
    return np.asarray(ends[:, 0] + fraction[:, None] * (ends[:, 1] - ends[:, 0]))


def _lift(part: MadePart, feature: Feature, edges: Ints, fraction: Floats) -> Points:
    """Return what brings places on nominal chords onto the nominal surface (n, 3)."""
    patch = nominal_patch(part, feature, WORLD)
    if patch.kind == PLANE:
        return np.zeros((len(edges), 3))
    distance, normals = patch.rows(
        np.ascontiguousarray(_along(part.nominal.surface.points, edges, fraction)), patch.place
    )
    return np.asarray(-distance[:, None] * (normals @ patch.place.axes.T))


def _crossings(values: Floats, edges: Ints, level: float) -> tuple[Ints, Floats]:
    """Return the edges that cross a level, and where along them (0 to 1)."""
    first, second = values[edges[:, 0]] - level, values[edges[:, 1]] - level
    rows = np.flatnonzero((first < 0) != (second < 0))
    return rows, first[rows] / (first[rows] - second[rows])


def _between(values: Floats, edges: Ints, fraction: Floats) -> Floats:
    return np.asarray(values[edges[:, 0]] * (1 - fraction) + values[edges[:, 1]] * fraction)


def _polar(local: Points, edges: Ints, fraction: Floats) -> tuple[Floats, Floats]:
    """Interpolate angle and radius about the third axis along edges."""
    ends = local[edges]
    angle = np.arctan2(ends[..., 1], ends[..., 0])
    turn = np.mod(angle[:, 1] - angle[:, 0] + np.pi, 2 * np.pi) - np.pi
    radius = np.linalg.norm(ends[..., :2], axis=2)
    return angle[:, 0] + fraction * turn, radius[:, 0] * (1 - fraction) + radius[:, 1] * fraction
