"""What holds for the normals and curvatures of every mesh of a shape."""

import numpy as np


def shortest_sides(mesh):
    """Length of the shortest side at each vertex."""
    corners = mesh.points[mesh.triangles]
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    shortest = np.full(len(mesh.points), np.inf)
    np.minimum.at(shortest, mesh.triangles, lengths)
    np.minimum.at(shortest, np.roll(mesh.triangles, -1, axis=1), lengths)
    return shortest


def assert_wedges_agree_with_the_mesh(mesh):
    """Normals on the side of their triangles, curvatures that the mesh can show, where not flagged."""
    key = mesh.wedge_faces * len(mesh.points) + mesh.wedge_vertices
    rows = np.searchsorted(key, mesh.face_ids[:, None] * len(mesh.points) + mesh.triangles)
    a, b, c = (mesh.points[mesh.triangles[:, k]] for k in range(3))
    dots = np.einsum("ni,nki->nk", np.cross(b - a, c - a), mesh.wedge_normals[rows])
    assert (dots > 0)[~mesh.wedge_singular[rows]].all()
    bend = np.abs(mesh.wedge_curvatures).max(axis=1) * shortest_sides(mesh)[mesh.wedge_vertices]
    assert bend[~mesh.wedge_singular].max() <= 10.0
