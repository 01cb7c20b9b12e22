"""Learn a manufacturing process from measured parts and give it back as a deviation model.

Measure ten parts, simulate ten thousand: per feature the mean field (with its bow, tilt and lobes named), and
a correlated Gaussian field with a nugget about it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import t as student

from cadskin._arrays import frozen
from cadskin._random import seed_sequence
from cadskin.deviation import DeviationModel, GaussianField, WhiteNoise, correlation
from cadskin.deviation.coordinates import area_frame, surface_coordinates
from cadskin.deviation.given import FromArray
from cadskin.errors import StatisticsError
from cadskin.stats.covariance_fit import KERNEL_NAMES, CovarianceFit, fit_covariance
from cadskin.stats.field_alignment import rigid_basis
from cadskin.stats.population import population

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin._typing import Floats, Ints, RNGLike
    from cadskin.shape import Feature, FeatureRef, NominalModel

__all__ = ["FeatureProcess", "FormTerm", "learn_process", "process_model"]

_SAMPLES = 220  # of a feature that the likelihood looks at


@dataclass(frozen=True)
class FormTerm:
    """One named systematic form of the mean.

    Parameters
    ----------
    name : str
        ``offset``, ``tilt x``, ``tilt y``, ``bow x``, ``bow y``, ``twist`` on any feature; ``lobe 2`` to
        ``lobe 6`` on a cylinder. x and y are the feature's surface coordinates.
    amplitude : float
        Half the range of the form over the feature [mm]; of a lobe the amplitude of its cosine, 0 or more.
    standard_error : float
        [mm].
    significant : bool
        Different from zero at 99 %.
    """

    name: str
    amplitude: float
    standard_error: float
    significant: bool


@dataclass(frozen=True, eq=False)
class FeatureProcess:
    """What the process does to one feature.

    Parameters
    ----------
    feature : Feature
    mean : (k,) float
        Mean deviation at the feature's samples [mm].
    covariance : CovarianceFit
    direction : (3,) float
        Direction of the marks in space, for an anisotropic fit.
    forms : tuple of FormTerm
    n_parts : int
    """

    feature: Feature
    mean: Floats
    covariance: CovarianceFit
    direction: Floats
    forms: tuple[FormTerm, ...]
    n_parts: int

    def __post_init__(self) -> None:
        """Freeze."""
        for key in ("mean", "direction"):
            object.__setattr__(self, key, frozen(getattr(self, key), name=key))


def learn_process(
    parts: Any,
    features: FeatureRef,
    *,
    nominal: NominalModel | None = None,
    kernel: str | Sequence[str] = KERNEL_NAMES,
    aligned: bool = False,
    anisotropic: bool = False,
    rng: RNGLike = 0,
) -> tuple[FeatureProcess, ...]:
    """Learn mean form, standard deviation, correlation length and nugget of features from measured parts.

    Parameters
    ----------
    parts : SkinEnsemble, (n, n_c) array or sequence of parts
        Samples with NaN in any part are left out of the likelihood; of the mean only where no part has them.
    features : selector
        Each feature gets its own process.
    nominal : NominalModel, optional
        For an array.
    kernel : str or sequence of str
    aligned : bool
        The fields went through a best fit (`align_fields`): six motions of each part are missing in them and
        are left out of the likelihood.
    anisotropic : bool
        Look for a direction of marks; planes only.
    rng
        Chooses the samples that the likelihood looks at.

    Raises
    ------
    StatisticsError
        Fewer than three parts, too few complete samples, or anisotropy of a curved feature.
    """
    people = population(parts, nominal=nominal)
    if people.nominal is None:
        raise StatisticsError("learning a process needs the nominal model (nominal=)")
    if people.columns.n < 3:
        raise StatisticsError(f"{people.columns.n} parts; a process needs at least three, ten are better")
    fields = np.asarray(people.columns.read(0, people.columns.d), dtype=np.float64)
    generator = np.random.default_rng(seed_sequence(rng))
    chosen = people.nominal.select(features)
    return tuple(
        _learn_one(people.nominal, one, fields, kernel, aligned, anisotropic, generator) for one in chosen
    )


def process_model(processes: Sequence[FeatureProcess], nominal: NominalModel) -> DeviationModel:
    """Return the deviation model of learned features, for `simulate`; other features stay nominal.

    Raises
    ------
    StatisticsError
        No process.
    """
    if not processes:
        raise StatisticsError("there is no process to make a model of")
    mean = np.zeros(nominal.n_samples)
    terms: list[DeviationModel] = []
    for one in processes:
        mean[one.feature.rows] = one.mean
        fit = one.covariance
        field = GaussianField(
            fit.sigma,
            fit.length,
            fit.kernel,
            anisotropy=fit.anisotropy,
            direction=tuple(float(x) for x in one.direction),  # type: ignore[arg-type]
        )
        terms.append(field.on(one.feature))
        if fit.nugget > 0:
            terms.append(WhiteNoise(fit.nugget).on(one.feature))
    total: DeviationModel = FromArray(mean)
    for term in terms:
        total = total + term
    return total


def _learn_one(
    nominal: NominalModel,
    feature: Feature,
    fields: Floats,
    kernel: str | Sequence[str],
    aligned: bool,
    anisotropic: bool,
    rng: np.random.Generator,
) -> FeatureProcess:
    own = fields[:, feature.rows]
    complete = np.flatnonzero(np.isfinite(own).all(axis=0))
    if len(complete) < 20:
        raise StatisticsError(
            f"{feature.name}: {len(complete)} samples were measured on all parts, at least 20 are needed"
        )
    seen = np.isfinite(own).sum(axis=0)
    if (seen == 0).any():
        raise StatisticsError(f"{feature.name}: {int((seen == 0).sum())} samples were measured on no part")
    mean = np.where(np.isfinite(own), own, 0.0).sum(axis=0) / seen
    few = np.sort(rng.choice(complete, min(_SAMPLES, len(complete)), replace=False))
    places, axes = _places(feature, few, anisotropic)
    removed = rigid_basis(nominal)[feature.rows][few] if aligned else None
    fit = fit_covariance(
        own[:, few], places, kernel=kernel, removed=_full_rank(removed), anisotropic=anisotropic
    )
    direction = np.cos(fit.angle) * axes[0] + np.sin(fit.angle) * axes[1]
    forms = _forms(feature, few, mean[few], fit, places, len(fields))
    return FeatureProcess(feature, mean, fit, direction, forms, len(fields))


def _places(feature: Feature, few: Ints, anisotropic: bool) -> tuple[Floats, Floats]:
    points = feature.points[few]
    if not anisotropic:
        return points, np.eye(3)[:2]
    if feature.kind != "plane":
        raise StatisticsError(
            f"{feature.name} is a {feature.kind}: a direction of marks is learned on planes"
        )
    frame = area_frame(feature.points, feature.triangles, feature.normals[0])
    return (points - frame.centroid) @ frame.axes[:2].T, np.asarray(frame.axes[:2])


def _full_rank(basis: Floats | None) -> Floats | None:
    if basis is None:
        return None
    left, size, _ = np.linalg.svd(basis, full_matrices=False)
    return np.asarray(left[:, size > 1e-9 * size[0]])


def _forms(
    feature: Feature, few: Ints, mean: Floats, fit: CovarianceFit, places: Floats, n: int
) -> tuple[FormTerm, ...]:
    """Generalised least squares of the mean field on named forms."""
    design, names = _form_basis(feature, few)
    covariance = _field_covariance(fit, places) / n
    weighted = np.linalg.solve(covariance, design)
    inner = np.linalg.inv(design.T @ weighted)
    values = inner @ (weighted.T @ mean)
    errors = np.sqrt(np.diag(inner))
    limit = float(student.ppf(0.995, max(n - 1, 1)))
    terms = []
    for k, name in enumerate(names):
        if name.endswith("sine"):
            continue
        value, error = float(values[k]), float(errors[k])
        if name.startswith("lobe"):
            value, error = float(np.hypot(values[k], values[k + 1])), float(max(errors[k], errors[k + 1]))
        terms.append(FormTerm(name, value, error, abs(value) > limit * error))
    return tuple(terms)


def _form_basis(feature: Feature, few: Ints) -> tuple[Floats, list[str]]:
    coordinates = surface_coordinates(feature)
    half = np.maximum(np.ptp(coordinates, axis=0) / 2, 1e-12)
    middle = (coordinates.max(axis=0) + coordinates.min(axis=0)) / 2
    x, y = ((coordinates[few] - middle) / half).T
    if feature.kind == "cylinder" and feature.radius is not None:
        angle = coordinates[few, 0] / feature.radius
        columns, names = [np.ones_like(x), y, 2 * y * y - 1], ["offset", "tilt y", "bow y"]
        for lobe in range(2, 7):
            columns += [np.cos(lobe * angle), np.sin(lobe * angle)]
            names += [f"lobe {lobe}", f"lobe {lobe} sine"]
        return np.stack(columns, axis=1), names
    columns = [np.ones_like(x), x, y, 2 * x * x - 1, 2 * y * y - 1, x * y]
    return np.stack(columns, axis=1), ["offset", "tilt x", "tilt y", "bow x", "bow y", "twist"]


def _field_covariance(fit: CovarianceFit, places: Floats) -> Floats:
    scaled = places
    if fit.anisotropy != 1.0:
        turn = np.array([[np.cos(fit.angle), -np.sin(fit.angle)], [np.sin(fit.angle), np.cos(fit.angle)]])
        scaled = (places @ turn) / [fit.anisotropy, 1.0]
    distance = np.linalg.norm(scaled[:, None] - scaled[None], axis=2)
    full = fit.sigma**2 * correlation(distance, fit.length, fit.kernel)
    return full + max(fit.nugget**2, 1e-8 * fit.sigma**2) * np.eye(len(full))
