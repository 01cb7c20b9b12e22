"""The datum system of a tolerance on a made part, and the nominal model placed in it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.shape.association import Pose, frame_about
from cadskin.shape.ideal import Cylinder, Plane, Sphere
from cadskin.spec.datums import DatumModifier, DatumSystem
from cadskin.spec.modifiers import MATERIAL_MODIFIERS
from cadskin.verify.contacts import target_contact
from cadskin.verify.datums import DatumFeature, DatumFrame, Standard, establish
from cadskin.verify.group_datums import DatumGroup, GroupSurface, establish_groups
from cadskin.verify.part_patches import WORLD, nominal_patch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin._typing import Points, Vectors
    from cadskin.shape import Feature
    from cadskin.spec import DatumReference, Specification, Tolerance
    from cadskin.verify.boundary import Requirement
    from cadskin.verify.extraction import MadePart

__all__ = ["Placement", "mobile_references", "oriented_placement", "placement", "requirement_of"]


@dataclass(frozen=True, eq=False)
class Placement:
    """Where the nominal model lies with respect to the datums of a made part.

    Parameters
    ----------
    actual, nominal : DatumFrame or None
        The datum system on the made part and on the nominal model; None without datums.
    rotation : (3, 3) float
        Nominal to actual.
    frame : Pose
        The actual datum frame: the pose whose free motions are optimised.
    free : tuple of str
    indicated : ((3,) float, bool), optional
        From an orientation plane indicator: direction of its datum on the nominal part, and whether the
        planes of the zone are normal to it (else they hold it).
    """

    actual: DatumFrame | None
    nominal: DatumFrame | None
    frame: Pose
    nominal_frame: Pose
    free: tuple[str, ...]
    indicated: tuple[Vectors, bool] | None = None

    @classmethod
    def everywhere(cls) -> Placement:
        """Return the placement without datums: every motion is free."""
        identity = Pose(np.zeros(3), np.eye(3), np.zeros(2))
        return cls(None, None, identity, identity, ("tx", "ty", "tz", "rx", "ry", "rz"))

    def with_translations(self) -> Placement:
        """Return a copy whose datums hold rotations only."""
        return replace(self, free=tuple(dict.fromkeys(("tx", "ty", "tz", *self.free))))

    def in_frame(self, point: Points) -> Points:
        """Return a nominal point (3,) in coordinates of the frame."""
        return self.nominal_frame.axes.T @ (np.asarray(point) - self.nominal_frame.origin)

    def turned(self, direction: Vectors) -> Vectors:
        """Return a nominal direction (3,) in coordinates of the frame."""
        return self.nominal_frame.axes.T @ np.asarray(direction)

    def zone_normal(self, axis: Vectors) -> Vectors | None:
        """Return the normal (3,) of two planes around a line of direction ``axis``, on the nominal part."""
        if self.indicated is None:
            return None
        direction, along = self.indicated
        normal = direction if along else np.cross(axis, direction)
        length = float(np.linalg.norm(normal))
        if length < 1e-9 or (along and abs(float(axis @ direction)) > 1e-6):
            raise SpecificationError("the orientation plane leaves the zone of this axis open")
        return np.asarray(normal / length)

    @property
    def certified(self) -> bool:
        """Whether the datums are proved."""
        return self.actual is None or self.actual.certified

    def operations(self) -> tuple[str, ...]:
        """Return the operations of the datum system."""
        return () if self.actual is None else self.actual.operations()


def placement(part: MadePart, tolerance: Tolerance, spec: Specification, standard: Standard) -> Placement:
    """Establish the datums of a tolerance on the part and on its nominal model.

    Raises
    ------
    SpecificationError
        A datum without feature, or of a kind that is not supported.
    """
    fixed = _fixed_references(tolerance)
    if not fixed:
        return Placement.everywhere()
    if any(_is_group(part, reference, spec) for reference in fixed):
        groups = [_group(part, reference, spec) for reference in fixed]
        nominal, actual = part.memory.recall(
            ("groups", tuple(reference.text() for reference in fixed), standard),
            [surface.made for group in groups for surface in group.surfaces],
            lambda: establish_groups(groups, standard=standard),
        )
        return Placement(actual, nominal, _aligned(actual, nominal), nominal.pose, actual.free)
    made = [_datum_feature(part, reference, spec, actual=True) for reference in fixed]
    actual = establish(made, standard=standard, memory=part.memory)

    def of_nominal() -> DatumFrame:
        ideal = [_datum_feature(part, reference, spec, actual=False) for reference in fixed]
        return establish(ideal, standard=standard)

    faces = tuple(spec.datum(letter).feature.faces for one in fixed for letter in one.letters)
    key = ("datums", tuple(reference.text() for reference in fixed), faces, standard)
    nominal = part.geometry.of_nominal(key, of_nominal)
    return Placement(actual, nominal, _aligned(actual, nominal), nominal.pose, actual.free)


def oriented_placement(
    part: MadePart, tolerance: Tolerance, spec: Specification, standard: Standard
) -> Placement:
    """Return the placement of a tolerance whose zone an orientation plane turns (ISO 1101).

    The datum of the indicator joins the datum system for orientation only, where it is not in it.

    Raises
    ------
    SpecificationError
        An inclined plane, or one whose datum leaves it free to turn.
    """
    indicator = tolerance.indicator("orientation_plane")
    if indicator is None or tolerance.zone.shape != "width":
        return placement(part, tolerance, spec, standard)
    if indicator.relation not in ("parallel", "perpendicular"):
        raise SpecificationError(
            f"tolerance {tolerance.id}: an orientation plane {indicator} is not supported"
        )
    if indicator.direction is not None:
        place = placement(part, tolerance, spec, standard)
        direction, axial = np.array(indicator.direction), False
    else:
        only = (DatumModifier("ORIENTATION"),)
        added = [
            replace(reference, modifiers=(*reference.modifiers, *only))
            for reference in indicator.datums.references
            if reference.label not in tolerance.datums.labels
        ]
        system = DatumSystem((*tolerance.datums.references, *added))
        place = placement(part, replace(tolerance, datums=system), spec, standard)
        datum = spec.datum(indicator.datums.letters[0]).feature
        ideal = part.features(datum.faces)[0].ideal
        axial = not isinstance(ideal, Plane)
        direction = np.asarray(ideal.axis if axial else ideal.normal)  # type: ignore[union-attr]
    if {"rx", "ry", "rz"} & set(place.free):
        raise SpecificationError(
            f"tolerance {tolerance.id}: its datums and the orientation plane {indicator} leave the zone free "
            "to turn; add a datum"
        )
    along = axial == (indicator.relation == "perpendicular")
    return replace(place, indicated=(direction / np.linalg.norm(direction), along))


def _is_group(part: MadePart, reference: DatumReference, spec: Specification) -> bool:
    """Tell whether a compartment needs the datums of groups: targets, or surfaces of several kinds."""
    features: list[Feature] = []
    for letter in reference.letters:
        datum = spec.datum(letter)
        if datum.targets:
            return True
        features.extend(part.features(datum.feature.faces))
    if not features or (len(features) == 1 and isinstance(features[0].ideal, Plane | Cylinder | Sphere)):
        return False
    planes = all(isinstance(feature.ideal, Plane) for feature in features)
    opposite = planes and len(features) == 2 and _facing(features) < -0.999
    return not (opposite or (planes and _parallel(features)) or _coaxial(features))


def _facing(features: Sequence[Feature]) -> float:
    return float(features[0].faces[0].normal @ features[1].faces[0].normal)


def _group(part: MadePart, reference: DatumReference, spec: Specification) -> DatumGroup:
    """Return the surfaces of a compartment, or the contacts of its targets, on the nominal and made part."""
    surfaces: list[tuple[Feature, Points, Points]] = []
    targets = False
    for letter in reference.letters:
        datum = spec.datum(letter)
        if datum.targets:
            targets = True
            found = [target_contact(part, letter, target) for target in datum.targets]
            surfaces += [(one.feature, one.nominal, one.made) for one in found]
            continue
        for feature in part.features(datum.feature.faces):
            faces = feature.face_indices
            surfaces.append((feature, part.nominal_points(faces), part.points(faces)))
    if not surfaces:
        raise SpecificationError(
            f"datum {reference.label} has no feature; bind the specification to the part first"
        )
    return DatumGroup(
        reference.label,
        tuple(
            GroupSurface(nominal_patch(part, feature, WORLD), nominal, made, feature.internal)
            for feature, nominal, made in surfaces
        ),
        targets,
        any(modifier.name == "ORIENTATION" for modifier in reference.modifiers),
    )


def requirement_of(reference: DatumReference) -> Requirement | None:
    """Return the material requirement of a datum reference: of its compartment, or of all its letters."""
    words = [{modifier.name for modifier in reference.modifiers}]
    words += [{modifier.name for modifier in one} for one in reference.element_modifiers]
    found = [{MATERIAL_MODIFIERS[word] for word in some if word in MATERIAL_MODIFIERS} for some in words]
    stated = found[0] or (set.intersection(*found[1:]) if found[1:] else set())
    if not stated and any(found):
        raise SpecificationError(
            f"datum {reference.label}: a material requirement on some letters only is not supported"
        )
    return None if not stated else "MMR" if "MMR" in stated else "LMR"


def mobile_references(tolerance: Tolerance) -> tuple[DatumReference, ...]:
    """Return the datum references with a material requirement: boundaries, not associations."""
    return tuple(item for item in tolerance.datums.references if requirement_of(item) is not None)


def _fixed_references(tolerance: Tolerance) -> tuple[DatumReference, ...]:
    """Return the datum references that are associated.

    One that follows a material requirement takes what the associated ones before it leave; the boundary then
    limits the rest.
    """
    return tuple(item for item in tolerance.datums.references if requirement_of(item) is None)


def _aligned(actual: DatumFrame, nominal: DatumFrame) -> Pose:
    """Turn and shift the actual frame along its free motions so that it starts at the nominal one."""
    axes, origin = np.array(actual.axes), np.array(actual.origin)
    if "rx" in actual.free:  # a point: nothing is turned
        axes = np.array(nominal.axes)
    elif "rz" in actual.free:
        axes = frame_about(actual.axes[:, 2], nominal.axes[:, 0])
        if np.linalg.det(nominal.axes) < 0:
            axes[:, 1] *= -1
    for k, name in enumerate(("tx", "ty", "tz")):
        if name in actual.free:
            origin = origin + ((nominal.origin - origin) @ axes[:, k]) * axes[:, k]
    return Pose(origin, np.ascontiguousarray(axes), np.zeros(2))


def _datum_feature(
    part: MadePart, reference: DatumReference, spec: Specification, *, actual: bool
) -> DatumFeature:
    faces: list[int] = []
    for letter in reference.letters:
        datum = spec.datum(letter)
        if not datum.feature.faces:
            raise SpecificationError(
                f"datum {letter} has no feature; bind the specification to the part first"
            )
        faces.extend(datum.feature.faces)
    features = part.features(faces)
    take = part.points if actual else part.nominal_points
    found = feature_of_datum(reference.label, features, take)
    only = any(modifier.name == "ORIENTATION" for modifier in reference.modifiers)
    return replace(found, orientation_only=only)


def feature_of_datum(label: str, features: Sequence[Feature], take: object) -> DatumFeature:
    """Return a datum feature of one surface, or of two opposite parallel planes."""
    points = [take(feature.face_indices) for feature in features]  # type: ignore[operator]
    first = features[0]
    if len(features) == 2 and all(isinstance(feature.ideal, Plane) for feature in features):
        facing = float(first.faces[0].normal @ features[1].faces[0].normal)
        if facing < -0.999:
            apart = (features[1].faces[0].centre - first.faces[0].centre) @ first.faces[0].normal
            return DatumFeature(
                label, "width", points[0], bool(apart > 0), first.faces[0].normal, None, points[1]
            )
    if len(features) > 1 and _parallel(features):
        return _planes(label, features, points)
    cloud = np.concatenate(points)
    if isinstance(first.ideal, Plane):
        return DatumFeature(label, "plane", cloud, hint=first.faces[0].normal)
    if isinstance(first.ideal, Cylinder):
        sizes = [feature.ideal.radius for feature in features]  # type: ignore[union-attr]
        radii = np.repeat(sizes, [len(p) for p in points]) if len(set(sizes)) > 1 else None
        return DatumFeature(label, "cylinder", cloud, first.internal, first.ideal.axis, radii=radii)
    if isinstance(first.ideal, Sphere):
        return DatumFeature(label, "sphere", cloud, first.internal)
    raise SpecificationError(
        f"datum {label} is a {first.kind}; plane, cylinder, sphere and width are supported"
    )


def _parallel(features: Sequence[Feature]) -> bool:
    """Tell whether features are planes that face the same way (a common datum A-B)."""
    normal = features[0].faces[0].normal
    return all(
        isinstance(feature.ideal, Plane) and float(feature.faces[0].normal @ normal) > 1 - 1e-9
        for feature in features
    )


def _planes(label: str, features: Sequence[Feature], points: list[Points]) -> DatumFeature:
    """Return the common datum of one plane in pieces, or of planes at different heights."""
    normal = np.asarray(features[0].faces[0].normal)
    heights = np.array([float((f.ideal.origin - features[0].ideal.origin) @ normal) for f in features])  # type: ignore[union-attr]
    heights = np.where(np.abs(heights) < 1e-6, 0.0, heights)
    levels = np.repeat(heights, [len(part) for part in points]) if heights.any() else None
    return DatumFeature(label, "plane", np.concatenate(points), hint=normal, levels=levels)


def _coaxial(features: Sequence[Feature]) -> bool:
    """Tell whether features are cylinders of one axis (a common datum A-B)."""
    first = features[0].ideal
    return isinstance(first, Cylinder) and all(
        isinstance(feature.ideal, Cylinder)
        and feature.internal == features[0].internal
        and np.linalg.norm(np.cross(feature.ideal.axis, first.axis)) < 1e-9
        and np.linalg.norm(np.cross(feature.ideal.origin - first.origin, first.axis)) < 1e-6
        for feature in features
    )
