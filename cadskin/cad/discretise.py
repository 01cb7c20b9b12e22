"""The front doors `nominal` and `nominals`: a CAD part becomes a nominal model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._progress import report
from cadskin._typing import Ints, Progress
from cadskin.cad.faces import describe_faces
from cadskin.cad.objects import as_parts, describe_object
from cadskin.cad.part import CadPart, pick_part
from cadskin.cad.partitioning import partition
from cadskin.errors import GeometryError, MeshingError
from cadskin.shape.discrete import DiscreteShape
from cadskin.shape.nominal import Face, NominalModel, Samples, build_features
from cadskin.shape.selectors import select_faces

if TYPE_CHECKING:
    from cadskin.cad.meshing import LabelledMesh

__all__ = ["nominal", "nominals", "part_faces"]


def nominal(
    obj: Any,
    *,
    edge_length: float | None = None,
    n_points: int | None = None,
    face_edge_lengths: Mapping[Any, float] | None = None,
    part: str | int | None = None,
    backend: str = "cadskin",
    allow_open: bool = False,
    progress: Progress | None = None,
    **mesh_options: Any,
) -> NominalModel:
    """Return the nominal model of one part: its labelled mesh, faces, features and feature samples.

    Parameters
    ----------
    obj : object
        A STEP, IGES or BREP file, a cadquery or build123d object, a raw ``TopoDS_Shape`` or a `CadPart`.
    edge_length : float, optional
        Target edge length of the triangles [mm]; a hundredth of the part's diagonal if neither this nor
        ``n_points`` is given.
    n_points : int, optional
        Wanted number of mesh points, instead of ``edge_length``.
    face_edge_lengths : mapping, optional
        Another edge length [mm] for some faces; keys are face indices or selectors (``">Z"``, ``"#123"``,
        a name; see `cadskin.shape.select`).
    part : str or int, optional
        Name or number of the part, where the file or assembly holds several.
    backend : {"cadskin", "gmsh", "pymeshlab"}
        The mesher.
    allow_open : bool
        Accept an open shell where there is no solid.
    progress : callable, optional
        Called with (done, total); returning False stops the work.
    **mesh_options
        ``max_triangles`` and ``time_limit`` of `cadskin.cad.meshing.mesh_shape`.

    Returns
    -------
    NominalModel

    Raises
    ------
    ReadError
        The file cannot be read.
    GeometryError
        No solid, or several and no ``part``.
    SelectionError
        A key of ``face_edge_lengths`` matches no face.
    MeshingError
        No watertight mesh within the limits.

    Examples
    --------
    >>> import cadquery as cq
    >>> plate = nominal(cq.Workplane().box(60, 40, 8).faces(">Z").workplane().hole(12), edge_length=4.0)
    >>> plate.closed, len(plate.features), plate.feature("%CYLINDER").radius
    (True, 7, 6.0)
    """
    parts = as_parts(obj, allow_open=allow_open)
    chosen = pick_part(parts, part, where=describe_object(obj))
    return _discretise(
        chosen,
        edge_length=edge_length,
        n_points=n_points,
        face_edge_lengths=face_edge_lengths or {},
        backend=backend,
        allow_open=allow_open,
        progress=progress,
        **mesh_options,
    )


def nominals(
    obj: Any,
    *,
    edge_length: float | None = None,
    n_points: int | None = None,
    face_edge_lengths: Mapping[Any, float] | None = None,
    backend: str = "cadskin",
    allow_open: bool = False,
    progress: Progress | None = None,
    **mesh_options: Any,
) -> tuple[NominalModel, ...]:
    """Return the nominal model of every part of a file or object; see `nominal` for the parameters.

    Each placed instance of a solid in an assembly is a part of its own; its name stands in ``source.part``.

    Examples
    --------
    >>> import cadquery as cq
    >>> two = cq.Workplane().pushPoints([(0, 0), (9, 0)]).box(2, 2, 2, combine=False)
    >>> [model.source.part for model in nominals(two, edge_length=1.0)]
    ['part', 'part-2']
    """
    parts = as_parts(obj, allow_open=allow_open)
    models = []
    for done, one in enumerate(parts):
        if len(parts) > 1:
            report(progress, done, len(parts))
        model = _discretise(
            one,
            edge_length=edge_length,
            n_points=n_points,
            face_edge_lengths=face_edge_lengths or {},
            backend=backend,
            allow_open=allow_open,
            progress=progress if len(parts) == 1 else None,
            **mesh_options,
        )
        models.append(model)
    if len(parts) > 1:
        report(progress, len(parts), len(parts))
    return tuple(models)


def part_faces(part: CadPart) -> tuple[Face, ...]:
    """Return the face records of a part, with the names, colours and STEP numbers of its file."""
    return describe_faces(
        part.shape, names=part.face_names, colours=part.face_colours, step_ids=part.face_step_ids
    )


def _discretise(
    part: CadPart,
    *,
    edge_length: float | None,
    n_points: int | None,
    face_edge_lengths: Mapping[Any, float],
    **mesh_options: Any,
) -> NominalModel:
    from cadskin.cad.meshing import mesh_shape

    faces = part_faces(part)
    groups = partition(part.shape, faces)
    if edge_length is None and n_points is None:
        corners = np.concatenate([face.bounds for face in faces])
        edge_length = float(np.linalg.norm(np.ptp(corners, axis=0))) / 100.0
    lengths = _lengths_by_face(faces, groups, face_edge_lengths)
    try:
        mesh = mesh_shape(
            part.shape, edge_length=edge_length, n_points=n_points, face_edge_lengths=lengths, **mesh_options
        )
    except MeshingError as problem:  # the mesher does not know the name
        raise MeshingError(f"{_label(part)}: {problem}") from problem
    source = replace(
        part.source, edge_length=edge_length, backend=str(mesh_options.get("backend", "cadskin"))
    )
    model = assemble(mesh, faces, groups)
    return replace(model, source=source, notes=(*part.notes, *model.notes))


def _label(part: CadPart) -> str:
    """Return how messages name a part: its file and, where that is not the same word, its name."""
    if part.source.path is None or Path(part.source.path).stem == part.name:
        return part.source.path or part.name
    return f"{part.source.path}, part {part.name}"


def assemble(mesh: LabelledMesh, faces: tuple[Face, ...], groups: Sequence[Sequence[int]]) -> NominalModel:
    """Return the nominal model of a labelled mesh: one sample per (feature, vertex).

    Parameters
    ----------
    mesh : LabelledMesh
    faces : tuple of Face
    groups : sequence of sequence of int
        Faces of each feature, of `cadskin.cad.partition`.
    """
    surface = DiscreteShape(mesh.points, mesh.triangles, mesh.face_ids)
    feature_of_face = np.full(len(faces), -1, dtype=np.int64)
    for i, group in enumerate(groups):
        feature_of_face[list(group)] = i
    rows, starts = _sample_rows(
        feature_of_face[mesh.wedge_faces],
        mesh.wedge_vertices,
        mesh.wedge_faces,
        mesh.wedge_singular,
        len(groups),
    )
    samples = Samples(
        vertex_ids=mesh.wedge_vertices[rows],
        face_ids=mesh.wedge_faces[rows],
        uv=mesh.wedge_uv[rows],
        normals=mesh.wedge_normals[rows],
        curvatures=mesh.wedge_curvatures[rows],
        directions=mesh.wedge_directions[rows],
        singular=mesh.wedge_singular[rows],
    )
    return NominalModel(
        surface=surface,
        faces=faces,
        features=build_features(surface, groups, faces, samples, starts),
        samples=samples,
        closed=bool(mesh.closed),
        notes=tuple(mesh.notes),
        failed_faces=tuple(int(i) for i in mesh.failed_faces),
    )


def _sample_rows(
    features: Ints, vertices: Ints, faces: Ints, singular: Any, n_features: int
) -> tuple[Ints, Ints]:
    """Return the wedge that stands for each (feature, vertex), and the first row of each feature.

    Where two faces of one feature meet, the regular wedge of the lower face index is taken.
    """
    order = np.lexsort((faces, singular, vertices, features))
    key_feature, key_vertex = features[order], vertices[order]
    first = np.ones(len(order), dtype=bool)
    first[1:] = (np.diff(key_feature) != 0) | (np.diff(key_vertex) != 0)
    rows = order[first]
    starts = np.searchsorted(features[rows], np.arange(n_features + 1))
    return rows, starts


def _lengths_by_face(
    faces: tuple[Face, ...], groups: Sequence[Sequence[int]], lengths: Mapping[Any, float]
) -> dict[int, float]:
    """Return an edge length [mm] per face index from a table of selectors; all faces of a feature together.

    Raises
    ------
    GeometryError
        Two keys give one face different lengths.
    """
    chosen: dict[int, float] = {}
    group_of = {index: group for group in groups for index in group}
    for key, length in lengths.items():
        indices = {k for index in select_faces(faces, key) for k in group_of[index]}
        for index in sorted(indices):
            if chosen.setdefault(index, float(length)) != float(length):
                raise GeometryError(
                    f"face {index} gets two edge lengths, {chosen[index]:g} and {float(length):g} mm "
                    f"(the second by {key!r})"
                )
    return chosen
