"""Correlated Gaussian fields: the multi-Gaussian random deviations of a surface."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cadskin.deviation._linear import LinearSampler
from cadskin.deviation._parameters import array_of, choice, is_listed, positive, vector_of
from cadskin.deviation._patch_fields import SampledPlaces
from cadskin.deviation._patches import PatchPoints, patch_points
from cadskin.deviation._routes import METHODS, METRICS, make_field, make_graded_field
from cadskin.deviation._shares import needs_numbers, number_or_share
from cadskin.deviation.base import MM, DeviationModel
from cadskin.deviation.kernels import correlation, kernel_code
from cadskin.deviation.registry import register
from cadskin.errors import CadskinWarning, DeviationError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats
    from cadskin.deviation._patch_fields import PatchField
    from cadskin.deviation.samplers import Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = ["GaussianField", "PatchwiseSampler"]


@register
@dataclass(frozen=True, eq=False, repr=False)
class GaussianField(DeviationModel):
    """A Gaussian random field with a standard deviation and a correlation length in mm.

    The field lives on smooth patches: it is continuous over tangent edges (a fillet and its neighbours),
    and independent across sharp edges and through walls.

    Parameters
    ----------
    sigma : float, (n_c,) float or callable
        Standard deviation [mm], > 0. An array gives it per feature sample; a callable gets the sample points
        (n_c, 3) [mm] and returns it per sample. ``"from tolerance"`` or ``"0.2 of tolerance"``: a share of a
        tolerance zone that `DeviationModel.resolved` tells (an eighth by default).
    length : float, (n_c,) float or callable
        Correlation length l [mm], > 0, in the convention of `cadskin.deviation.kernels`: the squared
        exponential is exp(-d²/(2 l²)), the Matern kernels are functions of sqrt(2 nu) d / l. An array gives
        it per feature sample, a callable gets the sample points (n_c, 3) [mm]: the field is then made by the
        Laplace-Beltrami operator with a varying coefficient (``metric`` surface).
    kernel : str
        ``squared_exponential`` (smooth), ``matern52``, ``matern32``, ``whittle``, ``exponential`` (rough).
    metric : str
        ``euclidean``: d is the distance in space (on a plane there is no other). ``surface``: the field is
        made by the Laplace-Beltrami operator, so that only the way along the surface counts; in the plane it
        has the same kernel. ``auto``: euclidean, but surface for a patch that comes back to itself within
        a length (a thin wall with round edges). ``geodesic`` is refused on curved patches, see Raises.
    method : str
        ``auto``, or one route: ``dense``, ``karhunen_loeve``, ``grid``, ``two_level``, ``vecchia``.
    anisotropy : float
        Correlation length along ``direction`` over ``length``: 3 for marks three times as long as wide.
    direction : (3,) float
        Direction in space of the longer marks, for an ``anisotropy`` other than 1; euclidean metric only.

    Raises
    ------
    DeviationError
        A parameter without meaning, or a covariance that is not positive definite: the squared exponential
        over geodesic distance is none on a curved surface.

    Warns
    -----
    CadskinWarning
        The length is more than 100 times the part (the field acts as a shift), or the mesh has fewer than
        four vertices per correlation length.

    References
    ----------
    Zhang et al. 2013, doi:10.1177/0954405412466987, section on random deviations, "multi-Gaussian" (without a
    covariance); Rasmussen, Williams: Gaussian processes for machine learning, MIT Press 2006, section 4.2.

    Examples
    --------
    >>> GaussianField(sigma=0.01, length=15)
    GaussianField(sigma=0.01 mm, length=15 mm)
    """

    name: ClassVar[str] = "field"
    sigma: Any = field(metadata=MM)
    length: Any = field(metadata=MM)
    kernel: str = "squared_exponential"
    metric: str = "auto"
    method: str = "auto"
    anisotropy: float = 1.0
    direction: tuple[float, float, float] = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Check the parameters."""
        object.__setattr__(self, "sigma", _checked_sigma(self.sigma, self))
        object.__setattr__(self, "length", _checked_length(self.length, self))
        kernel_code(self.kernel)
        choice(self.metric, METRICS, "metric", self)
        choice(self.method, METHODS, "method", self)
        object.__setattr__(self, "anisotropy", positive(self.anisotropy, "anisotropy", "", self))
        object.__setattr__(self, "direction", _checked_direction(self.direction))
        if self.anisotropy != 1.0 and self.metric == "surface":
            raise DeviationError("GaussianField: anisotropy needs metric='euclidean', not 'surface'")
        on_surface = self.metric in ("auto", "surface") and self.method == "auto" and self.anisotropy == 1.0
        if not isinstance(self.length, float) and not on_surface:
            raise DeviationError(
                "GaussianField: a varying length needs metric='surface', no method or anisotropy"
            )

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Choose a route for each smooth patch and set it up."""
        needs_numbers(self)
        patches = patch_points(nominal, features)
        lengths = _length_of_samples(self.length, nominal)
        _warn_of_scale(self, nominal, patches, lengths)
        scale = _sigma_of_samples(self.sigma, nominal)
        if not isinstance(self.length, float):
            graded = [make_graded_field(patch, lengths, self.kernel) for patch in patches]
            return PatchwiseSampler(patches, graded, scale)
        metric, stretched = self.metric, patches
        if self.anisotropy != 1.0:
            metric = "euclidean" if metric == "auto" else metric
            stretched = [patch.compressed(self.direction, self.anisotropy) for patch in patches]
        fields = [make_field(patch, self.length, self.kernel, metric, self.method) for patch in stretched]
        return PatchwiseSampler(patches, fields, scale)

    def parameters(self) -> dict[str, Any]:
        """Return the parameters; a callable ``sigma`` or ``length`` cannot be written to a file."""
        for key in ("sigma", "length"):
            if callable(getattr(self, key)):
                raise DeviationError(
                    f"GaussianField: {key} is a Python function and cannot be written; give an array"
                )
        return super().parameters()

    def __str__(self) -> str:
        called = [key for key in ("sigma", "length") if callable(getattr(self, key))]
        if not called:
            return super().__str__()
        text = str(replace(self, **dict.fromkeys(called, 1.0)))  # type: ignore[arg-type]
        for key in called:
            function = getattr(getattr(self, key), "__name__", "function")
            text = text.replace(f"{key}=1 mm", f"{key}={function}(points)")
        return text

    __repr__ = __str__


class PatchwiseSampler(LinearSampler):
    """Independent unit fields on the patches, spread to the samples."""

    def __init__(
        self, patches: Sequence[PatchPoints], unit_fields: Sequence[PatchField], scale: Floats
    ) -> None:
        starts = np.concatenate([[0], np.cumsum([len(patch.points) for patch in patches])]).astype(int)
        latents = np.concatenate([[0], np.cumsum([unit.latent for unit in unit_fields])]).astype(int)
        super().__init__(len(scale), int(latents[-1]), int(starts[-1]))
        self.fields = tuple(unit_fields)
        self.nodes_of = [slice(a, b) for a, b in pairwise(starts)]
        self.latent_of = [slice(a, b) for a, b in pairwise(latents)]
        self.places_of = [_sampled_places(patch, scale) for patch in patches]
        unused = np.ones(len(scale), dtype=bool)
        for patch in patches:
            unused[patch.samples] = False
        self.unused = np.flatnonzero(unused)
        self.notes = tuple(unit.note for unit in unit_fields)

    def write(self, noise: NDArray[np.float32], fields: NDArray[np.float32], out: Floats) -> None:
        """Sample every patch from its own part of the noise."""
        out[:, self.unused] = 0.0
        parts = zip(self.fields, self.nodes_of, self.latent_of, self.places_of, strict=True)
        for unit, nodes, latent, places in parts:
            unit.write(noise[:, latent], fields[nodes], places, out)


def _sampled_places(patch: PatchPoints, scale: Floats) -> SampledPlaces:
    return SampledPlaces(
        patch.samples.astype(np.uint32), patch.point_of_sample.astype(np.uint32), scale[patch.samples]
    )


def _checked_sigma(sigma: Any, owner: object) -> Any:
    if callable(sigma):
        return sigma
    if not is_listed(sigma):
        return number_or_share(sigma, "sigma", owner)
    values = array_of(sigma, (None,), "sigma", "GaussianField")
    if (values < 0).any() or not (values > 0).any():
        raise DeviationError("GaussianField: sigma must be 0 or more everywhere and more than 0 somewhere")
    return values


def _checked_length(length: Any, owner: object) -> Any:
    if callable(length):
        return length
    if not is_listed(length):
        return positive(length, "length", "mm", owner)
    values = array_of(length, (None,), "length", "GaussianField")
    if not (values > 0).all():
        raise DeviationError(f"GaussianField: length must be greater than 0, got {values.min():.6g} mm")
    return values


def _checked_direction(direction: Any) -> tuple[float, float, float]:
    values = vector_of(direction, "direction", "", "GaussianField")
    if not any(values):
        raise DeviationError(
            f"GaussianField: direction must be three numbers, not all zero, got {direction!r}"
        )
    return values


def _sigma_of_samples(sigma: float | Floats | Callable[..., Any], nominal: NominalModel) -> Floats:
    if callable(sigma):
        points = nominal.surface.points[nominal.samples.vertex_ids]
        return _sigma_of_samples(_checked_sigma(np.asarray(sigma(points), dtype=np.float64), None), nominal)
    values = np.asarray(sigma, dtype=np.float64)
    if values.ndim and len(values) != nominal.n_samples:
        raise DeviationError(
            f"GaussianField: sigma has {len(values)} values, the part has {nominal.n_samples} feature samples"
        )
    return np.broadcast_to(values, (nominal.n_samples,))


def _length_of_samples(length: float | Floats | Callable[..., Any], nominal: NominalModel) -> Floats:
    if callable(length):
        points = nominal.surface.points[nominal.samples.vertex_ids]
        length = np.asarray(length(points), dtype=np.float64)
        return _length_of_samples(_checked_length(length, None), nominal)
    values = np.asarray(length, dtype=np.float64)
    if values.ndim and len(values) != nominal.n_samples:
        raise DeviationError(
            f"GaussianField: length has {len(values)} values, "
            f"the part has {nominal.n_samples} feature samples"
        )
    return np.broadcast_to(values, (nominal.n_samples,))


def _warn_of_scale(
    model: GaussianField, nominal: NominalModel, patches: Sequence[PatchPoints], lengths: Floats
) -> None:
    shortest, longest = float(lengths.min(initial=np.inf)), float(lengths.max(initial=0.0))
    diagonal = nominal.surface.diagonal
    if longest > 100 * diagonal > 0:
        warnings.warn(
            f"{model}: the length is more than 100 times the part ({diagonal:.6g} mm): "
            "the field acts as a shift of every patch",
            CadskinWarning,
            stacklevel=3,
        )
    edge = max((patch.edge_length for patch in patches), default=0.0)
    if edge > shortest / 3:
        kept = 0.5 * (1.0 + float(correlation(np.array(edge), shortest, model.kernel)))
        warnings.warn(
            f"{model}: the mesh has fewer than four vertices per correlation length (median edge {edge:.3g} "
            f"mm); midway between vertices only {kept:.0%} of the variance is left; "
            f"use edge_length={shortest / 4:.3g} or a larger length",
            CadskinWarning,
            stacklevel=3,
        )
