"""A first pose without a guess: many rotations, few points, the best go on; wrong scans are recognised."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from cadskin._progress import report
from cadskin._random import seed_sequence
from cadskin.errors import StatisticsError
from cadskin.stats._steps import least_squares_step, tukey
from cadskin.stats.rigid import RigidMotion, small_motion
from cadskin.stats.surface_distance import contacts, foot_points

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Progress, RNGLike
    from cadskin.shape import NominalModel

__all__ = ["check_same_part", "coarse_motion", "spread_rotations"]

_UNITS = {"inch": 25.4, "cm": 10.0, "m": 1000.0}
_ROUNDS = ((3, 60), (6, 16), (20, 16))  # steps of the round, poses that go on
_STARTS = 320


def check_same_part(cloud: Points, nominal: NominalModel) -> None:
    """Refuse a scan whose size says that its unit is another one.

    Raises
    ------
    StatisticsError
        The scan is larger or smaller than the part by about the ratio of two units.
    """
    hint = _unit_hint(cloud, nominal)
    if hint:
        raise StatisticsError(hint)
    size, part = _size(cloud), nominal.surface.diagonal
    if not 0.1 < size / part < 3.0:
        raise StatisticsError(
            f"the scan measures {size:.4g} mm across, the part {part:.4g} mm: not a scan of this part "
            "(of a small area of it: give start=RigidMotion(...))"
        )


def _unit_hint(cloud: Points, nominal: NominalModel) -> str:
    """Return what the sizes of scan and part say about a wrong unit; empty where they say nothing."""
    size, part = _size(cloud), nominal.surface.diagonal
    if 0.3 < size / part < 3.0:
        return ""
    for unit, factor in _UNITS.items():
        for ratio, said in ((factor, f"in {unit}"), (1 / factor, f"a part in {unit} against a scan in mm")):
            if 0.6 < size * ratio / part < 1.3:
                return (
                    f"the scan measures {size:.4g} across, the part {part:.4g} mm: it looks like {said}; "
                    f"read it with its unit (factor {ratio:.6g}); scale is never changed here"
                )
    return ""


def _size(cloud: Points) -> float:
    """Diagonal of the box that holds the middle 96 % along each axis: outliers do not count."""
    low, high = np.quantile(cloud, [0.02, 0.98], axis=0)
    return float(np.linalg.norm(high - low))


def spread_rotations(count: int) -> Floats:
    """Return rotations (count, 3, 3) that are spread evenly: super-Fibonacci spirals.

    References
    ----------
    Alexa, CVPR 2022, doi:10.1109/CVPR52688.2022.00811.
    """
    s = np.arange(count) + 0.5
    root, psi = np.sqrt(2.0), 1.533751168755204288118041
    r, big_r = np.sqrt(s / count), np.sqrt(1.0 - s / count)
    alpha, beta = 2 * np.pi * s / root, 2 * np.pi * s / psi
    quaternions = np.stack(
        [r * np.sin(alpha), r * np.cos(alpha), big_r * np.sin(beta), big_r * np.cos(beta)], axis=1
    )
    return np.asarray(Rotation.from_quat(quaternions).as_matrix())


def coarse_motion(
    cloud: Points,
    nominal: NominalModel,
    *,
    probe_radius: float = 0.0,
    rng: RNGLike = 0,
    progress: Progress | None = None,
) -> tuple[RigidMotion, list[str]]:
    """Return a motion near the best one, and notes where other poses fit as well.

    Raises
    ------
    StatisticsError
        The mirrored scan fits far better than the scan itself.
    """
    generator = np.random.default_rng(seed_sequence(rng))
    few = cloud[np.sort(generator.choice(len(cloud), min(400, len(cloud)), replace=False))]
    ranked = _search(few, nominal, probe_radius, progress)
    cost, motion = ranked[0]
    if cost > 0.003 * nominal.surface.diagonal:
        mirrored, _ = _search(few * [-1.0, 1.0, 1.0], nominal, probe_radius, None)[0]
        if mirrored < 0.3 * cost:
            raise StatisticsError(
                f"the scan is mirrored: typical distance {cost:.3g} mm, mirrored {mirrored:.3g} mm; check "
                "the handedness of the scanner's axes, or whether it is the other hand's part"
            )
    return motion, _twins(ranked, nominal)


def _search(
    few: Points, nominal: NominalModel, probe_radius: float, progress: Progress | None
) -> list[tuple[float, RigidMotion]]:
    """Poses and their typical distances [mm], the best first."""
    middle = 0.5 * (nominal.surface.points.min(axis=0) + nominal.surface.points.max(axis=0))
    centre = 0.5 * (few.min(axis=0) + few.max(axis=0)) if len(few) < 50 else np.median(few, axis=0)
    motions = [RigidMotion(turn, middle - turn @ centre) for turn in spread_rotations(_STARTS)]
    ranked = [(np.inf, motion) for motion in motions]
    for round_number, (steps, keep) in enumerate(_ROUNDS):
        report(progress, round_number, len(_ROUNDS))
        ranked = sorted(
            (_settle(few, nominal, motion, steps, probe_radius) for _, motion in ranked),
            key=lambda found: found[0],
        )[:keep]
    return ranked


def _settle(
    few: Points, nominal: NominalModel, motion: RigidMotion, steps: int, probe_radius: float
) -> tuple[float, RigidMotion]:
    """Take some robust steps; the cost is the mean distance, capped at 2 % of the diagonal."""
    centre = nominal.surface.points.mean(axis=0)
    radius = 0.3 * nominal.surface.diagonal
    units = np.array([1, 1, 1, 1 / radius, 1 / radius, 1 / radius])
    cap = 0.02 * nominal.surface.diagonal
    cost = np.inf
    for _ in range(steps + 1):
        points = motion.apply(few)
        where = contacts(nominal, points, exact=False)
        away = points - foot_points(nominal, where)
        length = np.linalg.norm(away, axis=1)
        side = np.einsum("nd,nd->n", away, where.normals)
        cost = float(np.minimum(np.abs(length - probe_radius), cap).mean())
        direction = np.where(
            (length > 1e-9 * radius)[:, None], away / np.maximum(length, 1e-300)[:, None], where.normals
        )
        distance = np.where(side < 0, -length, length)
        direction = direction * np.where(side < 0, -1.0, 1.0)[:, None]
        rest = distance - probe_radius
        scale = max(2.0 * float(np.median(np.abs(rest))), 1e-6 * radius)
        design = np.concatenate([direction, np.cross(points - centre, direction)], axis=1) * units
        step = units * least_squares_step(design, rest, tukey(rest / (3.0 * scale)))
        motion = small_motion(step, centre).after(motion)
        if np.abs(step / units).max() < 1e-4 * radius:
            break
    return cost, motion


def _twins(ranked: list[tuple[float, RigidMotion]], nominal: NominalModel) -> list[str]:
    """Say which other poses fit as well: a part that looks the same from another side."""
    best, motion = ranked[0]
    limit = 1.3 * best + 2e-4 * nominal.surface.diagonal
    others: list[RigidMotion] = []
    for cost, other in ranked[1:]:
        turned = other.after(motion.inverse)
        if (
            cost <= limit
            and turned.angle > 0.1
            and all(turned.after(known.inverse).angle > 0.1 for known in others)
        ):
            others.append(turned)
    if not others:
        return []
    angles = ", ".join(f"{np.degrees(turned.angle):.0f}°" for turned in others[:6])
    return [f"the pose is ambiguous: {len(others)} other poses fit as well, turned by {angles}"]
