"""Write a part with its tolerances as AP242."""

from __future__ import annotations

import re
import tempfile
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from cadskin.cad._occ import quiet
from cadskin.cad.discretise import part_faces
from cadskin.cad.documents import read_parts
from cadskin.cad.objects import as_parts, describe_object
from cadskin.cad.part import CadPart, pick_part
from cadskin.cad.partitioning import partition
from cadskin.cad.pmi.compose import Composer
from cadskin.cad.pmi.compose_dimensions import compose_dimensions
from cadskin.cad.pmi.compose_tolerances import compose_datums, compose_tolerances
from cadskin.cad.pmi.part21 import Part21File
from cadskin.errors import CadskinWarning, ExportError
from cadskin.shape.fingerprint import fingerprint, match_faces
from cadskin.shape.nominal import Face
from cadskin.spec.binding import bind_faces
from cadskin.spec.files import write_text_file
from cadskin.spec.specification import Specification
from cadskin.spec.tolerance import Tolerance

__all__ = ["write_step"]

_SCHEMA = "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 442 3 1 4 }"
_FILE_SCHEMA = re.compile(r"FILE_SCHEMA\s*\(\s*\(.*?\)\s*\)\s*;", re.DOTALL)
_SETTINGS = {"write.step.schema": "AP242DIS", "write.step.unit": "MM", "write.step.product.name": "part"}


def write_step(
    path: str | Path, shape: Any, spec: Specification | None = None, *, part: str | int | None = None
) -> Path:
    """Write a part with its tolerances, datums and dimensions as semantic PMI (AP242 edition 2).

    Parameters
    ----------
    path : str or Path
    shape : object
        A cadquery or build123d part, a raw shape, a CAD file or a `CadPart`; one solid.
    spec : Specification, optional
        Its selectors (``">Z"``) are resolved on the part.
    part : str or int, optional
        Which part, where ``shape`` holds several.

    Returns
    -------
    Path

    Raises
    ------
    ExportError
        The file cannot be written, or a tolerance refers to what is not there.
    SpecificationError
        A selector matches nothing.

    Warns
    -----
    CadskinWarning
        AP242 has no place for some of it (a deviation model, the standard); the message lists it.

    References
    ----------
    ISO 10303-242; CAx-IF, Recommended practices for the representation and presentation of PMI (AP242).

    Examples
    --------
    >>> import cadquery as cq, cadskin as cs, tempfile, pathlib
    >>> plate = cq.Workplane().box(60, 40, 8)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "plate.step")
    ...     _ = cs.write_step(file, plate, cs.Specification(cs.flatness(">Z", 0.02)))
    ...     [str(tolerance) for tolerance in cs.read_pmi(file)]
    ['⏥ 0.02']
    """
    chosen = pick_part(as_parts(shape), part, where=describe_object(shape))
    faces = part_faces(chosen)
    bound = bind_faces(spec or Specification(), faces, partition(chosen.shape, faces))
    with tempfile.TemporaryDirectory(prefix="cadskin-") as folder:
        plain = Path(folder, Path(path).name or "part.step").with_suffix(".step")
        _export(plain, chosen, Path(path).stem)
        text = plain.read_text(encoding="latin-1")
        numbers = _step_numbers(plain, faces)
    composer = Composer(Part21File(text.encode("latin-1"), Path(path).name), numbers)
    datums = compose_datums(composer, bound.datums)
    compose_tolerances(composer, _with_default(bound), datums)
    compose_dimensions(composer, bound.dimensions)
    if composer.lost:
        lost = "; ".join(dict.fromkeys(composer.lost))
        warnings.warn(f"{Path(path).name}: AP242 does not hold {lost}", CadskinWarning, stacklevel=2)
    return write_text_file(path, _joined(text, composer.out.text()), encoding="latin-1")


def _with_default(spec: Specification) -> tuple[Tolerance, ...]:
    if spec.default is None:
        return spec.tolerances
    return (*spec.tolerances, replace(spec.default, scope="general"))


def _joined(text: str, statements: str) -> str:
    header, mark, data = text.partition("DATA;")
    header = _FILE_SCHEMA.sub(f"FILE_SCHEMA(('{_SCHEMA}'));", header, count=1)
    end = data.rindex("ENDSEC;")
    return header + mark + data[:end] + statements + data[end:]


def _export(path: Path, part: CadPart, name: str) -> None:
    """Write the bare geometry; the kernel's settings are put back afterwards."""
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

    writer = STEPControl_Writer()  # makes the settings known
    wanted = {**_SETTINGS, "write.step.product.name": name or "part"}
    kept = {key: Interface_Static.CVal_s(key) for key in wanted}
    try:
        with quiet():
            for key, value in wanted.items():
                Interface_Static.SetCVal_s(key, value)
            writer = STEPControl_Writer()
            done = writer.Transfer(part.shape, STEPControl_StepModelType.STEPControl_AsIs)
            done = writer.Write(str(path)) if done == IFSelect_ReturnStatus.IFSelect_RetDone else done
    finally:
        for key, value in kept.items():
            Interface_Static.SetCVal_s(key, value)
    if done != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise ExportError(f"{path.name}: the geometry kernel could not write the part ({done.name})")


def _step_numbers(path: Path, faces: Sequence[Face]) -> tuple[int, ...]:
    """Return the STEP number of every face, from the file as it reads back."""
    back = read_parts(path, allow_open=True)
    if len(back) != 1:
        raise ExportError(f"{path.name}: the part reads back as {len(back)} parts")
    again = part_faces(back[0])
    numbers = [face.step_id for face in again]
    prints = [fingerprint(face) for face in faces]
    # Usually in the same order; else every face must be found without doubt.
    matches = match_faces(prints, again)
    same_order = len(again) == len(faces) and all(i in m.candidates for i, m in enumerate(matches))
    order = range(len(faces)) if same_order else [match.new for match in matches]
    found = [None if index is None else numbers[index] for index in order]
    if any(number is None for number in found):
        lost = found.index(None)
        raise ExportError(f"{path.name}: face {lost} is not found again in the written geometry")
    return tuple(int(number) for number in found if number is not None)
