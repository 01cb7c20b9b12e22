"""Discrete shapes back into the kernel, so that any OCP viewer or writer takes them."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.BRep import BRep_Builder
from OCP.gp import gp_Pnt
from OCP.Poly import Poly_Triangle, Poly_Triangulation
from OCP.TopoDS import TopoDS_Face, TopoDS_Shell

from cadskin._typing import Points, Triangles
from cadskin.errors import GeometryError
from cadskin.shape.discrete import DiscreteShape

__all__ = ["to_ocp"]


def to_ocp(surface: DiscreteShape) -> Any:
    """Return a ``TopoDS_Shell`` of triangulated faces, one per B-rep face of the discrete shape.

    Parameters
    ----------
    surface : DiscreteShape

    Returns
    -------
    TopoDS_Shell
        Its faces carry triangles and no exact surface; they stand in the order of the face ids.

    Raises
    ------
    GeometryError
        The surface has no triangle.

    Examples
    --------
    >>> tet = DiscreteShape([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    ...                     [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], [0, 1, 2, 2])
    >>> from cadskin.cad._occ import faces_of
    >>> len(faces_of(to_ocp(tet)))
    3
    """
    if not surface.n_triangles:
        raise GeometryError("the surface has no triangles, there is nothing to hand to the kernel")
    builder, shell = BRep_Builder(), TopoDS_Shell()
    builder.MakeShell(shell)
    for index in np.unique(surface.face_ids):
        triangles = surface.triangles[surface.face_ids == index]
        face = TopoDS_Face()
        builder.MakeFace(face, _triangulation(surface.points, triangles))
        builder.Add(shell, face)
    return shell


def _triangulation(points: Points, triangles: Triangles) -> Any:
    used, local = np.unique(triangles, return_inverse=True)
    corners = local.reshape(triangles.shape) + 1
    mesh = Poly_Triangulation(len(used), len(triangles), False)
    for i, (x, y, z) in enumerate(points[used].tolist(), start=1):
        mesh.SetNode(i, gp_Pnt(x, y, z))
    for i, corner in enumerate(corners, start=1):
        mesh.SetTriangle(i, Poly_Triangle(*map(int, corner)))
    return mesh
