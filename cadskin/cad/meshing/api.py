"""`mesh_shape`: a labelled quality mesh of a shape, by one of three backends."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np

from cadskin._typing import Floats, Progress
from cadskin.cad.meshing.build import Part, build, read_part, slack
from cadskin.cad.meshing.check import Faults, find_faults
from cadskin.cad.meshing.exact import box_diagonal
from cadskin.cad.meshing.result import LabelledMesh
from cadskin.cad.meshing.wedges import face_wedges
from cadskin.errors import GeometryError, MeshingError

__all__ = ["mesh_shape"]

Backend = Literal["cadskin", "gmsh", "pymeshlab"]
TRIANGLE = math.sqrt(3.0) / 4.0  # area of the equilateral triangle of side 1
GAP = 0.02  # of the edge length: a tolerance of the file worth telling
CLOSE_ENOUGH = 0.1  # of the wanted number of points
FLATTEST = -0.25  # slope of log N over log h below which a larger edge length helps no more


def mesh_shape(
    shape: Any,
    *,
    edge_length: float | None = None,
    n_points: int | None = None,
    face_edge_lengths: Mapping[int, float] | None = None,
    backend: Backend = "cadskin",
    max_triangles: int = 5_000_000,
    time_limit: float | None = None,
    progress: Progress | None = None,
    allow_open: bool = False,
) -> LabelledMesh:
    """Mesh a shape with triangles of one edge length that know their face.

    Parameters
    ----------
    shape : TopoDS_Shape
        A solid, shell or face, in millimetres.
    edge_length : float, optional
        Wanted edge length [mm]; small radii are resolved finer. Without it and ``n_points`` it is the
        diagonal of the bounding box over 60.
    n_points : int, optional
        Wanted number of points instead, met within 10 % where the shape allows it.
    face_edge_lengths : mapping of int to float, optional
        Other edge lengths [mm] for some faces.
    backend : {"cadskin", "gmsh", "pymeshlab"}
    max_triangles : int
        Refuse to make more.
    time_limit : float, optional
        Give up after so many seconds.
    progress : callable, optional
        Called with (faces done, faces) per pass; returning False stops.
    allow_open : bool
        Return the mesh of a solid although it is not closed.

    Returns
    -------
    LabelledMesh

    Raises
    ------
    GeometryError
        An edge length that is not positive and finite or exceeds the part; a shape without faces.
    MeshingError
        Too many triangles, out of time, or a solid whose mesh does not close (names the faces).
    MissingDependencyError
        The backend is not installed.

    Examples
    --------
    >>> import cadquery as cq
    >>> mesh = mesh_shape(cq.Workplane().box(10, 10, 10).val().wrapped, edge_length=2.0)
    >>> mesh.closed, len(np.unique(mesh.face_ids))
    (True, 6)
    """
    if backend not in get_args(Backend):
        raise GeometryError(f"backend {backend!r} is not known; use {', '.join(get_args(Backend))}")
    deadline = None if time_limit is None else time.monotonic() + time_limit
    if shape is None or shape.IsNull():
        raise GeometryError("the shape is empty: there is nothing to mesh")
    diagonal = box_diagonal(shape)
    if not diagonal > 0:
        raise GeometryError("the shape has no faces or no extent: there is nothing to mesh")
    edge_length = _edge_length(edge_length, n_points, diagonal)
    faces_too = _face_lengths(face_edge_lengths, diagonal)
    part = read_part(shape)
    if not part.surfaces:
        raise GeometryError("the shape has no faces: there is nothing to mesh")
    unknown = sorted(set(faces_too) - set(range(len(part.surfaces))))
    if unknown:
        raise GeometryError(f"face_edge_lengths names face {unknown[0]}, the shape has {len(part.surfaces)}")

    def make(length: float) -> LabelledMesh:
        lengths = _lengths_of_faces(part, length, faces_too)
        _refuse_too_many(part, lengths, max_triangles)
        if backend == "gmsh":
            from cadskin.cad.meshing.gmsh_backend import mesh_with_gmsh

            return mesh_with_gmsh(shape, part, length, faces_too, time_limit=_left(deadline))
        mesh = _mesh_part(part, lengths, deadline, progress)
        if backend == "pymeshlab":
            from cadskin.cad.meshing.pymeshlab_backend import mesh_with_pymeshlab

            return mesh_with_pymeshlab(part, mesh, length)
        return mesh

    if n_points is None:
        mesh = make(float(edge_length))
    else:
        mesh = _mesh_with_points(make, float(part.areas.sum()), n_points, diagonal)
    _refuse_open(mesh, part, allow_open)
    return mesh


def _left(deadline: float | None) -> float | None:
    return None if deadline is None else deadline - time.monotonic()


def _positive(length: float, name: str, diagonal: float) -> float:
    value = float(length)
    if not (math.isfinite(value) and value > 0):
        raise GeometryError(f"{name} must be positive and finite, got {length}")
    if value > diagonal:
        raise GeometryError(
            f"{name} {value:g} mm is larger than the part, whose diagonal is {diagonal:.4g} mm"
        )
    return value


def _edge_length(edge_length: float | None, n_points: int | None, diagonal: float) -> float:
    if n_points is not None:
        if edge_length is not None:
            raise GeometryError("give edge_length or n_points, not both")
        if n_points < 4:
            raise GeometryError(f"n_points must be at least 4, got {n_points}")
    return diagonal / 60.0 if edge_length is None else _positive(edge_length, "edge_length", diagonal)


def _face_lengths(lengths: Mapping[int, float] | None, diagonal: float) -> dict[int, float]:
    return {
        int(face): _positive(length, f"edge length of face {face}", diagonal)
        for face, length in (lengths or {}).items()
    }


def _lengths_of_faces(part: Part, edge_length: float, special: Mapping[int, float]) -> Floats:
    lengths = np.full(len(part.surfaces), edge_length)
    for face, length in special.items():
        lengths[face] = length
    return lengths


def _refuse_too_many(part: Part, lengths: Floats, max_triangles: int) -> None:
    estimate = float((part.areas / (TRIANGLE * lengths**2)).sum())
    if estimate > max_triangles:
        raise MeshingError(
            f"about {estimate:.3g} triangles would come, more than {max_triangles:,}; use a larger edge "
            "length, or --force (max_triangles in Python)"
        )


def _mesh_with_points(
    make: Callable[[float], LabelledMesh], area: float, n_points: int, diagonal: float
) -> LabelledMesh:
    """Find the edge length that gives a number of points by secants of log N over log h.

    N grows with 1 / h² on large faces, hardly where small radii set the size: the slope is measured.
    """
    length = min(math.sqrt(area / (2.0 * TRIANGLE * n_points)), diagonal)
    slope, best, before = -2.0, None, None
    for _ in range(8):
        mesh = make(length)
        excess = math.log(len(mesh.points) / n_points)
        if best is None or abs(excess) < best[0]:
            best = (abs(excess), mesh)
        if abs(excess) <= 0.3 * CLOSE_ENOUGH:
            break
        if before is not None and length != before[0]:
            slope = (excess - before[1]) / math.log(length / before[0])
        if slope > FLATTEST:
            break
        before = (length, excess)
        length = min(length * math.exp(float(np.clip(-excess / max(slope, -2.2), -1.0, 1.0))), diagonal)
        if length == before[0]:
            break
    assert best is not None
    off, mesh = best
    if off <= CLOSE_ENOUGH:
        return mesh
    note = f"{len(mesh.points)} points instead of {n_points}: the shape's small features set the number"
    return replace(mesh, notes=(*mesh.notes, note))


def _mesh_part(
    part: Part, lengths: Floats, deadline: float | None, progress: Progress | None
) -> LabelledMesh:
    assembly, meshes, notes = build(part, lengths, deadline=deadline, progress=progress)
    wedges = face_wedges(assembly, meshes)
    found = find_faults(assembly.points, assembly.triangles, assembly.face_ids)
    topology = part.topology
    failed = {mesh.index for mesh in meshes if mesh.problem is not None}
    failed |= set(range(len(part.surfaces))) - {mesh.index for mesh in meshes} - set(topology.skipped)
    notes = [*notes, *_notes_of(part, lengths, meshes, found)]
    return LabelledMesh(
        points=assembly.points,
        triangles=assembly.triangles,
        face_ids=assembly.face_ids,
        wedge_faces=wedges.faces,
        wedge_vertices=wedges.vertices,
        wedge_uv=wedges.uv,
        wedge_normals=wedges.normals,
        wedge_curvatures=wedges.curvatures,
        wedge_directions=wedges.directions,
        wedge_singular=wedges.singular,
        closed=found.closed,
        failed_faces=tuple(sorted(failed)),
        notes=tuple(notes),
    )


def _notes_of(part: Part, lengths: Floats, meshes: Any, found: Faults) -> list[str]:
    notes = [
        f"face {mesh.index}: {mesh.domain.reprojected} boundary points projected onto the surface, its "
        "parameter curves disagree with its edges"
        for mesh in meshes
        if mesh.domain.reprojected
    ]
    notes += [f"face {face}: bounds no material, left out" for face in sorted(part.topology.skipped)]
    notes += [
        f"edge {edge}: its curve misses its vertices by up to {curve.tolerance:.3g} mm"
        for edge, curve in enumerate(part.curves)
        if curve.tolerance > GAP * float(lengths.min())
    ]
    if part.topology.ignored_edges:
        notes.append(f"{part.topology.ignored_edges} edges inside faces bound nothing and were left out")
    notes += [
        f"face {mesh.index}: some triangles turn away from the surface normal"
        for mesh in meshes
        if mesh.folded_edges
    ]
    for mesh in meshes:
        exact = float(part.areas[mesh.index])
        allowed = 0.02 * exact * slack(part, float(lengths[mesh.index])) ** 1.5 + part.blur[mesh.index]
        if exact > 0 and abs(mesh.area - exact) > allowed:
            notes.append(
                f"face {mesh.index}: area of the triangles {mesh.area:.4g} mm², exact {exact:.4g} mm²"
            )
    if not found.manifold:
        notes.append(
            f"faces {_listed(found.bad_faces)}: {found.crowded_edges} half-edges shared by more than two "
            f"triangles, {found.pinched_vertices} pinched vertices"
        )
    return notes


def _refuse_open(mesh: LabelledMesh, part: Part, allow_open: bool) -> None:
    if mesh.closed or allow_open:
        return
    found = find_faults(mesh.points, mesh.triangles, mesh.face_ids)
    if not part.topology.is_solid and found.manifold:
        return
    faces = sorted({*found.open_faces, *found.bad_faces, *mesh.failed_faces})
    raise MeshingError(
        f"the mesh does not close at faces {_listed(faces)}: {found.open_edges} open edges, "
        f"{found.crowded_edges} crowded half-edges, {found.pinched_vertices} pinched vertices; try another "
        "edge length, another backend, or heal the shape (allow_open=True returns it as it is)"
    )


def _listed(faces: Any) -> str:
    text = ", ".join(str(face) for face in list(faces)[:8])
    return f"{text}, ... ({len(faces)})" if len(faces) > 8 else text
