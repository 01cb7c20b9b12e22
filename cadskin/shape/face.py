"""B-rep faces as plain records, and where a model comes from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cadskin._arrays import frozen

if TYPE_CHECKING:
    from cadskin._typing import Points, Vectors
    from cadskin.shape.ideal import IdealSurface

__all__ = ["Face", "Source"]


@dataclass(frozen=True, eq=False)
class Face:
    """One B-rep face, as the CAD model has it (before any meshing).

    Parameters
    ----------
    index : int
        Zero-based index in the order of cadquery's ``.Faces()``.
    ideal : IdealSurface
        Ideal surface with its parameters.
    area : float
        Exact area [mm²].
    centre : (3,) float
        Centre of area [mm].
    normal : (3,) float
        Unit normal out of the material at the face's middle point (of the plane, for a plane).
    bounds : (2, 3) float
        Bounding box, lowest and highest corner [mm].
    internal : bool
        True where the material lies outside of the surface (a hole, an inner fillet).
    name, colour, step_id
        Name and colour (``#rrggbb``) of the file, and the entity number of the face in a STEP file; None if
        the file has none.
    """

    index: int
    ideal: IdealSurface
    area: float
    centre: Points
    normal: Vectors
    bounds: Points
    internal: bool = False
    name: str | None = None
    colour: str | None = None
    step_id: int | None = None

    def __post_init__(self) -> None:
        """Check and freeze."""
        for key, shape in (("centre", (3,)), ("normal", (3,)), ("bounds", (2, 3))):
            object.__setattr__(self, key, frozen(getattr(self, key), shape=shape, name=key))

    @property
    def kind(self) -> str:
        """Kind of the ideal surface: plane, cylinder, cone, sphere, torus, bspline, ..."""
        return self.ideal.kind

    @property
    def radius(self) -> float | None:
        """Radius [mm] of a cylinder or sphere, minor radius of a torus, None for the others."""
        ideal: Any = self.ideal
        value = getattr(ideal, "radius", None) or getattr(ideal, "minor_radius", None)
        return None if value is None else float(value)


@dataclass(frozen=True)
class Source:
    """Where a nominal model comes from: enough to find and to recognise it again.

    Parameters
    ----------
    kind : str
        ``step``, ``iges``, ``brep``, ``cadquery``, ``build123d``, ``shape`` or ``mesh``.
    path : str or None
        File name, without its folder.
    sha256 : str or None
        Hash of the file.
    units : str
        Length unit of the file; inside it is always mm.
    part : str or None
        Name of the part in the file.
    edge_length : float or None
        Target edge length of the mesh [mm].
    backend : str
        Mesher that made it.
    """

    kind: str = "shape"
    path: str | None = None
    sha256: str | None = None
    units: str = "mm"
    part: str | None = None
    edge_length: float | None = None
    backend: str = "cadskin"
