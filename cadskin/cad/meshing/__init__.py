"""Labelled quality meshes of B-rep shapes.

By chapter: `topology` and `edges` read a shape and sample its edges once; `domain` makes the polygon of a
face in its parameter plane, `lattice` the points to start from, `kernel` remeshes in the metric of the
surface, `face` puts that together; `build` runs over all faces and refines; `assemble`, `repair`, `wedges`
and `check` make and prove the whole mesh. `gmsh_backend` and `pymeshlab_backend` are other ways to it.
"""

from cadskin.cad.meshing.api import mesh_shape
from cadskin.cad.meshing.result import LabelledMesh

__all__ = ["LabelledMesh", "mesh_shape"]
