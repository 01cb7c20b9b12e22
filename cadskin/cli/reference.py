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
) -> None:
    """Write point sets with a prescribed minimum-zone value.

    The value is exact to 1e-12 mm; each set comes with its answer.
    """
    import numpy as np

    from cadskin.errors import SpecificationError
    from cadskin.verify.reference_files import write_references
    from cadskin.verify.reference_sampling import SAMPLINGS

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
