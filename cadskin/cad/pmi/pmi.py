"""Semantic PMI of a STEP file, on the faces of its parts."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cadskin.cad.pmi.aspects import Aspects
from cadskin.cad.pmi.graph import PmiGraph
from cadskin.cad.pmi.part21 import Part21File, read_part21
from cadskin.cad.pmi.read import specification_of
from cadskin.cad.pmi.selections import PartFaces
from cadskin.cad.pmi.topology import FACES
from cadskin.errors import CadskinError, CadskinWarning, GeometryError, ReadError
from cadskin.shape.nominal import Face, NominalModel
from cadskin.spec.reattach import fingerprinted
from cadskin.spec.selection import FeatureSelection
from cadskin.spec.specification import Specification, Unresolved

__all__ = ["read_pmi"]


@dataclass(frozen=True)
class _NumberedPart:
    """Name and STEP face numbers of a part."""

    name: str
    face_step_ids: tuple[int | None, ...]
    faces: tuple[Face, ...] = ()


def read_pmi(
    path: str | Path, part: NominalModel | PartFaces | str | None = None, *, time_limit: float | None = 300.0
) -> Specification:
    """Read the tolerances, datums and dimensions of an AP242 file, on the faces of a part.

    Parameters
    ----------
    path : str or Path
        A STEP file. AP203 and AP214 files are read too, where they hold semantic tolerances.
    part : NominalModel, CadPart or str, optional
        The part whose face indices are meant, or its name in the file. Every instance of a part in an
        assembly (``nut``, ``nut-2``, ...) has the PMI of that part. By default all parts, those that stand
        several times by their first instance; the geometry is then read in a child process, to number
        the faces.
    time_limit : float, optional
        Seconds for that child process.

    Returns
    -------
    Specification
        Tolerances in mm with the faces they are on. What could not be resolved is in ``unresolved``, with
        a reason.

    Raises
    ------
    ReadError
        No STEP file, one that is cut off, or one that is only triangles.
    GeometryError
        The file has no part of that name.

    Warns
    -----
    CadskinWarning
        The PMI mixes length units, or the faces could not be numbered.
    """
    file = read_part21(path)
    if isinstance(part, NominalModel):
        numbers = tuple(face.step_id for face in part.faces)
        own = _NumberedPart(part.source.part or file.name, numbers, part.faces)
        return _without_others(_with_prints(file, [own]), set(numbers), _faces_of_solids(file))
    if part is not None and not isinstance(part, str):
        return _without_others(
            specification_of(file, [part]), set(part.face_step_ids), _faces_of_solids(file)
        )
    without_faces = _text_only(file)
    if not without_faces.tolerances and not without_faces.datums and not without_faces.dimensions:
        return without_faces
    try:
        parts = _numbered_parts(Path(path), time_limit)
    except CadskinError as error:
        reason = f"the faces have no indices, only STEP numbers: {error}"
        warnings.warn(f"{file.name}: {reason}", CadskinWarning, stacklevel=2)
        return without_faces.with_unresolved((*without_faces.unresolved, Unresolved("file", "file", reason)))
    return _of_all(file, parts) if part is None else _of_part(file, parts, part)


def _with_prints(file: Part21File, parts: Sequence[_NumberedPart]) -> Specification:
    spec = specification_of(file, parts)
    for part in parts:
        spec = fingerprinted(spec, part.faces, part=part.name if len(parts) > 1 else None)
    return spec


def _text_only(file: Part21File) -> Specification:
    tessellated = file.of_type("TESSELLATED_SOLID", "TESSELLATED_SHELL", "COMPLEX_TRIANGULATED_FACE")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CadskinWarning)  # said again when the faces are numbered
        spec = specification_of(file)
    if tessellated and not file.of_type(*FACES) and not spec.tolerances:
        raise ReadError(
            f"{file.name} is tessellated: it holds triangles without exact surfaces, and no semantic PMI; "
            "export it as AP242 with exact geometry (B-rep)"
        )
    return spec


def _numbered_parts(path: Path, time_limit: float | None) -> list[_NumberedPart]:
    from cadskin.cad.contained import contained_describe

    described = contained_describe(path, time_limit=time_limit)
    return [
        _NumberedPart(part.name, tuple(face.step_id for face in part.faces), part.faces)
        for part in described.parts
    ]


def _of_part(file: Part21File, parts: Sequence[_NumberedPart], name: str) -> Specification:
    chosen = [part for part in parts if part.name == name]
    if not chosen:
        names = ", ".join(part.name for part in parts)
        raise GeometryError(f"{file.name} has no part {name!r}; it has {names}")
    own = set(chosen[0].face_step_ids)
    return _without_others(
        _with_prints(file, chosen), own, {number for part in parts for number in part.face_step_ids}
    )


def _of_all(file: Part21File, parts: Sequence[_NumberedPart]) -> Specification:
    spec = _with_prints(file, parts)
    instances: dict[tuple[int | None, ...], list[str]] = {}
    for part in parts:
        instances.setdefault(part.face_step_ids, []).append(part.name)
    used = {item.part for item in _features(spec)}
    notes = tuple(
        f"{names[0]} stands {len(names)} times; its PMI is on the first one here, "
        f"choose another by its name: {', '.join(names[1:4])}{', ...' if len(names) > 4 else ''}"
        for names in instances.values()
        if len(names) > 1 and names[0] in used
    )
    return spec.changed(notes=(*spec.notes, *notes)) if notes else spec


def _features(spec: Specification) -> list[FeatureSelection]:
    return [
        *(item.feature for item in spec.tolerances),
        *(item.feature for item in spec.datums),
        *(item.feature for item in spec.dimensions),
    ]


def _faces_of_solids(file: Part21File) -> set[int | None]:
    """Return the STEP numbers of the faces of all solids; other faces are supplemental geometry."""
    aspects = Aspects(PmiGraph(file))
    solids = file.of_type("MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS")
    return {face for solid in solids for face in aspects.body_faces(solid)}


def _without_others(spec: Specification, own: set[int | None], known: set[int | None]) -> Specification:
    """Leave out what is only on other parts: on ``known`` faces, none of them the part's ``own``."""
    others = known - own

    def kept(items: Iterable[Any]) -> tuple[Any, ...]:
        return tuple(item for item in items if not _elsewhere(item.feature, own, others))

    tolerances = kept(spec.tolerances)
    n_left_out = len(spec.tolerances) - len(tolerances)
    notes = (f"{n_left_out} tolerances belong to other parts of the file",) if n_left_out else ()
    # The specification may lose all its tolerances here, so it is made anew.
    return Specification(
        *tolerances,
        datums=kept(spec.datums),
        dimensions=kept(spec.dimensions),
        unresolved=spec.unresolved,
        notes=(*spec.notes, *notes),
        fingerprints=spec.fingerprints,
        checked=False,
    )


def _elsewhere(feature: FeatureSelection, own: set[int | None], others: set[int | None]) -> bool:
    return not own.intersection(feature.step_faces) and bool(others.intersection(feature.step_faces))
