"""The meshing loop: sample the edges, mesh the faces, refine where a face asks for it, weld, repair."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cadskin._progress import report
from cadskin._typing import Floats, Progress
from cadskin.cad.meshing.assemble import Assembly, assemble
from cadskin.cad.meshing.check import mesh_volume
from cadskin.cad.meshing.domain import FaceProblem, face_domain
from cadskin.cad.meshing.edges import EdgeCurve, EdgeSamples, read_edge, sample_edge, segments_for
from cadskin.cad.meshing.exact import box_diagonal, face_properties, shape_volume
from cadskin.cad.meshing.face import FaceMesh, mesh_face
from cadskin.cad.meshing.fallback import fill_from_boundary
from cadskin.cad.meshing.repair import crowded_chords, separate_fans, split_chords
from cadskin.cad.meshing.topology import Topology, forward_face, read_topology
from cadskin.cad.surface import FaceSurface, face_surface
from cadskin.errors import MeshingError

__all__ = ["Part", "build", "read_part", "slack"]

MAX_REFINEMENTS = 3  # of the edges of a face that folds or crosses itself
MAX_RESIZES = 3  # of a face whose area is off
MAX_VOLUME_ROUNDS = 2
MAX_WELDS = 8
AREA_TOLERANCE = 0.015  # of a face, at edge lengths up to a hundredth of the diagonal
VOLUME_TOLERANCE = 0.008
MAX_TURN = math.radians(30.0)  # of a curved edge, per segment
COARSEST_TURN = math.radians(60.0)
CURVED = 2.0 / math.sqrt(3.0) * MAX_TURN  # edge length over radius: equilateral on rows one turn apart
FINEST = 1.0 / 16.0  # of the wanted edge length, on small radii
MAX_SMALLEST = 1.0 / 32.0  # of it: how far a face may be refined to hold its area


@dataclass(frozen=True, eq=False)
class Part:
    """A shape, read once for any number of meshes."""

    topology: Topology
    surfaces: tuple[FaceSurface, ...]
    curves: tuple[EdgeCurve, ...]
    forward: tuple[Any, ...]
    areas: Floats
    blur: Floats  # area that the tolerances of a face's edges leave open
    volume: float
    diagonal: float


@dataclass(eq=False)
class _Work:
    """What changes while a part is meshed."""

    part: Part
    base: Floats  # edge length asked for, per face
    target: Floats  # edge length used, per face
    counts: dict[int, int] = field(default_factory=dict)
    samples: list[EdgeSamples | None] = field(default_factory=list)
    meshes: dict[int, FaceMesh] = field(default_factory=dict)
    refined: Counter[int] = field(default_factory=Counter)
    resized: Counter[int] = field(default_factory=Counter)
    problems: dict[int, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def read_part(shape: Any) -> Part:
    """Read topology, surfaces and curves of a shape, its exact areas and volume."""
    topology = read_topology(shape)
    areas, _ = face_properties(topology.faces)
    curves = tuple(
        read_edge(edge, ends, topology.vertices)
        for edge, ends in zip(topology.edges, topology.ends, strict=True)
    )
    blur = [
        sum(curves[use.edge].length * curves[use.edge].tolerance for use in uses) for uses in topology.uses
    ]
    return Part(
        topology,
        tuple(face_surface(face) for face in topology.faces),
        curves,
        tuple(forward_face(face) for face in topology.faces),
        areas,
        np.array(blur),
        shape_volume(shape) if topology.is_solid else 0.0,
        box_diagonal(shape),
    )


def build(
    part: Part,
    edge_lengths: Floats,
    *,
    deadline: float | None = None,
    progress: Progress | None = None,
) -> tuple[Assembly, list[FaceMesh], list[str]]:
    """Mesh a part with a wanted edge length per face.

    Returns
    -------
    assembly : Assembly
    meshes : list of FaceMesh
        In face order; a face that could not be meshed at all is missing.
    notes : list of str

    Raises
    ------
    MeshingError
        The deadline (of ``time.monotonic``) passed.
    Cancelled
        The caller asked to stop.
    """
    work = _Work(part, edge_lengths, _curved_lengths(part, edge_lengths))
    work.samples = [None] * len(part.curves)
    everything = range(len(part.curves))
    for edge in everything:
        work.counts[edge] = _wanted(work, edge)
    _sample(work, everything)
    todo = [face for face in range(len(part.surfaces)) if face not in part.topology.skipped]
    for _ in range(1 + MAX_VOLUME_ROUNDS):
        _mesh_until_good(work, todo, deadline, progress)
        assembly, meshes = _weld(work, deadline, progress)
        todo = _faces_for_volume(work, assembly)
        if not todo:
            break
    assembly, meshes, pinched = separate_fans(assembly, meshes)
    if pinched:
        work.notes.append(f"{pinched} vertices where the shape touches itself were doubled")
    return assembly, meshes, work.notes


def slack(part: Part, edge_length: float) -> float:
    """Return how much coarser than diagonal/100 the mesh is asked to be; then its error may grow too."""
    return max(100.0 * edge_length / part.diagonal, 1.0)


def _curved_lengths(part: Part, edge_lengths: Floats) -> Floats:
    """Shorten the edge length on small radii, so that it fits the rows of points that their arcs begin.

    The arcs turn by 30 degrees per segment; on a coarse mesh by more, and the length goes not as far down.
    """
    lengths = edge_lengths.copy()
    for face, surface in enumerate(part.surfaces):
        if surface.kind in ("cylinder", "sphere", "torus"):
            loose = slack(part, lengths[face]) ** (1.0 / 3.0)
            wanted = CURVED * min(loose, COARSEST_TURN / MAX_TURN) * surface.parameters[-1]
            lengths[face] = min(lengths[face], max(wanted, FINEST * loose**2 * lengths[face]))
    return lengths


def _mesh_until_good(work: _Work, todo: list[int], deadline: float | None, progress: Progress | None) -> None:
    for _ in range(1 + MAX_REFINEMENTS + MAX_RESIZES):
        todo = _mesh_faces(work, todo, deadline, progress)
        if not todo:
            break
    for face in sorted(work.problems):
        _fill(work, face)


def _faces_for_volume(work: _Work, assembly: Assembly) -> list[int]:
    """Shrink the edge length of all curved faces where the volume is off; return the faces to mesh again."""
    exact = work.part.volume
    if not exact > 0 or work.problems:
        return []
    error = abs(mesh_volume(assembly.points, assembly.triangles) / exact - 1.0)
    allowed = VOLUME_TOLERANCE * slack(work.part, float(work.base.max())) ** 1.5
    if error <= allowed:
        return []
    curved = {face for face, mesh in work.meshes.items() if mesh.surface.kind != "plane"}
    touched = set(curved)
    edges: set[int] = set()
    for face in curved:
        edges |= _shrink(work, work.meshes[face], math.sqrt(0.7 * allowed / error))
    for edge in edges:
        work.counts[edge] = _wanted(work, edge)
        touched |= work.part.topology.edge_faces[edge]
    _sample(work, edges)
    return sorted(touched - work.part.topology.skipped)


def _shrink(work: _Work, mesh: FaceMesh, factor: float) -> set[int]:
    """Multiply the edge length that a face really has; return the edges that need more points for it."""
    face = mesh.index
    chords = mesh.domain.points[mesh.domain.segments]
    present = float(np.linalg.norm(chords[:, 1] - chords[:, 0], axis=1).mean())
    target = min(float(work.target[face]), present) * float(np.clip(factor, 0.25, 0.85))
    work.target[face] = max(target, min(float(work.target[face]), MAX_SMALLEST * float(work.base[face])))
    edges = {use.edge for use in work.part.topology.uses[face]}
    return {edge for edge in edges if _wanted(work, edge) > work.counts[edge]}


def _edge_length(work: _Work, edge: int) -> float:
    faces = work.part.topology.edge_faces[edge]
    return min((float(work.target[face]) for face in faces), default=float(work.base.max()))


def _sample(work: _Work, edges: Iterable[int]) -> None:
    vertices = work.part.topology.vertices
    for edge in edges:
        if work.part.topology.edge_faces[edge]:
            work.samples[edge] = sample_edge(
                work.part.curves[edge], work.counts[edge], _edge_length(work, edge), vertices
            )


def _mesh_faces(work: _Work, todo: list[int], deadline: float | None, progress: Progress | None) -> list[int]:
    """Mesh faces; return the faces to be meshed again, because their edges have been refined."""
    finer: set[int] = set()
    retry: set[int] = set()
    for done, face in enumerate(todo):
        report(progress, done, len(todo))
        if deadline is not None and time.monotonic() > deadline:
            raise MeshingError(
                f"meshing ran out of time at face {face} of {len(work.part.surfaces)}; raise time_limit or "
                "use a larger edge_length"
            )
        try:
            mesh = _mesh_one(work, face)
        except FaceProblem as problem:
            work.problems[face] = problem.reason
            work.meshes.pop(face, None)
            if work.refined[face] < MAX_REFINEMENTS:
                retry.add(face)
                finer |= set(problem.edges) or {use.edge for use in work.part.topology.uses[face]}
            work.refined[face] += 1
            continue
        work.problems.pop(face, None)
        work.meshes[face] = mesh
        if mesh.folded_edges and work.refined[face] < MAX_REFINEMENTS:
            work.refined[face] += 1
            finer |= set(mesh.folded_edges)
            retry.add(face)
        else:
            finer |= _resize(work, mesh, retry)
    finer = {edge for edge in finer if not work.part.curves[edge].degenerate}
    doubled = {edge for edge in finer if work.counts[edge] < _wanted(work, edge)}
    for edge in finer:
        work.counts[edge] = _wanted(work, edge) if edge in doubled else 2 * work.counts[edge]
    _sample(work, finer)
    for edge in finer:
        retry |= work.part.topology.edge_faces[edge]
    return sorted(retry - work.part.topology.skipped)


def _wanted(work: _Work, edge: int) -> int:
    """Return the number of segments of an edge; a turn of 30 degrees per segment, more on a coarse mesh."""
    faces = work.part.topology.edge_faces[edge]
    coarsest = min((float(work.base[face]) for face in faces), default=0.0)
    turn = min(MAX_TURN * slack(work.part, coarsest) ** (1.0 / 3.0), COARSEST_TURN)
    return segments_for(work.part.curves[edge], _edge_length(work, edge), turn)


def _resize(work: _Work, mesh: FaceMesh, retry: set[int]) -> set[int]:
    """Shrink the edge length of a face whose triangles lose too much area; return the edges to refine."""
    face, exact = mesh.index, float(work.part.areas[mesh.index])
    if exact <= 0 or work.resized[face] >= MAX_RESIZES:
        return set()
    error = (abs(mesh.area - exact) - float(work.part.blur[face])) / exact
    allowed = AREA_TOLERANCE * slack(work.part, float(work.base[face])) ** 1.5
    if error <= allowed:
        return set()
    work.resized[face] += 1
    if mesh.surface.kind == "plane":
        edges = {use.edge for use in work.part.topology.uses[face]}
        return {edge for edge in edges if not work.part.curves[edge].straight}
    before = float(work.target[face])
    edges = _shrink(work, mesh, math.sqrt(0.7 * allowed / error))
    if work.target[face] < before:
        retry.add(face)
    return edges


def _mesh_one(work: _Work, face: int) -> FaceMesh:
    part = work.part
    uses = part.topology.uses[face]
    domain = face_domain(
        part.forward[face],
        part.surfaces[face],
        uses,
        part.curves,
        work.samples,  # type: ignore[arg-type]  # every edge that a face uses is sampled
        reproject=work.refined[face] == MAX_REFINEMENTS,
    )
    return mesh_face(
        face, part.surfaces[face], domain, target=float(work.target[face]), area=float(part.areas[face])
    )


def _fill(work: _Work, face: int) -> None:
    part, reason = work.part, work.problems[face]
    try:
        work.meshes[face] = fill_from_boundary(
            face,
            part.surfaces[face],
            part.topology.uses[face],
            part.curves,
            work.samples,  # type: ignore[arg-type]
            reason,
        )
        work.notes.append(f"face {face}: filled from its boundary points only ({reason})")
    except FaceProblem as problem:
        work.notes.append(f"face {face}: not meshed ({reason}; {problem.reason})")


def _weld(work: _Work, deadline: float | None, progress: Progress | None) -> tuple[Assembly, list[FaceMesh]]:
    """Weld the face meshes; split chords and edges that more than two triangles share."""
    for attempt in range(MAX_WELDS):
        meshes = [work.meshes[face] for face in sorted(work.meshes)]
        assembly = assemble(work.part.curves, _present(work), work.part.topology.vertices, meshes)
        chords, edges = crowded_chords(assembly, meshes)
        if not chords and not edges:
            break
        if attempt == MAX_WELDS // 2:  # splitting does not end: the polygons of these faces overlap
            for position in sorted({chord[0] for chord in chords}):
                face = meshes[position].index
                work.problems.setdefault(face, "its boundary overlaps itself")
                _fill(work, face)
            continue
        for position in {chord[0] for chord in chords}:
            mesh = meshes[position]
            work.meshes[mesh.index] = split_chords(
                mesh, [chord[1:] for chord in chords if chord[0] == position]
            )
        for edge in edges:
            work.counts[edge] *= 2
        _sample(work, edges)
        touched: set[int] = set().union(*(work.part.topology.edge_faces[edge] for edge in edges))
        _mesh_faces(work, sorted(touched), deadline, progress)
        for face in sorted(touched & set(work.problems)):
            _fill(work, face)
    return assembly, meshes


def _present(work: _Work) -> list[EdgeSamples]:
    """Return the samples of all edges; an edge that no face uses has none."""
    empty = EdgeSamples(np.zeros(2), np.zeros((2, 3)), np.zeros(2))
    return [empty if sample is None else sample for sample in work.samples]
