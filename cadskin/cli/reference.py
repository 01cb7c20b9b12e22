"""``cadskin reference``: point sets whose minimum-zone value is prescribed, to test metrology software."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cadskin.cli._console import note, progress_bar


def command(
    characteristic: Annotated[
        str,
        typer.Option(help="flatness, cylindricity, 'inscribed cylinder', perpendicularity, position, ..."),
    ],
    value: Annotated[
        float, typer.Option(help="Value that an exact evaluation gives [mm]; a diameter for sizes.")
    ],
    count: Annotated[int, typer.Option("-n", "--count", help="Number of sets.")] = 1,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the cases.")] = Path("reference"),
    points: Annotated[int, typer.Option(help="Points of each set.")] = 1000,
    arc: Annotated[float, typer.Option(help="Angle that is covered [deg].")] = 360.0,
    sampling: Annotated[
        str, typer.Option(help="random, grid, sections, generatrix, helix, bird cage.")
    ] = "random",
    waviness: Annotated[int, typer.Option(help="Undulations of the filling; 0 for random filling.")] = 0,
    outliers: Annotated[int, typer.Option(help="Points off the surface, under a label of their own.")] = 0,
    seed: Annotated[int | None, typer.Option(help="Same seed, same sets.")] = None,
    of: Annotated[
        Path | None,
        typer.Option("--of", "--part", metavar="PART", help="CAD file: make parts, not point sets."),
    ] = None,
    spec: Annotated[
        Path | None, typer.Option(metavar="SPEC", help="Spec file of PART [default: its PMI].")
    ] = None,
    tolerance: Annotated[
        str | None, typer.Option(metavar="ID", help="Tolerance of SPEC that gets the value.")
    ] = None,
) -> None:
    """Write point sets, or parts, whose true value is known.

    The value is exact to 1e-12 mm; each set comes with its answer. Parts are labelled meshes of a CAD file:
    its tolerance of the given id, or the first of the characteristic, gets the value.
    """
    import numpy as np

    from cadskin.errors import SpecificationError
    from cadskin.verify.reference_files import write_references
    from cadskin.verify.reference_sampling import SAMPLINGS

    if of is not None:
        _parts(of, spec, characteristic, tolerance, value, count, output, waviness, seed)
        return
    if spec is not None or tolerance is not None:
        raise SpecificationError("--spec and --tolerance are for parts; name the CAD file with --of")
    if sampling not in SAMPLINGS:
        raise SpecificationError(f"unknown sampling {sampling!r}; choose one of {', '.join(SAMPLINGS)}")
    with progress_bar("reference sets") as progress:
        written = write_references(
            output,
            characteristic,
            value,
            count=count,
            rng=seed,
            progress=progress,
            n_points=points,
            arc=float(np.radians(arc)),
            sampling=sampling,
            waviness=waviness,
            n_outliers=outliers,
        )
    note(f"{len(written)} cases in {output}; check a program with: cadskin evaluate {written[0]}")


def _parts(
    of: Path,
    spec: Path | None,
    characteristic: str,
    tolerance: str | None,
    value: float,
    count: int,
    output: Path,
    waviness: int,
    seed: int | None,
) -> None:
    """Write reference parts of a CAD file."""
    from cadskin.cli._reading import nominal_and_spec
    from cadskin.errors import SpecificationError
    from cadskin.verify.reference_parts import write_reference_parts

    nominal, given = nominal_and_spec(of, spec, time_limit=300.0)
    wanted = characteristic.replace(" ", "_").replace("run-out", "runout")
    chosen = tolerance or next((item.id for item in given if item.type == wanted), None)
    if chosen is None:
        kinds = ", ".join(sorted({item.type for item in given})) or "none"
        raise SpecificationError(
            f"{spec or of} has no tolerance of type {wanted!r} (it has: {kinds}); give one with --spec"
        )
    with progress_bar("reference parts") as progress:
        written = write_reference_parts(
            output,
            nominal,
            given,
            chosen,
            value,
            count=count,
            waves=waviness or 4,
            rng=seed,
            progress=progress,
        )
    note(
        f"{len(written)} parts in {output}, {chosen} = {value:g} mm; check a program with: "
        f"cadskin verify {written[0]} --of {of} --spec {output / 'spec.toml'}"
    )
