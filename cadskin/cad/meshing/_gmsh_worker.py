"""Child process that runs gmsh: a BREP file and options in, arrays out. Knows nothing of the package.

Usage: ``python -P _gmsh_worker.py part.brep options.json mesh.npz``. It is a script of its own because gmsh
can run for ever on bad geometry and cannot be interrupted, and because it brings its own geometry kernel.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import gmsh
import numpy as np


def set_sizes(options: dict[str, Any], tags: list[int]) -> None:
    """Set the edge length of the part and of single faces."""
    length = float(options["edge_length"])
    shortest = min([length, *map(float, options["face_edge_lengths"].values())])
    for name, value in (
        ("General.Terminal", 0),
        ("Mesh.Algorithm", options["algorithm"]),
        ("Mesh.MeshSizeMax", length),
        ("Mesh.MeshSizeMin", shortest / 8.0),
        ("Mesh.MeshSizeFromCurvature", options["per_turn"]),
        ("Mesh.MeshSizeExtendFromBoundary", 1),
    ):
        gmsh.option.setNumber(name, float(value))
    fields = []
    for face, face_length in options["face_edge_lengths"].items():
        field = gmsh.model.mesh.field.add("Constant")
        gmsh.model.mesh.field.setNumber(field, "VIn", float(face_length))
        gmsh.model.mesh.field.setNumber(field, "VOut", length)
        gmsh.model.mesh.field.setNumbers(field, "SurfacesList", [tags[int(face)]])
        fields.append(field)
    if fields:
        smallest = gmsh.model.mesh.field.add("Min")
        gmsh.model.mesh.field.setNumbers(smallest, "FieldsList", fields)
        gmsh.model.mesh.field.setAsBackgroundMesh(smallest)


def collect(tags: list[int]) -> dict[str, Any]:
    """Gather points, triangles, labels, and for each (face, node) pair the surface parameters."""
    node_tags, coordinates, _ = gmsh.model.mesh.getNodes()
    row_of = np.full(int(node_tags.max()) + 1, -1, dtype=np.int64)
    row_of[node_tags.astype(np.int64)] = np.arange(len(node_tags))
    triangles, labels, pairs, parameters = [], [], [], []
    for face, tag in enumerate(tags):
        _, nodes = gmsh.model.mesh.getElementsByType(2, tag)
        corners = row_of[nodes.astype(np.int64)].reshape(-1, 3)
        triangles.append(corners)
        labels.append(np.full(len(corners), face))
        own, _, uv = gmsh.model.mesh.getNodes(2, tag, includeBoundary=True, returnParametricCoord=True)
        pairs.append(np.stack([np.full(len(own), face), row_of[own.astype(np.int64)]], axis=1))
        parameters.append(uv.reshape(-1, 2))
    return {
        "points": coordinates.reshape(-1, 3),
        "triangles": np.concatenate(triangles),
        "face_ids": np.concatenate(labels),
        "pairs": np.concatenate(pairs),
        "uv": np.concatenate(parameters),
    }


def main(brep: str, options_file: str, target: str) -> None:
    """Mesh a BREP file."""
    with open(options_file, encoding="utf-8") as stream:
        options = json.load(stream)
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.importShapes(brep)
        gmsh.model.occ.synchronize()
        tags = sorted(tag for _, tag in gmsh.model.getEntities(2))
        set_sizes(options, tags)
        gmsh.model.mesh.generate(2)
        np.savez(target, **collect(tags))
    finally:
        gmsh.finalize()


if __name__ == "__main__":
    main(*sys.argv[1:4])
