"""Profile of a line and of a surface (ISO 1101, ISO 1660): distances from the nominal surface.

Value: the smallest width of the zone that holds all points, ``2 max|d - offset|`` (UZ: the offset is given),
or ``max d - min d`` where the offset is free (OZ).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.verify.evaluation import Evaluation, active_of
from cadskin.verify.zones import free_columns, solve

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin._typing import Floats, Points, Vectors
    from cadskin.shape.association import Patch, Pose
    from cadskin.shape.association.models import ClosestPoints

__all__ = ["bezier_closest", "profile"]


def profile(
    parts: Sequence[tuple[Patch, Points]],
    frame: Pose,
    *,
    free: Sequence[str] = (),
    offset_free: bool = False,
    certified: bool = True,
    characteristic: str = "profile of a surface",
    operations: tuple[str, ...] = (),
    limit: float | None = None,
) -> Evaluation:
    """Evaluate a profile tolerance.

    Parameters
    ----------
    parts : sequence of (Patch, (n, 3) float)
        Nominal surfaces in the nominal frame, each with its points in the world; the sign of a patch points
        out of the material, its offset is that of an unequal zone (UZ).
    frame : Pose
        The nominal frame in the world: exact where datums hold it, else a start.
    free : sequence of str
        Motions that are left free, ``tx`` ... ``rz``.
    offset_free : bool
        OZ: the zone may be offset as a whole.
    certified : bool
        Of the datum system.
    limit : float, optional
    """
    mode = "zone" if offset_free else "symmetric"
    columns = free_columns(free)
    found = solve(list(parts), frame, columns, "zone" if mode == "zone" else "symmetric", what="profile")
    value = found.value if offset_free else 2.0 * found.value
    return Evaluation(
        characteristic=characteristic,
        value=value,
        quantity="max d - min d (OZ)" if offset_free else "2 max|d - offset|",
        certified=found.certified and certified,
        n_points=len(found.distances),
        limit=limit,
        zone={
            "kind": "two equidistant surfaces",
            "width": value,
            "origin": found.pose.origin,
            "axes": found.pose.axes,
        },
        active=active_of(found),
        operations=(*operations, "extraction: the given points", "filtration: none"),
        details={
            "unique": found.unique,
            "above": float(found.distances.max()),
            "below": float(-found.distances.min()),
        },
    )


class _Bezier:
    """A rational Bezier patch with derivatives, vectorised over parameters."""

    def __init__(self, control: Floats, weights: Floats) -> None:
        self.homogeneous = np.concatenate([control * weights[..., None], weights[..., None]], axis=-1)

    def derivatives(self, u: Floats, v: Floats) -> tuple[Points, ...]:
        """Return S, Su, Sv, Suu, Suv, Svv at parameters (n,)."""
        net = self.homogeneous
        rows = [_bernstein(net.shape[0] - 1, u, order) for order in range(3)]
        columns = [_bernstein(net.shape[1] - 1, v, order) for order in range(3)]

        def part(a: int, b: int) -> Floats:
            return np.asarray(np.einsum("ni,ijk,nj->nk", rows[a], net, columns[b]))

        full, weight = [part(a, b)[:, :3] for a, b in _ORDERS], [part(a, b)[:, 3:] for a, b in _ORDERS]
        w, wu, wv, wuu, wuv, wvv = weight
        s = full[0] / w
        su, sv = (full[1] - wu * s) / w, (full[2] - wv * s) / w
        suu = (full[3] - 2 * wu * su - wuu * s) / w
        suv = (full[4] - wu * sv - wv * su - wuv * s) / w
        svv = (full[5] - 2 * wv * sv - wvv * s) / w
        return s, su, sv, suu, suv, svv


_ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))


def _bernstein(degree: int, t: Floats, order: int) -> Floats:
    """Return the Bernstein polynomials or their derivatives (n, degree + 1)."""
    if order > degree:
        return np.zeros((len(t), degree + 1))
    if order:
        lower = _bernstein(degree - 1, t, order - 1)
        padded = np.zeros((len(t), degree + 1))
        padded[:, :-1] -= lower
        padded[:, 1:] += lower
        return degree * padded
    from math import comb

    k = np.arange(degree + 1)
    binomial = np.array([comb(degree, int(i)) for i in k], dtype=np.float64)
    return np.asarray(binomial * t[:, None] ** k * (1 - t)[:, None] ** (degree - k))


def bezier_closest(
    control: Floats, *, weights: Floats | None = None, outward: Vectors | None = None
) -> ClosestPoints:
    """Return the closest-point function of a (rational) Bezier patch; outside of it the polynomial goes on.

    Parameters
    ----------
    control : (m, n, 3) float
        Control points.
    weights : (m, n) float, optional
    outward : (3,) float, optional
        The side that counts as outside of the material; by default that of Su x Sv.

    Returns
    -------
    callable
        (n, 3) points -> signed distances (n,), unit normals (n, 3).
    """
    from scipy.spatial import cKDTree

    control = np.asarray(control, dtype=np.float64)
    surface = _Bezier(control, np.ones(control.shape[:2]) if weights is None else np.asarray(weights, float))
    grid = np.linspace(0.0, 1.0, 41)
    gu, gv = (array.ravel() for array in np.meshgrid(grid, grid, indexing="ij"))
    tree = cKDTree(surface.derivatives(gu, gv)[0])
    middle = surface.derivatives(np.array([0.5]), np.array([0.5]))
    normal = np.cross(middle[1][0], middle[2][0])
    sign = 1.0 if outward is None or normal @ np.asarray(outward) >= 0 else -1.0

    def closest(points: Points) -> tuple[Floats, Vectors]:
        _, nearest = tree.query(points)
        u, v = _foot_points(surface, np.asarray(points), gu[nearest], gv[nearest])
        s, su, sv, *_ = surface.derivatives(u, v)
        normals = sign * np.cross(su, sv)
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        return np.einsum("ij,ij->i", points - s, normals), normals

    return closest


def _foot_points(surface: _Bezier, points: Points, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Newton on the two orthogonality conditions, all points at once."""
    for _ in range(30):
        s, su, sv, suu, suv, svv = surface.derivatives(u, v)
        r = s - points
        f, g = np.einsum("ij,ij->i", r, su), np.einsum("ij,ij->i", r, sv)
        a = np.einsum("ij,ij->i", su, su) + np.einsum("ij,ij->i", r, suu)
        b = np.einsum("ij,ij->i", su, sv) + np.einsum("ij,ij->i", r, suv)
        c = np.einsum("ij,ij->i", sv, sv) + np.einsum("ij,ij->i", r, svv)
        det = a * c - b * b
        det = np.where(np.abs(det) > 1e-300, det, 1e-300)
        du, dv = (b * g - c * f) / det, (b * f - a * g) / det
        u, v = np.clip(u + np.clip(du, -0.2, 0.2), -0.5, 1.5), np.clip(v + np.clip(dv, -0.2, 0.2), -0.5, 1.5)
        if max(float(np.abs(du).max()), float(np.abs(dv).max())) < 1e-15:
            break
    return u, v
