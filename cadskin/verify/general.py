"""General tolerances: the tolerance of every face that has none of its own."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cadskin.shape.ideal import Cone, Cylinder, Plane, Sphere, Torus

if TYPE_CHECKING:
    from cadskin.shape import Feature, NominalModel
    from cadskin.spec import Specification, Tolerance

__all__ = ["with_general"]

# A general form tolerance speaks of the features that have that form.
_FORMS: dict[str, tuple[type, ...]] = {
    "flatness": (Plane,),
    "straightness": (Plane, Cylinder, Cone),
    "roundness": (Cylinder, Cone, Sphere, Torus),
    "cylindricity": (Cylinder,),
}


def with_general(spec: Specification, nominal: NominalModel) -> Specification:
    """Return the specification with its general tolerances on each feature that has none of its own.

    Parameters
    ----------
    spec : Specification
        Bound to the part.
    nominal : NominalModel

    Returns
    -------
    Specification
        A general tolerance becomes one tolerance per feature, ``general@plane3``; form tolerances only where
        the feature has that form.
    """
    general = [item for item in spec if _is_general(item)]
    kept = [item for item in spec if not _is_general(item)]
    if spec.default is not None:
        general.append(replace(spec.default, id=spec.default.id or "general"))
    if not general:
        return spec
    taken = {face for item in kept for face in item.feature.faces}
    free = [feature for feature in nominal.features if not taken.intersection(feature.face_indices)]
    added = [_on(item, feature) for item in general for feature in free if _suits(item, feature)]
    return spec.changed(*kept, *added, default=None) if kept or added else spec


def _is_general(tolerance: Tolerance) -> bool:
    return tolerance.scope in ("general", "all_over") and not tolerance.feature.faces


def _suits(tolerance: Tolerance, feature: Feature) -> bool:
    kinds = _FORMS.get(tolerance.type)
    return kinds is None or isinstance(feature.ideal, kinds)


def _on(tolerance: Tolerance, feature: Feature) -> Tolerance:
    selection = tolerance.feature.with_faces(feature.face_indices, kinds=(feature.kind,))
    name = f"{tolerance.id}@{feature.name.replace(' ', '')}"
    return replace(tolerance, id=name, feature=selection, scope="feature")
