"""What keeps a mesh from being closed, told by B-rep face, and the half-edges that the mesher works with.

`cadskin.shape.check` proves any mesh and lists its faults; here they are counted in linear time, because the
mesher asks after each weld, and belong to faces of the shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cadskin._jit import kernel
from cadskin._typing import Floats, Ints, Points, Triangles
from cadskin.shape.discrete import triangle_normals

__all__ = ["Faults", "face_areas", "find_faults", "half_edge_twins", "mesh_volume"]

BOUNDARY, CROWDED = -1, -2


@dataclass(frozen=True)
class Faults:
    """What is wrong with a mesh, by count.

    Parameters
    ----------
    open_edges : int
        Edges of one triangle.
    crowded_edges : int
        Half-edges on edges of more than two triangles, or of two that run the same way.
    pinched_vertices : int
        Vertices whose triangles form more than one fan.
    open_faces, bad_faces : tuple of int
        Faces with open edges, and with crowded edges or pinched vertices.
    """

    open_edges: int
    crowded_edges: int
    pinched_vertices: int
    open_faces: tuple[int, ...] = ()
    bad_faces: tuple[int, ...] = ()

    @property
    def manifold(self) -> bool:
        """Whether it is a 2-manifold, perhaps with boundary."""
        return self.crowded_edges == 0 and self.pinched_vertices == 0

    @property
    def closed(self) -> bool:
        """Whether it is a closed, consistently oriented 2-manifold."""
        return self.manifold and self.open_edges == 0


@kernel
def half_edge_twins(triangles: Any, n_points: int) -> Any:
    """Return for each half-edge 3 t + i, side (i, i + 1) of t, its opposite; -1 open, -2 crowded.

    Half-edges are gathered by their lower vertex, so that the work is linear.
    """
    m = triangles.shape[0]
    start = np.zeros(n_points + 1, np.int64)
    for t in range(m):
        for i in range(3):
            start[min(triangles[t, i], triangles[t, (i + 1) % 3]) + 1] += 1
    for v in range(n_points):
        start[v + 1] += start[v]
    fill = start[:-1].copy()
    gathered = np.zeros(3 * m, np.int64)
    for t in range(m):
        for i in range(3):
            low = min(triangles[t, i], triangles[t, (i + 1) % 3])
            gathered[fill[low]] = 3 * t + i
            fill[low] += 1
    twin = np.full(3 * m, -1, np.int64)
    for v in range(n_points):
        for x in range(start[v], start[v + 1]):
            h = gathered[x]
            a = triangles[h // 3, h % 3]
            b = triangles[h // 3, (h % 3 + 1) % 3]
            found = 0
            opposite = -1
            for y in range(start[v], start[v + 1]):
                g = gathered[y]
                c = triangles[g // 3, g % 3]
                d = triangles[g // 3, (g % 3 + 1) % 3]
                if g != h and c + d == a + b:  # the lower end is common, so the sums tell
                    found += 1
                    if c == b:
                        opposite = g
            if found == 1 and opposite >= 0:
                twin[h] = opposite
            elif found > 0:
                twin[h] = -2
    return twin


@kernel
def count_fans(triangles: Any, twin: Any, n_points: int, fan_of: Any) -> Any:
    """Return the number of edge-connected fans of triangles at each vertex (0 for an unused one).

    ``fan_of`` (3 m,) receives the number of the fan that each corner belongs to, at its vertex.
    """
    m = triangles.shape[0]
    fans = np.zeros(n_points, np.int64)
    seen = np.zeros(3 * m, np.uint8)
    for h in range(3 * m):  # the corner at the start of half-edge h
        if seen[h]:
            continue
        fan = fans[triangles[h // 3, h % 3]]
        fans[triangles[h // 3, h % 3]] += 1
        g = h
        while g >= 0 and not seen[g]:  # counter-clockwise: across the side that ends in the vertex
            seen[g] = 1
            fan_of[g] = fan
            g = twin[g // 3 * 3 + (g % 3 + 2) % 3]
        g = twin[h]  # and clockwise
        while g >= 0:
            g = g // 3 * 3 + (g % 3 + 1) % 3
            if seen[g]:
                break
            seen[g] = 1
            fan_of[g] = fan
            g = twin[g]
    return fans


def find_faults(points: Points, triangles: Triangles, face_ids: Ints) -> Faults:
    """Count what keeps a mesh from being a closed 2-manifold.

    Examples
    --------
    >>> tet = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> find_faults(np.zeros((4, 3)), tet, np.arange(4)).closed
    True
    """
    twin = half_edge_twins(triangles, len(points))
    fans = count_fans(triangles, twin, len(points), np.zeros(len(twin), np.int64))
    pinched = np.flatnonzero(fans > 1)
    by_triangle = twin.reshape(-1, 3)
    crowded = (by_triangle == CROWDED).any(axis=1)
    if len(pinched):
        crowded |= np.isin(triangles, pinched).any(axis=1)
    open_ = (by_triangle == BOUNDARY).any(axis=1)
    return Faults(
        open_edges=int((twin == BOUNDARY).sum()),
        crowded_edges=int((twin == CROWDED).sum()),
        pinched_vertices=len(pinched),
        open_faces=tuple(np.unique(face_ids[open_]).tolist()),
        bad_faces=tuple(np.unique(face_ids[crowded]).tolist()),
    )


def face_areas(points: Points, triangles: Triangles, face_ids: Ints, n_faces: int) -> Floats:
    """Return the area of the triangles of each face (n_faces,) [mm²]."""
    areas = 0.5 * np.linalg.norm(triangle_normals(points, triangles, unit=False), axis=1)
    return np.asarray(np.bincount(face_ids, weights=areas, minlength=n_faces), dtype=np.float64)


def mesh_volume(points: Points, triangles: Triangles) -> float:
    """Return the signed enclosed volume [mm³], measured about the centre of the points."""
    if not len(triangles):
        return 0.0
    corners = points[triangles] - points.mean(axis=0)
    return float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0)
