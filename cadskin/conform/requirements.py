"""Requirements: tolerances taken apart into tests that depend on as few blocks of the law as possible."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cadskin.conform.flat import FlatPlaces, flat_places
from cadskin.conform.pca_zone import pca_zone
from cadskin.conform.sizes import SizeLimits, size_limits
from cadskin.errors import AssociationError, CadskinError, SpecificationError
from cadskin.shape.ideal import Plane
from cadskin.skin.weld import prepare_weld, weld
from cadskin.verify.contacts import target_contact
from cadskin.verify.extraction import MadePart
from cadskin.verify.part_size import has_size_limits
from cadskin.verify.tolerances import evaluate

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cadskin._typing import Floats, Vectors
    from cadskin.conform.blocks import Blocks
    from cadskin.conform.policy import Conformity
    from cadskin.shape import Feature, NominalModel
    from cadskin.spec import Specification, Tolerance

__all__ = [
    "Requirement",
    "Unsupported",
    "datum_features",
    "made_part",
    "moved_part",
    "nominal_part",
    "requirements_of",
    "value_of",
    "welded_part",
]


@dataclass(frozen=True, eq=False)
class Requirement:
    """A tolerance, or one member of it, and the blocks that its value depends on.

    Parameters
    ----------
    tolerance : Tolerance or SizeLimits
        Of one member where members are judged one by one.
    policy : Conformity
    limit : float
        [mm].
    blocks : frozenset of int
        Of the toleranced features and of the datum features.
    own : frozenset of int
        Of the toleranced features.
    feature : Feature or None
        The feature, where there is one.
    flat : FlatPlaces or None
        The quick test of a flatness.
    """

    tolerance: Tolerance | SizeLimits
    policy: Conformity
    limit: float
    blocks: frozenset[int]
    own: frozenset[int]
    feature: Feature | None = None
    flat: FlatPlaces | None = None

    @property
    def in_pca_zone(self) -> bool:
        """Whether its value is the width of the paper's zone."""
        return self.policy.zone == "pca" and self.tolerance.type == "flatness"

    @property
    def label(self) -> str:
        """What messages call it."""
        where = self.tolerance.feature.text()
        return f"{self.tolerance.id} ({self.tolerance.type} {self.limit:g} on {where})"


@dataclass(frozen=True)
class Unsupported:
    """A tolerance that cannot be evaluated, and why."""

    tolerance: str
    reason: str


def nominal_part(nominal: NominalModel) -> MadePart:
    """Return the nominal part as if it had been made; made parts after its pattern share what it knows."""
    part = MadePart(nominal.surface, nominal)
    return replace(part, shared=part.geometry)


def made_part(nominal: NominalModel, deviation: Floats, *, like: MadePart | None = None) -> MadePart:
    """Return the part of a deviation field (n_c,) without the slides inside of faces.

    Every vertex moves by the shortest displacement that realises its deviations; `cadskin.weld` then slides
    the neighbours along their faces, which changes no value to first order. With a part to be ``like``,
    what follows from the nominal model is not worked out again.
    """
    particular = prepare_weld(nominal).constraints.particular
    moved = nominal.surface.points + (particular @ deviation).reshape(-1, 3)
    return replace(
        nominal_part(nominal) if like is None else like, surface=nominal.surface.with_points(moved)
    )


def welded_part(nominal: NominalModel, deviation: Floats, *, like: MadePart | None = None) -> MadePart:
    """Return the part of a deviation field (n_c,) as `cadskin.weld` makes it; ``like`` as in `made_part`."""
    return moved_part(nominal, weld(nominal, deviation), like=like)


def moved_part(nominal: NominalModel, displacement: Vectors, *, like: MadePart | None = None) -> MadePart:
    """Return the part whose vertices moved by a displacement (n, 3) [mm]; ``like`` as in `made_part`."""
    surface = nominal.surface.with_points(nominal.surface.points + displacement)
    return replace(nominal_part(nominal) if like is None else like, surface=surface)


def value_of(requirement: Requirement, part: MadePart, spec: Specification) -> float:
    """Return the value [mm] of a requirement on a made part; infinity where it cannot be evaluated there."""
    asked = requirement.tolerance
    if requirement.in_pca_zone:
        return pca_zone(part.points(asked.feature.faces)).width
    try:
        return asked.value_on(part) if isinstance(asked, SizeLimits) else evaluate(asked, part, spec).value
    except AssociationError:  # this sample, not the specification: no association exists for it
        return float("inf")


