"""Deviations that come from outside: a function, an array, a finite element result, an ideal surface."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cadskin.deviation._crossings import distance_along_normals
from cadskin.deviation._parameters import array_of, finite, is_listed
from cadskin.deviation._tangent import form_sampler
from cadskin.deviation.base import MM, DeviationModel
from cadskin.deviation.registry import register
from cadskin.deviation.samplers import FixedSampler
from cadskin.errors import DeviationError
from cadskin.shape.ideal import Cone, Cylinder, IdealSurface, Plane, Sphere, Torus

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors
    from cadskin.deviation.samplers import Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = ["FromArray", "FromFE", "FromFunction", "Towards", "distance_along_normals"]


@register
@dataclass(frozen=True, eq=False, repr=False)
class FromFunction(DeviationModel):
    """A deviation given by a function of the nominal points.

    Parameters
    ----------
    function : callable
        Gets points (k, 3) [mm] and unit normals (k, 3) of one feature, returns deviations (k,) [mm].

    Raises
    ------
    DeviationError
        What the function returns is no (k,) array of finite numbers; the message names the feature.
    """

    name: ClassVar[str] = "function"
    function: Callable[[Points, Vectors], Any]

    def __post_init__(self) -> None:
        """Check that it can be called."""
        if not callable(self.function):
            raise DeviationError(f"FromFunction: function must be a function, got {self.function!r}")

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Call the function once for each feature."""
        return form_sampler(nominal, features, self._on)

    def _on(self, feature: Feature) -> Floats:
        found = np.asarray(self.function(feature.points, feature.normals), dtype=np.float64)
        if found.shape not in ((), (feature.n_points,)) or not np.isfinite(found).all():
            raise DeviationError(
                f"FromFunction: on {feature.name} the function returned an array of shape {found.shape} "
                f"or NaN; it must return {feature.n_points} finite numbers"
            )
        return found

    def parameters(self) -> dict[str, Any]:
        """Refuse: a Python function cannot be written to a file."""
        raise DeviationError("FromFunction cannot be written to a file; sample it and use FromArray")

    def __str__(self) -> str:
        return f"FromFunction({getattr(self.function, '__name__', 'function')})"

    __repr__ = __str__

    def __hash__(self) -> int:
        return hash(self.function)


@register
@dataclass(frozen=True, eq=False, repr=False)
class FromArray(DeviationModel):
    """Deviations given as numbers, one per feature sample.

    Parameters
    ----------
    values : (n_c,) float or (N, n_c) float
        [mm]. Of several rows each sample takes one at random.
    """

    name: ClassVar[str] = "array"
    values: Floats = field(metadata=MM)

    def __post_init__(self) -> None:
        """Check and freeze."""
        rows = is_listed(self.values) and len(self.values) > 0 and is_listed(self.values[0])
        shape = (None, None) if rows else (None,)
        object.__setattr__(self, "values", array_of(self.values, shape, "values", self))
        if not self.values.size:
            raise DeviationError("FromArray: values is empty")

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Check the length against the part."""
        del features
        if self.values.shape[-1] != nominal.n_samples:
            raise DeviationError(
                f"FromArray: {self.values.shape[-1]} values, the part has {nominal.n_samples} feature samples"
            )
        return FixedSampler(self.values) if self.values.ndim == 1 else _ResamplingSampler(self.values)

    def __str__(self) -> str:
        return f"FromArray(<{' x '.join(map(str, self.values.shape))} values> mm)"

    __repr__ = __str__


class _ResamplingSampler(FixedSampler):
    """A row drawn at random, with replacement."""

    def __init__(self, rows: Floats) -> None:
        super().__init__(rows[0])
        self.rows = rows

    def fill(self, seeds: Sequence[np.random.SeedSequence], out: Floats) -> None:
        """Draw one row for each seed."""
        for target, seed in zip(out, seeds, strict=False):
            target[:] = self.rows[np.random.default_rng(seed).integers(len(self.rows))]


@register
@dataclass(frozen=True, eq=False, repr=False)
class FromFE(DeviationModel):
    """Displacements of the vertices of the nominal mesh, as a finite element run gives them: d = n . u.

    Parameters
    ----------
    displacements : (n_points, 3) float
        [mm].
    """

    name: ClassVar[str] = "fe"
    displacements: Points = field(metadata=MM)

    def __post_init__(self) -> None:
        """Check and freeze."""
        checked = array_of(self.displacements, (None, 3), "displacements", self)
        object.__setattr__(self, "displacements", checked)

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Project on the normals."""
        del features
        if len(self.displacements) != nominal.surface.n_points:
            raise DeviationError(
                f"FromFE: {len(self.displacements)} displacements, "
                f"the mesh has {nominal.surface.n_points} points"
            )
        moved = self.displacements[nominal.samples.vertex_ids]
        return FixedSampler(np.einsum("ij,ij->i", nominal.samples.normals, moved))

    def __str__(self) -> str:
        return f"FromFE(<{len(self.displacements)} displacements> mm)"

    __repr__ = __str__


_SURFACES = {cls.kind: cls for cls in (Plane, Cylinder, Cone, Sphere, Torus)}


@register
@dataclass(frozen=True, eq=False, repr=False)
class Towards(DeviationModel):
    """The distance along the normals to another ideal surface, or a share of it (morphing).

    Parameters
    ----------
    target : Plane, Cylinder, Cone, Sphere or Torus of `cadskin.shape`
        Or a table ``{kind = "sphere", centre = [..], radius = ..}`` as in specification files.
    share : float
        1: the surface becomes the target; 0.5: half way.

    Raises
    ------
    DeviationError
        A normal does not meet the target; the message names the feature.

    References
    ----------
    Zhang et al. 2013, doi:10.1177/0954405412466987, figure 3: h_i is the distance from p_i to its image q_i
    along the vertex normal.
    """

    name: ClassVar[str] = "towards"
    target: IdealSurface
    share: float = 1.0

    def __post_init__(self) -> None:
        """Make the surface from its table."""
        if isinstance(self.target, Mapping):
            table = dict(self.target)
            kind = table.pop("kind", None)
            if kind not in _SURFACES:
                raise DeviationError(
                    f"Towards: kind of target must be one of {', '.join(_SURFACES)}, got {kind!r}"
                )
            object.__setattr__(self, "target", _SURFACES[kind](**table))
        if type(self.target) not in _SURFACES.values():
            raise DeviationError(
                f"Towards: target must be one of {', '.join(_SURFACES)}, got {type(self.target).__name__}"
            )
        object.__setattr__(self, "share", finite(self.share, "share", "", self))

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Intersect the normals with the target."""
        return form_sampler(nominal, features, self._on)

    def _on(self, feature: Feature) -> Floats:
        found = distance_along_normals(feature.points, feature.normals, self.target)
        if np.isnan(found).any():
            raise DeviationError(
                f"Towards: {int(np.isnan(found).sum())} normals of {feature.name} do not meet the "
                f"{self.target.kind}; restrict the model with .on(...) or move the target"
            )
        return self.share * found

    def parameters(self) -> dict[str, Any]:
        """Return the surface as a table."""
        table: dict[str, Any] = {"kind": self.target.kind}
        for item in fields(self.target):
            value = getattr(self.target, item.name)
            table[item.name] = value.tolist() if isinstance(value, np.ndarray) else value
        return {"target": table} | ({} if self.share == 1.0 else {"share": self.share})

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Towards) and self.parameters() == other.parameters()

    def __hash__(self) -> int:
        return hash(str(self))
