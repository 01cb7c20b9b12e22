"""Registration of a measured part to the nominal model: the alignment is an argument, never a hidden default.

Each step finds the nearest nominal surface of every point, then moves the part rigidly so that the signed
distances fulfil a named criterion. Scale is never changed.

References
----------
.. [1] Chen, Medioni: Object modelling by registration of multiple range images, Image Vision Comput. 10
   (1992), doi:10.1016/0262-8856(92)90066-C (point to surface along the normal).
.. [2] Beaton, Tukey: The fitting of power series, Technometrics 16 (1974), doi:10.2307/1267936.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from cadskin._arrays import frozen
from cadskin._progress import report
from cadskin.errors import CadskinWarning, StatisticsError
from cadskin.stats._search import z_order
from cadskin.stats._steps import chebyshev_step, free_directions, least_squares_step, tukey
from cadskin.stats.coarse import check_same_part, coarse_motion
from cadskin.stats.population import feature_rows
from cadskin.stats.rigid import RigidMotion, small_motion
from cadskin.stats.surface_distance import Contacts, contacts, signed_distances

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from cadskin._typing import Bools, Floats, Points, Progress, RNGLike
    from cadskin.shape import FeatureRef, NominalModel

__all__ = ["Alignment", "Registration", "register"]

Alignment: TypeAlias = Literal["none", "datum_frame", "least_squares", "minimum_zone", "robust"]
ALIGNMENTS: tuple[Alignment, ...] = ("none", "datum_frame", "least_squares", "minimum_zone", "robust")
_REACH = 4.685  # Tukey's constant: 95 % efficiency for Gaussian noise
_STILL = (
    0.1  # share of the scatter: after a smaller move every point still meets the same triangle, or its twin
)


@dataclass(frozen=True, eq=False)
class Registration:
    """A measured part brought to the nominal model.

    Parameters
    ----------
    motion : RigidMotion
        Takes measured points to the frame of the nominal model.
    alignment : str
        Name of the criterion.
    covariance : (6, 6) float
        Of ``[tx, ty, tz, rx, ry, rz]`` [mm, rad] about ``centre``, from the scatter of the distances taken as
        independent. Form deviation is not independent from point to point: it moves a best fit by more
        than this (see ``form_covariance``).
    form_covariance : (6, 6) float
        The same with the distances of one B-rep face taken as fully dependent (sandwich over faces): what the
        form of the faces does to the fit. Needs many faces to be exact.
    centre : (3,) float
        [mm].
    free : (f, 6) float
        Motions that the points do not determine (turning a shaft), as unit vectors with rotations in radii
        of gyration; they were left as they were.
    scale : float
        Robust standard deviation of the distances [mm].
    inliers : float
        Share of the points that count.
    notes : tuple of str
        What the user should know: free motions, symmetry, poses that fit as well.
    """

    motion: RigidMotion
    alignment: str
    covariance: Floats
    form_covariance: Floats
    centre: Points
    free: Floats
    scale: float
    inliers: float
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Freeze."""
        for key in ("covariance", "form_covariance", "centre", "free"):
            object.__setattr__(self, key, frozen(getattr(self, key), name=key))


@dataclass(frozen=True, eq=False)
class _State:
    """Points at their present place, where they meet the surface, and how they count."""

    points: Points
    where: Contacts
    distances: Floats
    usable: Bools
    weights: Floats
    scale: float


def register(
    points: ArrayLike,
    nominal: NominalModel,
    *,
    alignment: Alignment,
    features: FeatureRef | Sequence[FeatureRef] | None = None,
    start: RigidMotion | Literal["search"] | None = None,
    probe_radius: float = 0.0,
    rng: RNGLike = 0,
    progress: Progress | None = None,
) -> Registration:
    """Bring measured points into the frame of the nominal model.

    Parameters
    ----------
    points : (n, 3) array_like of float
        Measured points [mm]; rows with NaN are left out.
    nominal : NominalModel
    alignment : {"none", "datum_frame", "least_squares", "minimum_zone", "robust"}
        "none": the points are in the frame already (``start`` as given). "datum_frame": the features in their
        order, each by least squares, takes the motions that the ones before left free; what a position or
        orientation tolerance refers to. "least_squares": least sum of squares, gross outliers removed.
        "minimum_zone": least largest distance, outliers removed. "robust": Tukey's biweight. The last three
        are best fits: they take off what a position or parallelism tolerance is about.
    features : selector, or for "datum_frame" the sequence of datum features (primary first)
        Best fits use only these features; default all.
    start : RigidMotion, "search" or None
        First guess; None starts from the points as they are, "search" looks through all rotations. A motion
        also says that the size of the scan is right: a scan of a small part of the surface.
    probe_radius : float
        The points are centres of a probe ball of this radius [mm]: they lie that far outside of the part.
    rng
        For the search and the choice of points in its early stages.
    progress : callable, optional

    Returns
    -------
    Registration

    Raises
    ------
    StatisticsError
        Too few points, a scan of another size (inch, metre), a mirrored scan, or one of another part.
    """
    if alignment not in ALIGNMENTS:
        raise StatisticsError(f"alignment must be one of {', '.join(ALIGNMENTS)}, got {alignment!r}")
    if alignment == "datum_frame" and features is None:
        raise StatisticsError("alignment 'datum_frame' needs features=[primary, secondary, tertiary]")
    if not (np.isfinite(probe_radius) and probe_radius >= 0):
        raise StatisticsError(f"probe_radius must be zero or more [mm], got {probe_radius}")
    cloud = _cloud(points)
    notes: list[str] = []
    if alignment != "none" and not isinstance(start, RigidMotion):
        check_same_part(cloud, nominal)
    if start == "search":
        motion, notes = coarse_motion(cloud, nominal, probe_radius=probe_radius, rng=rng, progress=progress)
    else:
        motion = RigidMotion() if start is None else start
    groups = _groups(nominal, alignment, features)
    where = None
    if alignment != "none":
        motion, where = _refine(cloud, nominal, motion, alignment, groups, probe_radius, progress)
    state = _state(nominal, motion.apply(cloud), probe_radius, groups, where=where)
    if alignment != "none":
        _check_fit(state, nominal)
    return _described(state, nominal, motion, alignment, notes)