def requirements_of(
    nominal: NominalModel,
    spec: Specification,
    blocks: Blocks,
    policies: dict[str, Conformity],
    *,
    like: MadePart | None = None,
) -> tuple[tuple[Requirement, ...], tuple[Unsupported, ...]]:
    """Return the requirements of a bound specification, and what cannot be evaluated on the nominal part.

    Raises
    ------
    SpecificationError
        A tolerance that no simulated part can meet: its zone is narrower than the floating point can
        resolve, or wider than the part, or its datum is the feature itself.
    """
    part = nominal_part(nominal) if like is None else like
    found: list[Requirement] = []
    unsupported = [Unsupported(item.entity, item.reason) for item in spec.unresolved]
    for tolerance in spec:
        try:
            pieces = list(_pieces(tolerance, part, spec, blocks, policies[tolerance.id]))
            for piece in pieces:
                evaluate(piece.tolerance, part, spec)  # type: ignore[arg-type]  # no size is among them
        except CadskinError as error:
            unsupported.append(Unsupported(tolerance.id, str(error)))
            continue
        if tolerance.value is None:
            unsupported.append(Unsupported(tolerance.id, "it has no value"))
            continue
        for piece in pieces:
            _refuse_meaningless(piece, nominal)
        found.extend(pieces)
    for dimension in filter(has_size_limits, spec.dimensions):
        try:
            limits = size_limits(dimension, nominal)
            limits.value_on(part)
        except CadskinError as error:
            unsupported.append(Unsupported(dimension.id, str(error)))
            continue
        own = blocks.touched(_features(nominal, dimension.feature.faces))
        piece = Requirement(limits, policies[dimension.id], limits.value, own, own)
        _refuse_meaningless(piece, nominal)
        found.append(piece)
    return tuple(found), tuple(unsupported)


def _pieces(
    tolerance: Tolerance, pattern: MadePart, spec: Specification, blocks: Blocks, policy: Conformity
) -> Iterator[Requirement]:
    members = tolerance.feature.members
    alone = not tolerance.datums and tolerance.zone.combined is not True
    if len(members) > 1 and alone and tolerance.characteristic.group in ("form", "profile"):
        for faces in members:
            selection = replace(tolerance.feature, faces=faces, groups=())
            yield _piece(replace(tolerance, feature=selection), pattern, spec, blocks, policy)
        return
    yield _piece(tolerance, pattern, spec, blocks, policy)


def _piece(
    tolerance: Tolerance, pattern: MadePart, spec: Specification, blocks: Blocks, policy: Conformity
) -> Requirement:
    features = _features(pattern.nominal, tolerance.feature.faces)
    if not features:
        raise SpecificationError(f"tolerance {tolerance.id}: it is on no face of the part")
    own = blocks.touched(features)
    datums = blocks.touched(datum_features(pattern, tolerance, spec))
    flat = None
    minimum = policy.zone == "minimum"
    if (
        minimum
        and tolerance.type == "flatness"
        and len(features) == 1
        and isinstance(features[0].ideal, Plane)
    ):
        flat = flat_places(features[0].points, np.asarray(features[0].faces[0].normal))
    return Requirement(
        tolerance,
        policy,
        float(tolerance.value or 0.0),
        own | datums,
        own,
        features[0] if len(features) == 1 else None,
        flat,
    )


def _features(nominal: NominalModel, faces: tuple[int, ...]) -> tuple[Feature, ...]:
    found = {nominal.feature_of(face).id: nominal.feature_of(face) for face in faces}
    return tuple(found.values())


def datum_features(pattern: MadePart, tolerance: Tolerance, spec: Specification) -> tuple[Feature, ...]:
    """Return the features that establish the datums of a tolerance, by themselves or by targets on them."""
    found: dict[int, Feature] = {}
    for letter in tolerance.datums.letters:
        datum = spec.datum(letter)
        own = list(_features(pattern.nominal, datum.feature.faces))
        for target in datum.targets:
            own += _features(pattern.nominal, target.feature.faces)
            if target.origin is not None and not target.movable:
                own.append(target_contact(pattern, letter, target).feature)
        found.update((feature.id, feature) for feature in own)
    return tuple(found.values())


def _refuse_meaningless(piece: Requirement, nominal: NominalModel) -> None:
    if piece.policy.method == "none":
        return
    size = float(np.abs(nominal.surface.points).max(initial=0.0))
    floor = 64 * np.finfo(np.float64).eps * max(size, nominal.surface.diagonal)
    if piece.limit <= floor:
        raise SpecificationError(
            f"{piece.label}: a zone of {piece.limit:.3g} mm is narrower than coordinates of {size:.4g} mm "
            f"can resolve ({floor:.2g} mm); give a wider tolerance"
        )
    if piece.limit >= nominal.surface.diagonal:
        raise SpecificationError(
            f"{piece.label}: the zone is wider than the part ({nominal.surface.diagonal:.4g} mm); is the "
            "unit of the tolerance right?"
        )
