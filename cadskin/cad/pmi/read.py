"""Semantic PMI of a STEP file as a specification."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from pathlib import Path

from cadskin.cad.pmi.aspects import Aspects
from cadskin.cad.pmi.datums import DatumReader
from cadskin.cad.pmi.dimensions import DimensionReader
from cadskin.cad.pmi.graph import PmiGraph
from cadskin.cad.pmi.part21 import Part21File, read_part21
from cadskin.cad.pmi.selections import FaceMap, PartFaces
from cadskin.cad.pmi.tolerances import ToleranceReader
from cadskin.errors import CadskinWarning
from cadskin.spec.checks import check
from cadskin.spec.datums import Datum
from cadskin.spec.dimension import Dimension
from cadskin.spec.specification import Specification, Unresolved
from cadskin.spec.tolerance import Tolerance

__all__ = ["read_pmi_text", "specification_of"]


def read_pmi_text(path: str | Path, parts: Iterable[PartFaces] | None = None) -> Specification:
    """Read the tolerances, datums and dimensions of a STEP file from its text.

    Parameters
    ----------
    path : str or Path
    parts : iterable of CadPart, optional
        The parts of the same file; they give the face indices. Without them only the STEP numbers of
        the faces are known, and no geometry kernel is needed.

    Returns
    -------
    Specification
        With everything that could not be resolved in ``unresolved``, and the reader's remarks in ``notes``.

    Raises
    ------
    ReadError
        The file is no STEP text, or is cut off.

    Warns
    -----
    CadskinWarning
        The PMI uses several length units.

    References
    ----------
    ISO 10303-242; CAx-IF, Recommended practices for the representation and presentation of PMI (AP242).
    """
    return specification_of(read_part21(path), parts)


def specification_of(file: Part21File, parts: Iterable[PartFaces] | None = None) -> Specification:
    """Return the specification of an indexed STEP file; see `read_pmi_text`."""
    face_map = None if parts is None else FaceMap.of(parts)
    aspects = Aspects(PmiGraph(file))
    datum_reader = DatumReader(aspects, face_map)
    tolerance_reader = ToleranceReader(aspects, datum_reader, face_map)
    dimension_reader = DimensionReader(aspects, face_map)
    tolerances = tolerance_reader.tolerances()
    datums, dimensions = datum_reader.datums(), dimension_reader.dimensions()
    unresolved = [*tolerance_reader.unresolved, *datum_reader.unresolved, *dimension_reader.unresolved]
    unresolved += [Unresolved(f"#{number}", "file", reason) for number, reason in file.broken.items()]
    unresolved += _nothing(file, tolerances, datums, dimensions)
    notes = _unit_notes(file, tolerances, dimensions)
    for note in notes:
        warnings.warn(note, CadskinWarning, stacklevel=3)
    spec = Specification(
        *tolerances, datums=datums, dimensions=dimensions, unresolved=unresolved, notes=notes, checked=False
    )
    findings = tuple(f"{finding.severity}: {finding.message}" for finding in check(spec))
    return Specification(
        *tolerances,
        datums=datums,
        dimensions=dimensions,
        unresolved=unresolved,
        notes=(*notes, *findings),
        checked=False,
    )


def _unit_notes(
    file: Part21File, tolerances: Iterable[Tolerance], dimensions: Iterable[Dimension]
) -> tuple[str, ...]:
    by_unit: dict[str, list[str]] = {}
    for tolerance in tolerances:
        if tolerance.raw_unit is not None:
            by_unit.setdefault(tolerance.raw_unit, []).append(tolerance.id)
    for dimension in dimensions:
        if dimension.raw_unit is not None and not dimension.angular:
            by_unit.setdefault(dimension.raw_unit, []).append(dimension.id)
    if len(by_unit) < 2:
        return ()
    counts = ", ".join(f"{len(ids)} in {unit} (first {ids[0]})" for unit, ids in by_unit.items())
    return (f"{file.name}: the PMI mixes length units: {counts}; check the odd ones against the drawing",)


def _nothing(
    file: Part21File,
    tolerances: tuple[Tolerance, ...],
    datums: tuple[Datum, ...],
    dimensions: tuple[Dimension, ...],
) -> list[Unresolved]:
    if tolerances or datums or dimensions:
        return []
    drawn = len(file.of_type("DRAUGHTING_CALLOUT", "ANNOTATION_OCCURRENCE", "ANNOTATION_CURVE_OCCURRENCE"))
    tessellated = len(file.of_type("TESSELLATED_ANNOTATION_OCCURRENCE"))
    what = "graphical annotations only" if drawn or tessellated else "no PMI at all"
    schema = file.schema.split("{")[0].strip() or "no schema"
    return [
        Unresolved("file", "file", f"no semantic PMI: {file.name} ({schema}) has {what}; write a spec file")
    ]
