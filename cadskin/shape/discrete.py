"""The discrete shape: points, triangles and the B-rep face each triangle belongs to."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cadskin._arrays import frozen
from cadskin._typing import Floats, Ints, Points, Triangles, Vectors
from cadskin.errors import GeometryError

__all__ = ["DiscreteShape", "triangle_normals", "vertex_normals"]


@dataclass(frozen=True, eq=False)
class DiscreteShape:
    """A triangulated surface whose triangles know their B-rep face.

    For a solid it is closed, 2-manifold and oriented outward (`cadskin.shape.check` proves it).

    Parameters
    ----------
    points : (n, 3) float
        Vertices [mm].
    triangles : (m, 3) int
        Vertex indices, counter-clockwise seen from outside.
    face_ids : (m,) int
        Zero-based index of the B-rep face of each triangle, in the order of cadquery's ``.Faces()``.

    Raises
    ------
    GeometryError
        Wrong shapes, NaN, or an index out of range.

    Examples
    --------
    >>> tet = DiscreteShape([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    ...                     [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], [0, 1, 2, 3])
    >>> round(tet.volume * 6, 12)
    1.0
    """

    points: Points
    triangles: Triangles
    face_ids: Ints

    def __post_init__(self) -> None:
        """Check and freeze the arrays."""
        object.__setattr__(self, "points", frozen(self.points, shape=(None, 3), name="points"))
        object.__setattr__(
            self, "triangles", frozen(self.triangles, dtype=np.int64, shape=(None, 3), name="triangles")
        )
        object.__setattr__(
            self,
            "face_ids",
            frozen(self.face_ids, dtype=np.int64, shape=(len(self.triangles),), name="face_ids"),
        )
        if self.triangles.size and (
            self.triangles.min() < 0 or int(self.triangles.max()) >= len(self.points)
        ):
            raise GeometryError("triangles refer to a vertex that does not exist")

    def __repr__(self) -> str:
        return f"DiscreteShape({self.n_points} points, {self.n_triangles} triangles)"

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.points, self.triangles, self.face_ids)

    @property
    def n_points(self) -> int:
        """Number of vertices."""
        return len(self.points)

    @property
    def n_triangles(self) -> int:
        """Number of triangles."""
        return len(self.triangles)

    @cached_property
    def diagonal(self) -> float:
        """Diagonal of the bounding box [mm]."""
        if not len(self.points):
            return 0.0
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @cached_property
    def triangle_areas(self) -> Floats:
        """Area of each triangle (m,) [mm²]."""
        normals = triangle_normals(self.points, self.triangles, unit=False)
        return frozen(0.5 * np.linalg.norm(normals, axis=1))

    @cached_property
    def area(self) -> float:
        """Total area [mm²]."""
        return float(self.triangle_areas.sum())

    @cached_property
    def volume(self) -> float:
        """Signed enclosed volume [mm³]; positive when the triangles are oriented outward."""
        if not len(self.triangles):
            return 0.0
        corners = self.points[self.triangles] - self.points.mean(axis=0)
        return float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0)

    @cached_property
    def edges(self) -> Ints:
        """Undirected edges (e, 2), each once, the smaller index first."""
        sides = np.sort(self.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        keys = np.unique(sides[:, 0] * np.int64(max(self.n_points, 1)) + sides[:, 1])
        return frozen(np.stack(np.divmod(keys, max(self.n_points, 1)), axis=1), dtype=np.int64)

    def with_points(self, points: Points) -> DiscreteShape:
        """Return a copy with other vertex positions (n, 3) [mm], the same triangles and labels."""
        return DiscreteShape(points, self.triangles, self.face_ids)


def triangle_normals(points: Points, triangles: Triangles, *, unit: bool = True) -> Vectors:
    """Return the normals of triangles.

    Parameters
    ----------
    points : (n, 3) float
    triangles : (m, 3) int
    unit : bool
        False keeps the length, twice the area of the triangle.

    Returns
    -------
    (m, 3) float
        A triangle without area has a zero normal.
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    if unit:
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = normals / np.where(length > 0, length, 1.0)
    return normals


def vertex_normals(points: Points, triangles: Triangles) -> Vectors:
    """Return area-weighted unit normals at the vertices (n, 3)."""
    weighted = triangle_normals(points, triangles, unit=False)
    normals = np.stack(
        [
            np.bincount(triangles.ravel(), weights=np.repeat(weighted[:, k], 3), minlength=len(points))
            for k in range(3)
        ],
        axis=1,
    )
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / np.where(length > 0, length, 1.0), dtype=np.float64)
