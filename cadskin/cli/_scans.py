"""How a scan is brought to the nominal part: the options of `verify` and `measure`, and what they do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, cast, get_args

import typer

from cadskin.cli._console import note, progress_bar
from cadskin.cli._options import as_selector
from cadskin.errors import SpecificationError

if TYPE_CHECKING:
    from cadskin._typing import Points
    from cadskin.shape import NominalModel
    from cadskin.spec import Specification
    from cadskin.stats import Registration

__all__ = ["Align", "AlignOn", "AlignOrNot", "Search", "aligned", "check_alignment", "say_alignment"]

_ALIGN = typer.Option(
    "--align",
    metavar="HOW",
    help="Bring the scan to the part: none, datum_frame, least_squares, minimum_zone or robust. A best fit "
    "takes off what a position or orientation is about.",
    show_default=False,
)
Align = Annotated[str, _ALIGN]
AlignOrNot = Annotated[str | None, _ALIGN]
AlignOn = Annotated[
    list[str] | None,
    typer.Option(
        "--on",
        metavar="FACES",
        help="Align on these faces only; repeat for the datums of datum_frame, the primary first "
        "[default: the whole part, or the first datum system of the tolerances].",
        show_default=False,
    ),
]
Search = Annotated[bool, typer.Option("--search", help="Look through all rotations: the scan lies anywhere.")]


def check_alignment(align: str | None, *, on: list[str] | None = None, search: bool = False) -> None:
    """Refuse a wrong name, and options of an alignment that is not asked for.

    Raises
    ------
    SpecificationError
        Such options.
    """
    from cadskin.stats import Alignment

    if align is None:
        if on or search:
            raise SpecificationError(f"{'--on' if on else '--search'} is about an alignment: add --align HOW")
    elif align not in get_args(Alignment):
        raise SpecificationError(f"--align must be one of {', '.join(get_args(Alignment))}, got {align!r}")


def aligned(
    points: Points,
    nominal: NominalModel,
    tolerances: Specification,
    align: str,
    *,
    on: list[str] | None,
    search: bool,
    probe_radius: float = 0.0,
) -> Registration:
    """Return how points (n, 3) come to the nominal part.

    Raises
    ------
    SpecificationError
        Alignment on datums, and no tolerance names any.
    """
    from cadskin.stats import register

    with progress_bar("aligning the scan") as progress:
        return register(
            points,
            nominal,
            alignment=cast("Any", align),
            features=_features(on, align, tolerances, nominal),
            start="search" if search else None,
            probe_radius=probe_radius,
            progress=progress,
        )


def say_alignment(found: Registration) -> None:
    """Write what an alignment did, how well it is known, and what the user should know of it."""
    import numpy as np

    turn, shift = np.degrees(found.motion.angle), found.motion.translation
    spread = 1000 * np.sqrt(np.diag(found.covariance)[:3])
    note(
        f"alignment {found.alignment}: turned by {turn:.3f}°, moved by ({shift[0]:.4f}, {shift[1]:.4f}, "
        f"{shift[2]:.4f}) mm, known to ({spread[0]:.2f}, {spread[1]:.2f}, {spread[2]:.2f}) µm from the "
        f"scatter of the points alone ({found.scale:.3g} mm; {found.inliers:.1%} of them count)"
    )
    for text in found.notes:
        note(text)


def _features(on: list[str] | None, align: str, tolerances: Specification, nominal: NominalModel) -> Any:
    """Return what the alignment is made on: as given, or the first datum system of most references."""
    from cadskin.spec.binding import bound_to

    if on:
        chosen = [as_selector(faces) for faces in on]
        return chosen if align == "datum_frame" else chosen[0] if len(chosen) == 1 else chosen
    if align != "datum_frame":
        return None
    bound = bound_to(tolerances, nominal)
    systems = [tolerance.datums.references for tolerance in bound if tolerance.datums.references]
    if systems:
        chosen_system = max(systems, key=len)
        faces = [
            [face for letter in reference.letters for face in bound.datum(letter).feature.faces]
            for reference in chosen_system
        ]
        if all(faces):
            return faces
    raise SpecificationError(
        "--align datum_frame needs datums: no tolerance of the part names any; give --on FACES for each"
    )
