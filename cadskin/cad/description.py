"""What is in a CAD file, as plain records (no kernel needed to hold them)."""

from __future__ import annotations

from dataclasses import dataclass, field

from cadskin._arrays import frozen
from cadskin._typing import Points
from cadskin.shape.nominal import Face

__all__ = ["FileDescription", "PartDescription"]


@dataclass(frozen=True, eq=False)
class PartDescription:
    """One part of a CAD file.

    Parameters
    ----------
    name : str
    path : tuple of str
        Names of the assembly instances that hold it, the outermost first.
    solid : bool
        False for an open shell.
    valid : bool
        What OCCT's own check says of its shape.
    area : float
        Exact area [mm²].
    volume : float or None
        Exact volume [mm³]; None for an open shell.
    bounds : (2, 3) float
        Bounding box [mm], lowest and highest corner.
    faces : tuple of Face
    groups : tuple of tuple of int
        Faces of each feature.
    notes : tuple of str
        What was repaired or left out.
    """

    name: str
    path: tuple[str, ...]
    solid: bool
    valid: bool
    area: float
    volume: float | None
    bounds: Points
    faces: tuple[Face, ...] = field(repr=False)
    groups: tuple[tuple[int, ...], ...] = field(repr=False)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Freeze the box."""
        object.__setattr__(self, "bounds", frozen(self.bounds, shape=(2, 3), name="bounds"))

    @property
    def diagonal(self) -> float:
        """Diagonal of the bounding box [mm]."""
        return float(((self.bounds[1] - self.bounds[0]) ** 2).sum() ** 0.5)


@dataclass(frozen=True, eq=False)
class FileDescription:
    """A CAD file and its parts.

    Parameters
    ----------
    name : str
        File name, without its folder.
    kind : {"step", "iges", "brep"}
    units : str
        Length unit of the file; everything here is in mm.
    sha256 : str
    parts : tuple of PartDescription
    schema : str
        STEP schema, empty for other files.
    n_tolerances, n_datums, n_dimensions : int
        Semantic PMI in the file: geometric tolerances, datums, dimensional sizes and locations.
    n_tessellated : int
        Triangulated items beside the exact geometry (mostly graphical PMI).
    """

    name: str
    kind: str
    units: str
    sha256: str
    parts: tuple[PartDescription, ...]
    schema: str = ""
    n_tolerances: int = 0
    n_datums: int = 0
    n_dimensions: int = 0
    n_tessellated: int = 0

    @property
    def has_pmi(self) -> bool:
        """True where the file holds semantic tolerances, datums or dimensions."""
        return bool(self.n_tolerances or self.n_datums or self.n_dimensions)
