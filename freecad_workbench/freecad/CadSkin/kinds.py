"""Characteristics: names, symbols, whether they need datums, the surfaces they have a meaning on."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

__all__ = ["CHARACTERISTICS", "Characteristic", "characteristics_for", "refusal"]

_ROUND = ("Cylinder", "Cone", "Sphere", "Toroid", "SurfaceOfRevolution")
_AXIAL = ("Cylinder", "Cone", "SurfaceOfRevolution")


@dataclass(frozen=True)
class Characteristic:
    """One characteristic of ISO 1101.

    Parameters
    ----------
    name : str
        As cadskin calls it.
    symbol : str
    datums : {"never", "optional", "always"}
    surfaces : tuple of str
        Types of `Part` surfaces that it has a meaning on; empty for all.
    diameter : bool
        Whether its zone can be round.
    """

    name: str
    symbol: str
    datums: str
    surfaces: tuple[str, ...] = ()
    diameter: bool = False


_ROWS = (
    Characteristic("straightness", "⏤", "never", ("Plane", "Cylinder", "Cone", "SurfaceOfExtrusion"), True),
    Characteristic("flatness", "⏥", "never", ("Plane",)),
    Characteristic("roundness", "○", "never", _ROUND),
    Characteristic("cylindricity", "⌭", "never", ("Cylinder",)),
    Characteristic("line_profile", "⌒", "optional"),
    Characteristic("surface_profile", "⌓", "optional"),
    Characteristic("parallelism", "∥", "always", ("Plane", "Cylinder"), True),
    Characteristic("perpendicularity", "⟂", "always", ("Plane", "Cylinder"), True),
    Characteristic("angularity", "∠", "always", ("Plane", "Cylinder"), True),
    Characteristic("position", "⌖", "optional", ("Plane", "Cylinder", "Sphere"), True),
    Characteristic("coaxiality", "◎", "always", _AXIAL, True),
    Characteristic("concentricity", "◎", "always", (*_AXIAL, "Sphere"), True),
    Characteristic("symmetry", "⌯", "always", ("Plane", "Cylinder")),
    Characteristic("circular_runout", "↗", "always", (*_ROUND, "Plane")),
    Characteristic("total_runout", "⌰", "always", ("Cylinder", "Plane")),
)
CHARACTERISTICS: dict[str, Characteristic] = {row.name: row for row in _ROWS}


def characteristics_for(surfaces: Iterable[str]) -> list[str]:
    """Return the names of the characteristics that have a meaning on all these surfaces.

    >>> "cylindricity" in characteristics_for(["Plane"])
    False
    """
    wanted = set(surfaces)
    return [row.name for row in _ROWS if not row.surfaces or wanted <= set(row.surfaces)]


def refusal(name: str, surfaces: Iterable[str]) -> str | None:
    """Return why a characteristic has no meaning on these surfaces; None where it has."""
    row = CHARACTERISTICS.get(name)
    if row is None:
        return f"no characteristic is called {name!r}"
    wrong = sorted(set(surfaces) - set(row.surfaces)) if row.surfaces else []
    return f"{name} has no meaning on a {' or a '.join(wrong)}" if wrong else None
