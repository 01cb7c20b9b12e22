"""Meshing by gmsh, in a child process with a time limit.

gmsh never stops on some bad geometry, so it must be killable; the shape travels as BREP, which keeps order
and units. Frontal-Delaunay (6) is tried first, then Delaunay (5), then MeshAdapt (1).
"""

from __future__ import annotations

import json
import logging
import subprocess
import sys
import time
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from OCP.BRepTools import BRepTools

from cadskin._typing import Floats, Ints, Points, Triangles
from cadskin.cad.meshing.build import Part
from cadskin.cad.meshing.check import face_areas, find_faults
from cadskin.cad.meshing.exact import face_properties
from cadskin.cad.meshing.foreign import ForeignMesh, labelled_from
from cadskin.cad.meshing.result import LabelledMesh
from cadskin.errors import KernelError, MeshingError, MissingDependencyError

__all__ = ["mesh_with_gmsh"]

_log = logging.getLogger(__name__)
ALGORITHMS = {6: "Frontal-Delaunay", 5: "Delaunay", 1: "MeshAdapt"}
PER_TURN = 10  # edges per full turn on small radii
DEFAULT_LIMIT = 600.0


def mesh_with_gmsh(
    shape: Any,
    part: Part,
    edge_length: float,
    face_edge_lengths: Mapping[int, float],
    *,
    time_limit: float | None = None,
) -> LabelledMesh:
    """Mesh a shape with gmsh; the first algorithm whose mesh is a manifold with true labels wins.

    Raises
    ------
    MissingDependencyError
        gmsh is not installed.
    MeshingError
        No algorithm gave a mesh in time; names what each one did.
    """
    if find_spec("gmsh") is None:
        raise MissingDependencyError('the gmsh backend needs gmsh: pip install "cadskin[gmsh]"')
    deadline = time.monotonic() + (DEFAULT_LIMIT if time_limit is None else time_limit)
    failures = []
    with TemporaryDirectory(prefix="cadskin-gmsh-") as folder:
        brep = Path(folder) / "part.brep"
        if not BRepTools.Write_s(shape, str(brep)):
            raise KernelError("the shape could not be written as BREP for gmsh")
        for algorithm, name in ALGORITHMS.items():
            options = {
                "edge_length": edge_length,
                "face_edge_lengths": dict(face_edge_lengths),
                "algorithm": algorithm,
                "per_turn": PER_TURN,
            }
            try:
                mesh = _run(brep, options, deadline - time.monotonic())
                _prove(part, mesh)
            except MeshingError as error:
                _log.info("gmsh %s: %s", name, error)
                failures.append(f"{name}: {error}")
                continue
            note = f"meshed by gmsh, algorithm {name}"
            return labelled_from(part, mesh, [note, *failures])
    raise MeshingError("gmsh could not mesh the shape; " + "; ".join(failures))


def _run(brep: Path, options: Mapping[str, Any], seconds: float) -> ForeignMesh:
    """Run one algorithm in a child process and read its arrays."""
    if seconds <= 0:
        raise MeshingError("no time left")
    settings, target = brep.with_suffix(".json"), brep.with_suffix(".npz")
    settings.write_text(json.dumps(options), encoding="utf-8")
    target.unlink(missing_ok=True)
    worker = Path(__file__).with_name("_gmsh_worker.py")
    command = [sys.executable, "-P", str(worker), str(brep), str(settings), str(target)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=seconds, check=False)
    except subprocess.TimeoutExpired as error:
        raise MeshingError(f"stopped after {seconds:.0f} s") from error
    if done.returncode != 0 or not target.exists():
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        raise MeshingError(last)
    with np.load(target) as arrays:
        return ForeignMesh(
            points=arrays["points"],
            triangles=arrays["triangles"].astype(np.int64),
            face_ids=arrays["face_ids"].astype(np.int64),
            pairs=arrays["pairs"].astype(np.int64),
            uv=arrays["uv"],
        )


def _prove(part: Part, mesh: ForeignMesh) -> None:
    """Check that the mesh is a manifold and that its labels are our faces, by area and centre of area."""
    if not len(mesh.triangles):
        raise MeshingError("no triangles")
    found = find_faults(mesh.points, mesh.triangles, mesh.face_ids)
    if not (found.closed or (found.manifold and not part.topology.is_solid)):
        raise MeshingError(
            f"{found.open_edges} open edges, {found.crowded_edges} crowded half-edges, "
            f"{found.pinched_vertices} pinched vertices"
        )
    exact, centres = face_properties(part.topology.faces)
    areas = face_areas(mesh.points, mesh.triangles, mesh.face_ids, len(exact))
    off = np.linalg.norm(_centres(mesh.points, mesh.triangles, mesh.face_ids, areas) - centres, axis=1)
    wrong = (np.abs(areas - exact) > 0.2 * exact) | (off > 0.2 * np.sqrt(exact))
    wrong[sorted(part.topology.skipped)] = False
    if wrong.any():
        raise MeshingError(f"face {int(np.flatnonzero(wrong)[0])} has another area or centre than in the CAD")


def _centres(points: Points, triangles: Triangles, face_ids: Ints, areas: Floats) -> Points:
    corners = points[triangles]
    weights = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    middles = corners.mean(axis=1) * weights[:, None]
    sums = np.stack([np.bincount(face_ids, middles[:, k], len(areas)) for k in range(3)], axis=1)
    return np.asarray(sums / np.where(areas > 0, areas, 1.0)[:, None])
