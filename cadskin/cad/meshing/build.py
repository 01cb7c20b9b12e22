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
from cadskin.cad.meshing.domain import FaceProblem, face_domain
from cadskin.cad.meshing.edges import EdgeCurve, EdgeSamples, read_edge, sample_edge, segments_for
from cadskin.cad.meshing.face import FaceMesh, mesh_face
from cadskin.cad.meshing.fallback import fill_from_boundary
from cadskin.cad.meshing.repair import crowded_chords, split_chords
from cadskin.cad.meshing.topology import Topology, forward_face, read_topology
from cadskin.cad.surface import FaceSurface, face_surface
from cadskin.errors import MeshingError

__all__ = ["Part", "build", "read_part"]

MAX_REFINEMENTS = 3  # of the edges of a face that folds or crosses itself
MAX_RESIZES = 3  # of a face whose area is off
AREA_TOLERANCE = 0.015
MAX_SMALLEST = 1.0 / 16.0  # of the wanted edge length: how far a face may be refined to hold its area


@dataclass(frozen=True, eq=False)
class Part:
    """A shape, read once for any number of meshes."""

    topology: Topology
    surfaces: tuple[FaceSurface, ...]
    curves: tuple[EdgeCurve, ...]
    forward: tuple[Any, ...]
    areas: Floats


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


def read_part(shape: Any, areas: Floats) -> Part:
    """Read topology, surfaces and curves of a shape; ``areas`` are the exact areas of its faces."""
    topology = read_topology(shape)
    return Part(
        topology,
        tuple(face_surface(face) for face in topology.faces),
        tuple(read_edge(edge, ends) for edge, ends in zip(topology.edges, topology.ends, strict=True)),
        tuple(forward_face(face) for face in topology.faces),
        areas,
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
    work = _Work(part, edge_lengths, edge_lengths.copy())
    work.samples = [None] * len(part.curves)
    everything = range(len(part.curves))
    for edge in everything:
        work.counts[edge] = segments_for(part.curves[edge], _edge_length(work, edge))
    _sample(work, everything)
    todo = [face for face in range(len(part.surfaces)) if face not in part.topology.skipped]
    for _ in range(1 + MAX_REFINEMENTS + MAX_RESIZES):
        again = _mesh_faces(work, todo, deadline, progress)
        if not again:
            break
        todo = again
    for face in sorted(work.problems):
        _fill(work, face)
    return (*_weld(work, deadline, progress), work.notes)


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
    return segments_for(work.part.curves[edge], _edge_length(work, edge))


def _resize(work: _Work, mesh: FaceMesh, retry: set[int]) -> set[int]:
    """Shrink the edge length of a face whose triangles lose too much area; return the edges to refine."""
    face, exact = mesh.index, float(work.part.areas[mesh.index])
    if exact <= 0 or work.resized[face] >= MAX_RESIZES:
        return set()
    error = abs(mesh.area / exact - 1.0)
    if error <= AREA_TOLERANCE:
        return set()
    work.resized[face] += 1
    edges = {use.edge for use in work.part.topology.uses[face]}
    if mesh.surface.kind != "plane":
        factor = float(np.clip(math.sqrt(0.7 * AREA_TOLERANCE / error), 0.25, 0.8))
        smallest = MAX_SMALLEST * float(work.base[face])
        target = max(float(work.target[face]) * factor, smallest)
        if target >= work.target[face]:
            return set()
        work.target[face] = target
        retry.add(face)
        return {edge for edge in edges if _wanted(work, edge) > work.counts[edge]}
    return {edge for edge in edges if not work.part.curves[edge].straight}


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
    for _ in range(6):
        meshes = [work.meshes[face] for face in sorted(work.meshes)]
        assembly = assemble(work.part.curves, _present(work), work.part.topology.vertices, meshes)
        chords, edges = crowded_chords(assembly, meshes)
        if not chords and not edges:
            break
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