def _cloud(points: ArrayLike) -> Points:
    cloud = np.asarray(getattr(points, "points", points), dtype=np.float64)
    if cloud.ndim != 2 or cloud.shape[1] != 3:
        raise StatisticsError(f"measured points are an (n, 3) array, got shape {cloud.shape}")
    cloud = cloud[np.isfinite(cloud).all(axis=1)]
    if len(np.unique(cloud[:1000], axis=0)) < 6:
        raise StatisticsError(f"{len(cloud)} points, fewer than 6 of them different, cannot determine a pose")
    return np.ascontiguousarray(cloud[np.argsort(z_order(cloud), kind="stable")])


def _groups(
    nominal: NominalModel, alignment: Alignment, features: FeatureRef | Sequence[FeatureRef] | None
) -> list[Bools]:
    """Faces (as masks over the B-rep faces) of each stage of the alignment."""
    count = len(nominal.faces)
    if features is None:
        return [np.ones(count, dtype=bool)]
    sequence = alignment == "datum_frame" and isinstance(features, (list, tuple))
    stages: list[Any] = list(features) if sequence else [features]  # type: ignore[arg-type]
    masks = []
    for stage in stages:
        rows = feature_rows(nominal, stage)
        mask = np.zeros(count, dtype=bool)
        mask[np.unique(nominal.samples.face_ids[rows])] = True
        masks.append(mask)
    return masks


