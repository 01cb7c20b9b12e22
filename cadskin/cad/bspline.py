"""Batch evaluation of (rational) B-spline surfaces and curves: points, first and second derivatives.

References
----------
L. Piegl, W. Tiller, The NURBS Book, 2nd ed., Springer 1997, algorithms A2.1, A2.3 and A4.4,
doi:10.1007/978-3-642-59223-2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cadskin._jit import kernel
from cadskin._typing import Floats

__all__ = ["Nurbs", "nurbs_of_curve", "nurbs_of_surface"]


@kernel
def find_span(knots: Any, degree: int, n_poles: int, u: float) -> int:
    """Return the knot span that holds ``u`` (A2.1); ends belong to the last span that is not empty."""
    if u >= knots[n_poles]:
        k = n_poles - 1
        while knots[k] >= knots[k + 1] and k > degree:
            k -= 1
        return k
    if u <= knots[degree]:
        k = degree
        while knots[k + 1] <= knots[k] and k < n_poles - 1:
            k += 1
        return k
    low = degree
    high = n_poles
    while high - low > 1:
        middle = (low + high) // 2
        if u < knots[middle]:
            high = middle
        else:
            low = middle
    return low


@kernel
def basis_derivatives(knots: Any, p: int, i: int, u: float, ders: Any, ndu: Any, a: Any) -> None:
    """Write the basis functions and their first two derivatives into ``ders`` (3, p + 1) (A2.3)."""
    ndu[0, 0] = 1.0
    for j in range(1, p + 1):
        saved = 0.0
        for r in range(j):
            right = knots[i + r + 1] - u
            left = u - knots[i + 1 - j + r]
            ndu[j, r] = right + left
            term = ndu[r, j - 1] / ndu[j, r]
            ndu[r, j] = saved + right * term
            saved = left * term
        ndu[j, j] = saved
    for j in range(p + 1):
        ders[0, j] = ndu[j, p]
        ders[1, j] = 0.0
        ders[2, j] = 0.0
    order = min(2, p)
    for r in range(p + 1):
        s1 = 0
        s2 = 1
        a[0, 0] = 1.0
        for k in range(1, order + 1):
            d = 0.0
            rk = r - k
            pk = p - k
            if r >= k:
                a[s2, 0] = a[s1, 0] / ndu[pk + 1, rk]
                d = a[s2, 0] * ndu[rk, pk]
            first = 1 if rk >= -1 else -rk
            last = k - 1 if r - 1 <= pk else p - r
            for j in range(first, last + 1):
                a[s2, j] = (a[s1, j] - a[s1, j - 1]) / ndu[pk + 1, rk + j]
                d += a[s2, j] * ndu[rk + j, pk]
            if r <= pk:
                a[s2, k] = -a[s1, k - 1] / ndu[pk + 1, r]
                d += a[s2, k] * ndu[r, pk]
            ders[k, r] = d
            s1, s2 = s2, s1
    factor = float(p)
    for k in range(1, order + 1):
        for j in range(p + 1):
            ders[k, j] *= factor
        factor *= p - k


@kernel
def into_period(u: float, low: float, high: float) -> float:
    """Shift ``u`` by whole periods into [low, high]."""
    if u < low or u > high:
        u -= np.floor((u - low) / (high - low)) * (high - low)
    return u


@kernel
def evaluate_nurbs(uv: Any, knots_u: Any, knots_v: Any, degrees: Any, poles: Any, box: Any, out: Any) -> None:
    """Write S, Su, Sv, Suu, Suv, Svv into ``out`` (n, 6, 3) (A4.4 for second order).

    ``degrees`` holds both degrees and both periodic flags, ``poles`` (nu, nv, 4) weighted poles and weights,
    ``box`` the four bounds.
    """
    p = degrees[0]
    q = degrees[1]
    n_u = poles.shape[0]
    n_v = poles.shape[1]
    width = max(p, q) + 2
    du = np.zeros((3, p + 1))
    dv = np.zeros((3, q + 1))
    ndu = np.zeros((width, width))
    work = np.zeros((2, width))
    h = np.zeros((6, 4))
    for k in range(uv.shape[0]):
        u = uv[k, 0]
        v = uv[k, 1]
        if degrees[2]:
            u = into_period(u, box[0], box[1])
        if degrees[3]:
            v = into_period(v, box[2], box[3])
        i0 = find_span(knots_u, p, n_u, u)
        j0 = find_span(knots_v, q, n_v, v)
        basis_derivatives(knots_u, p, i0, u, du, ndu, work)
        basis_derivatives(knots_v, q, j0, v, dv, ndu, work)
        h[:] = 0.0
        for i in range(p + 1):
            for j in range(q + 1):
                for c in range(4):
                    x = poles[i0 - p + i, j0 - q + j, c]
                    h[0, c] += du[0, i] * dv[0, j] * x
                    h[1, c] += du[1, i] * dv[0, j] * x
                    h[2, c] += du[0, i] * dv[1, j] * x
                    h[3, c] += du[2, i] * dv[0, j] * x
                    h[4, c] += du[1, i] * dv[1, j] * x
                    h[5, c] += du[0, i] * dv[2, j] * x
        w = h[0, 3]
        for c in range(3):
            s = h[0, c] / w
            su = (h[1, c] - h[1, 3] * s) / w
            sv = (h[2, c] - h[2, 3] * s) / w
            out[k, 0, c] = s
            out[k, 1, c] = su
            out[k, 2, c] = sv
            out[k, 3, c] = (h[3, c] - 2 * h[1, 3] * su - h[3, 3] * s) / w
            out[k, 4, c] = (h[4, c] - h[1, 3] * sv - h[2, 3] * su - h[4, 3] * s) / w
            out[k, 5, c] = (h[5, c] - 2 * h[2, 3] * sv - h[5, 3] * s) / w


@dataclass(frozen=True, eq=False)
class Nurbs:
    """A clamped tensor-product B-spline in arrays.

    Parameters
    ----------
    knots_u, knots_v : (k,) float
        Flat knot vectors.
    degrees : (4,) int
        Degree in u and v, then 1 where the surface is periodic in u and v.
    poles : (nu, nv, 4) float
        Weighted poles and weights.
    box : (4,) float
        Bounds u0, u1, v0, v1.
    """

    knots_u: Floats
    knots_v: Floats
    degrees: Any
    poles: Floats
    box: Floats

    def derivatives(self, uv: Floats) -> Floats:
        """Return S, Su, Sv, Suu, Suv, Svv (n, 6, 3) at ``uv`` (n, 2)."""
        out = np.zeros((len(uv), 6, 3))
        evaluate_nurbs(uv, self.knots_u, self.knots_v, self.degrees, self.poles, self.box, out)
        return out

    @property
    def n_spans(self) -> tuple[int, int]:
        """Number of spans in u and v."""
        return len(np.unique(self.knots_u)) - 1, len(np.unique(self.knots_v)) - 1


def _flat(knot: Any, multiplicity: Any, count: int) -> Floats:
    values = [float(knot(i + 1)) for i in range(count)]
    return np.repeat(np.asarray(values), [multiplicity(i + 1) for i in range(count)])


def nurbs_of_surface(surface: Any) -> Nurbs | None:
    """Return the arrays of a ``Geom_BSplineSurface``, or None where they do not reproduce it.

    Periodic surfaces are opened and unclamped ends are clamped; the surface itself is left alone.
    """
    periodic = surface.IsUPeriodic(), surface.IsVPeriodic()
    box = surface.Bounds()
    copy = surface.Copy()
    if periodic[0]:
        copy.SetUNotPeriodic()
    if periodic[1]:
        copy.SetVNotPeriodic()
    ends_u = min(copy.UMultiplicity(1), copy.UMultiplicity(copy.NbUKnots()))
    ends_v = min(copy.VMultiplicity(1), copy.VMultiplicity(copy.NbVKnots()))
    if ends_u < copy.UDegree() + 1 or ends_v < copy.VDegree() + 1:
        copy.Segment(*copy.Bounds())
    n_u, n_v = copy.NbUPoles(), copy.NbVPoles()
    poles = np.zeros((n_u, n_v, 4))
    table = copy.Poles()
    rational = copy.IsURational() or copy.IsVRational()
    for i in range(n_u):
        for j in range(n_v):
            pole = table.Value(i + 1, j + 1)
            weight = copy.Weight(i + 1, j + 1) if rational else 1.0
            poles[i, j] = pole.X() * weight, pole.Y() * weight, pole.Z() * weight, weight
    nurbs = Nurbs(
        knots_u=_flat(copy.UKnot, copy.UMultiplicity, copy.NbUKnots()),
        knots_v=_flat(copy.VKnot, copy.VMultiplicity, copy.NbVKnots()),
        degrees=np.array([copy.UDegree(), copy.VDegree(), *map(int, periodic)], dtype=np.int64),
        poles=poles,
        box=np.array(box, dtype=np.float64),
    )
    return nurbs if _reproduces(nurbs, lambda u, v: surface.Value(u, v)) else None


def nurbs_of_curve(curve: Any) -> Nurbs | None:
    """Return the arrays of a ``Geom_BSplineCurve`` as a surface of degree 0 in v, or None."""
    periodic = curve.IsPeriodic()
    box = curve.FirstParameter(), curve.LastParameter(), 0.0, 1.0
    copy = curve.Copy()
    if periodic:
        copy.SetNotPeriodic()
    if min(copy.Multiplicity(1), copy.Multiplicity(copy.NbKnots())) < copy.Degree() + 1:
        copy.Segment(copy.FirstParameter(), copy.LastParameter())
    poles = np.zeros((copy.NbPoles(), 1, 4))
    for i in range(copy.NbPoles()):
        pole, weight = copy.Pole(i + 1), copy.Weight(i + 1)
        poles[i, 0] = pole.X() * weight, pole.Y() * weight, pole.Z() * weight, weight
    nurbs = Nurbs(
        knots_u=_flat(copy.Knot, copy.Multiplicity, copy.NbKnots()),
        knots_v=np.array([0.0, 1.0]),
        degrees=np.array([copy.Degree(), 0, int(periodic), 0], dtype=np.int64),
        poles=poles,
        box=np.array(box, dtype=np.float64),
    )
    return nurbs if _reproduces(nurbs, lambda u, _v: curve.Value(u)) else None


def _reproduces(nurbs: Nurbs, value: Any) -> bool:
    """Compare with the kernel's own evaluation at nine points inside the bounds."""
    n_u, n_v = nurbs.poles.shape[:2]
    if len(nurbs.knots_u) != n_u + nurbs.degrees[0] + 1 or len(nurbs.knots_v) != n_v + nurbs.degrees[1] + 1:
        return False
    fractions = np.array([0.113, 0.521, 0.877])
    u = nurbs.box[0] + fractions * (nurbs.box[1] - nurbs.box[0])
    v = nurbs.box[2] + fractions * (nurbs.box[3] - nurbs.box[2])
    uv = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
    ours = nurbs.derivatives(uv)[:, 0]
    theirs = np.array([(p.X(), p.Y(), p.Z()) for p in (value(float(a), float(b)) for a, b in uv)])
    return bool(np.abs(ours - theirs).max() <= 1e-9 * max(1.0, np.abs(theirs).max()))
