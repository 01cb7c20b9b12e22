"""What moves the middle of a feature: limits of a diameter, and profile zones that are unequally disposed.

A size with limits (± or a fit of ISO 286) on cylinders is met when every local two-point size lies within
them, as `cadskin verify` evaluates it. As a requirement its value is the largest distance of a local size
from the middle of the limits, and its limit half of their width. A process aims at the middle: each
cylinder gets a normal offset of its size with a twelfth of the width as its standard deviation. In the same
way it aims at the middle of a profile zone that does not lie half on each side of the surface (UZ).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cadskin.deviation import Randomised, SizeOffset
from cadskin.errors import AssociationError, SpecificationError
from cadskin.shape.ideal import Cylinder
from cadskin.spec.datums import DatumSystem
from cadskin.verify.part_size import evaluate_size, has_size_limits

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cadskin._typing import Floats
    from cadskin.deviation import DeviationModel
    from cadskin.shape import Feature, NominalModel
    from cadskin.spec import Dimension, FeatureSelection, Specification
    from cadskin.verify.extraction import MadePart

__all__ = ["SizeLimits", "mean_offsets", "middle_models", "size_limits"]

_FAR = 0.1  # of the radius: limits that lie further away belong to something else
_SPREADS = 12.0  # standard deviations of the offset in the width of the limits: Cp = 2, the rest is for form


@dataclass(frozen=True)
class SizeLimits:
    """Both limits of a size, with the attributes of a tolerance that a requirement needs.

    Parameters
    ----------
    dimension : Dimension
    lower, upper : float
        [mm].
    """

    dimension: Dimension
    lower: float
    upper: float

    type = "size"
    datums = DatumSystem()

    @property
    def id(self) -> str:
        """Id of the dimension."""
        return self.dimension.id

    @property
    def feature(self) -> FeatureSelection:
        """The cylinders."""
        return self.dimension.feature

    @property
    def middle(self) -> float:
        """Middle of the limits [mm]."""
        return 0.5 * (self.lower + self.upper)

    @property
    def value(self) -> float:
        """Half of their width [mm]."""
        return 0.5 * (self.upper - self.lower)

    def value_on(self, part: MadePart) -> float:
        """Return the largest distance of a local size from the middle [mm]."""
        found = evaluate_size(self.dimension, part).details
        return float(max(found["largest"] - self.middle, self.middle - found["smallest"]))

    def offset(self, feature: Feature) -> float:
        """Return the deviation [mm] that brings a cylinder to the middle of the limits."""
        outward = self.middle * (1.0 if self.dimension.name == "radius" else 0.5) - _radius(feature)
        return -outward if feature.internal else outward

    @property
    def spread(self) -> float:
        """Standard deviation of the offset along the normal [mm]."""
        width = self.upper - self.lower
        return width / _SPREADS * (1.0 if self.dimension.name == "radius" else 0.5)


def size_limits(dimension: Dimension, nominal: NominalModel) -> SizeLimits:
    """Return the limits of a size.

    Raises
    ------
    SpecificationError, AssociationError
        One limit only, equal limits, no cylinder, or no full turn of it: no local size can be evaluated.
    """
    if dimension.lower is None or dimension.upper is None:
        raise SpecificationError(f"dimension {dimension.id}: a size with one limit only is not supported")
    if not dimension.upper > dimension.lower:
        raise SpecificationError(f"dimension {dimension.id}: its limits are equal ({dimension.upper:g} mm)")
    limits = SizeLimits(dimension, dimension.lower, dimension.upper)
    features = _features(dimension, nominal)
    if not features or not all(isinstance(feature.ideal, Cylinder) for feature in features):
        raise SpecificationError(
            f"dimension {dimension.id}: the size of anything but cylinders is not supported"
        )
    for feature in features:
        offset = limits.offset(feature)
        if abs(offset) > _FAR * _radius(feature):
            raise SpecificationError(
                f"dimension {dimension.id}: {limits.lower:g} to {limits.upper:g} mm is not the size of "
                f"{feature.name}, radius {_radius(feature):g} mm"
            )
    return limits


def middle_models(spec: Specification, nominal: NominalModel, *, scale: float = 1.0) -> list[DeviationModel]:
    """Return what moves the middle of features: random offsets of sizes, offsets to shifted profile zones.

    Parameters
    ----------
    spec : Specification
        Bound to the part.
    nominal : NominalModel
    scale : float
        Standard deviations are multiplied by it.
    """
    found: list[DeviationModel] = []
    sized = list(_narrowest(spec, nominal))
    for feature, limits in sized:
        law = round(limits.offset(feature), 9) + 0.0, float(f"{scale * limits.spread:.6g}")
        found.append(Randomised(SizeOffset(1.0), "norm", law).on(feature.face_indices[0]))
    for feature, offset in _shifted(spec, nominal, sized):
        found.append(SizeOffset(round(offset, 9)).on(feature.face_indices[0]))
    return found


def mean_offsets(spec: Specification, nominal: NominalModel) -> Floats:
    """Return the deviation (n_c,) [mm] that brings sizes and shifted zones to their middle."""
    values = np.zeros(nominal.n_samples)
    sized = list(_narrowest(spec, nominal))
    for feature, limits in sized:
        values[feature.rows] = limits.offset(feature)
    for feature, offset in _shifted(spec, nominal, sized):
        values[feature.rows] = offset
    return values


def _shifted(
    spec: Specification, nominal: NominalModel, sized: list[tuple[Feature, SizeLimits]]
) -> Iterator[tuple[Feature, float]]:
    """Yield each feature whose narrowest profile zone is unequally disposed, and its shift [mm].

    Features whose size has limits go by those.
    """
    by_size = {feature.id for feature, _ in sized}
    found: dict[int, tuple[float, Feature, float]] = {}
    for tolerance in spec:
        if tolerance.type not in ("surface_profile", "line_profile") or not tolerance.value:
            continue
        for face in tolerance.feature.faces:
            feature = nominal.feature_of(face)
            if feature.id not in found or tolerance.value < found[feature.id][0]:
                found[feature.id] = (tolerance.value, feature, tolerance.zone.offset(tolerance.value))
    for value, feature, offset in found.values():
        if feature.id not in by_size and abs(offset) > 1e-9 * value:
            yield feature, offset


def _narrowest(spec: Specification, nominal: NominalModel) -> Iterator[tuple[Feature, SizeLimits]]:
    """Yield each cylinder with the narrowest limits that it has."""
    found: dict[int, tuple[Feature, SizeLimits]] = {}
    for dimension in filter(has_size_limits, spec.dimensions):
        try:
            limits = size_limits(dimension, nominal)
            evaluate_size(dimension, _nominal_part(nominal))
        except (SpecificationError, AssociationError):  # listed as unsupported by `requirements_of`
            continue
        for feature in _features(dimension, nominal):
            if feature.id not in found or limits.value < found[feature.id][1].value:
                found[feature.id] = (feature, limits)
    yield from found.values()


def _nominal_part(nominal: NominalModel) -> MadePart:
    from cadskin.verify.extraction import MadePart

    return MadePart(nominal.surface, nominal)


def _features(dimension: Dimension, nominal: NominalModel) -> tuple[Feature, ...]:
    found = {nominal.feature_of(face).id: nominal.feature_of(face) for face in dimension.feature.faces}
    return tuple(found.values())


def _radius(feature: Feature) -> float:
    return float(feature.ideal.radius) if isinstance(feature.ideal, Cylinder) else 0.0