def _refine(
    cloud: Points,
    nominal: NominalModel,
    motion: RigidMotion,
    alignment: Alignment,
    groups: list[Bools],
    probe_radius: float,
    progress: Progress | None,
) -> tuple[RigidMotion, Contacts | None]:
    """Robust steps on few points first, then on all, at last the criterion that was asked for.

    The contacts of all points come back too where they still hold at the last pose.
    """
    everything = [np.ones(len(nominal.faces), dtype=bool)]
    stride = max(1, len(cloud) // 5000)
    stages: list[tuple[Points, Alignment, list[Bools], int]] = [
        (cloud[::stride], "robust", everything, 60),
        (cloud, "robust", everything if alignment == "datum_frame" else groups, 6),
    ]
    if alignment != "robust":
        stages.append((cloud, alignment, groups, 12))
    where: Contacts | None = None
    for done, (points, criterion, stage_groups, limit) in enumerate(stages):
        report(progress, done, len(stages))
        known = where if points is cloud and done == 2 else None
        motion, where = _iterate(points, nominal, motion, criterion, stage_groups, probe_radius, limit, known)
    report(progress, len(stages), len(stages))
    return motion, where


def _iterate(
    points: Points,
    nominal: NominalModel,
    motion: RigidMotion,
    criterion: Alignment,
    groups: list[Bools],
    probe_radius: float,
    limit: int,
    where: Contacts | None = None,
) -> tuple[RigidMotion, Contacts | None]:
    """Take steps until they are far below the scatter; contacts are sought anew only after a real move."""
    centre, radius = _middle(nominal)
    reach = np.inf
    for _ in range(limit):
        state = _state(nominal, motion.apply(points), probe_radius, groups, reach, where)
        reach = 100.0 * state.scale + probe_radius  # far points are outliers: they need no foot any more
        if state.usable.sum() < 6:
            raise StatisticsError(
                f"only {int(state.usable.sum())} of {len(points)} points lie near the "
                "features of the alignment; give a better start, or start='search'"
            )
        step = _step(state, criterion, groups, centre, radius)
        motion = small_motion(step, centre).after(motion)
        moved = float(np.abs(step * np.array([1, 1, 1, radius, radius, radius])).max())
        where = state.where if moved < _STILL * state.scale else None
        # far below what the scatter of the points lets the pose be known to
        if moved < 1e-9 * radius + 0.1 * state.scale / np.sqrt(state.usable.sum()):
            break
    return motion, where


def _state(
    nominal: NominalModel,
    points: Points,
    probe_radius: float,
    groups: list[Bools],
    limit: float = np.inf,
    where: Contacts | None = None,
) -> _State:
    where = contacts(nominal, points, limit=limit) if where is None else where
    distances = signed_distances(nominal, points, where) - probe_radius
    chosen = np.logical_or.reduce(groups)[where.faces]
    usable = chosen & ~where.on_edge & np.isfinite(distances)
    own = np.abs(distances[usable])
    scale = 1.4826 * float(np.median(own)) if len(own) else 0.0
    scale = max(scale, 1e-9 * nominal.surface.diagonal)
    weights = np.where(usable, tukey(distances / (_REACH * scale)), 0.0)
    return _State(points, where, distances, usable, weights, scale)


def _design(state: _State, rows: Bools, centre: Points) -> Floats:
    normals = state.where.normals[rows]
    return np.concatenate([normals, np.cross(state.points[rows] - centre, normals)], axis=1)


def _step(state: _State, criterion: Alignment, groups: list[Bools], centre: Points, radius: float) -> Floats:
    units = np.array([1, 1, 1, 1 / radius, 1 / radius, 1 / radius])
    kept = state.weights > 0
    if criterion == "datum_frame":
        return _datum_step(state, groups, centre, units)
    design = _design(state, kept, centre) * units
    distances = state.distances[kept]
    if criterion == "minimum_zone":
        return units * chebyshev_step(design, distances)
    weights = state.weights[kept] if criterion == "robust" else np.ones(len(distances))
    return units * least_squares_step(design, distances, weights)


def _datum_step(state: _State, groups: list[Bools], centre: Points, units: Floats) -> Floats:
    """Primary, secondary, tertiary: each datum moves only along what the ones before left free."""
    step = np.zeros(6)
    basis = np.eye(6)
    for mask in groups:
        rows = (state.weights > 0) & mask[state.where.faces]
        if not rows.any():
            raise StatisticsError("a datum feature has no measured point near it")
        design = _design(state, rows, centre) * units
        rest = state.distances[rows] + design @ step
        step = step + basis @ least_squares_step(design @ basis, rest, np.ones(len(rest)))
        basis = basis @ free_directions(design @ basis)
        if not basis.shape[1]:
            break
    return units * step


def _middle(nominal: NominalModel) -> tuple[Points, float]:
    """Centre of the part and its radius of gyration [mm]."""
    points = nominal.surface.points
    centre = points.mean(axis=0)
    return centre, float(np.sqrt(((points - centre) ** 2).sum(axis=1).mean()))


def _check_fit(state: _State, nominal: NominalModel) -> None:
    """Refuse a scan that does not lie on this part."""
    limit = 0.01 * nominal.surface.diagonal
    near = float((np.abs(np.nan_to_num(state.distances, nan=np.inf)) < limit).mean())
    if state.scale > limit or near < 0.4:
        raise StatisticsError(
            f"the scan does not fit the part: typical distance {state.scale:.3g} mm, {100 * near:.0f} % of "
            f"the points within {limit:.3g} mm (1 % of the part's diagonal); another part, "
            "mostly outliers, or a bad start (start='search' looks through all rotations)"
        )


def _described(
    state: _State,
    nominal: NominalModel,
    motion: RigidMotion,
    alignment: Alignment,
    notes: list[str],
) -> Registration:
    centre, radius = _middle(nominal)
    units = np.array([1, 1, 1, 1 / radius, 1 / radius, 1 / radius])
    kept = state.weights > 0
    design = _design(state, kept, centre) * units
    distances = state.distances[kept]
    free = free_directions(design).T
    covariance, form = _covariances(design, distances, state.where.faces[kept])
    if len(free) and alignment != "none":
        notes = [*notes, f"{len(free)} motions are not determined by the points and were left as they were"]
        warnings.warn(CadskinWarning(f"ambiguous pose: {notes[-1]} (a symmetric part)"), stacklevel=3)
    turn = np.diag(units)
    return Registration(
        motion=motion,
        alignment=alignment,
        covariance=turn @ covariance @ turn,
        form_covariance=turn @ form @ turn,
        centre=centre,
        free=free,
        scale=state.scale,
        inliers=float(kept.mean()),
        notes=tuple(notes),
    )


def _covariances(design: Floats, distances: Floats, faces: np.ndarray) -> tuple[Floats, Floats]:
    """Covariance of a least-squares step: distances independent, and dependent within each face."""
    inverse = np.linalg.pinv(design.T @ design, rcond=1e-8, hermitian=True)
    rest = distances - design @ (inverse @ (design.T @ distances))
    spread = float(rest @ rest) / max(len(rest) - 6, 1)
    pulls = np.zeros((int(faces.max()) + 1, 6))
    np.add.at(pulls, faces, design * rest[:, None])
    count = len(np.unique(faces))
    factor = count / (count - 1) if count > 1 else 1.0
    return np.asarray(spread * inverse), np.asarray(factor * inverse @ (pulls.T @ pulls) @ inverse)
