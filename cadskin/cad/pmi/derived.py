"""Which derived feature a tolerance means, where the file does not say it outright."""

from __future__ import annotations

from collections.abc import Iterable

from cadskin.spec.selection import Derived, FeatureSelection
from cadskin.spec.zone import ZoneShape

__all__ = ["inferred_derived"]

_LOCATING = ("position", "symmetry", "coaxiality", "concentricity")


def inferred_derived(
    leaf: str, shape: ZoneShape, kinds: Iterable[str], feature: FeatureSelection, *, centre: bool
) -> Derived:
    """Return the derived feature.

    Parameters
    ----------
    leaf : str
        The characteristic.
    shape : str
        A diameter zone bounds an axis, a spherical one a point.
    kinds : iterable of str
        Kinds of the surfaces.
    feature : FeatureSelection
    centre : bool
        The file points to a centre of symmetry, or to a size.
    """
    if shape == "spherical_diameter":
        return "centre_point"
    if shape == "diameter":
        return "axis"
    if not (centre or leaf in _LOCATING):
        return "none"
    own = set(kinds)
    count = max(len(feature.step_faces), len(feature.faces))
    if own == {"plane"}:
        return "median_plane" if count > 1 else "none"
    if own == {"sphere"}:
        return "centre_point"
    return "axis" if own and own <= {"cylinder", "cone"} else "none"
