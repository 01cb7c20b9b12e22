"""Surfaces of B-rep faces, evaluated many points at a time.

`face_surface` reads the surface of a face into arrays; its ``derivatives`` then cost well below a microsecond
per point, where a call of the geometry kernel costs several. Elementary surfaces have closed forms, B-splines
and what is made of curves (extrusion, revolution) use `cadskin.cad.bspline`, offsets the surface they stand
on; what is left asks the geometry kernel point by point.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.Geom import (
    Geom_BezierSurface,
    Geom_BSplineSurface,
    Geom_ConicalSurface,
    Geom_CylindricalSurface,
    Geom_OffsetSurface,
    Geom_Plane,
    Geom_RectangularTrimmedSurface,
    Geom_SphericalSurface,
    Geom_SurfaceOfLinearExtrusion,
    Geom_SurfaceOfRevolution,
    Geom_ToroidalSurface,
)
from OCP.GeomConvert import GeomConvert
from OCP.gp import gp_Pnt, gp_Vec
from OCP.Standard import Standard_Failure
from OCP.TopAbs import TopAbs_Orientation

from cadskin._typing import Bools, Floats, Points, Vectors
from cadskin.cad import _elementary
from cadskin.cad._elementary import evaluate_elementary, frame_of
from cadskin.cad._occ import xyz
from cadskin.cad.basis_curves import curve_evaluator
from cadskin.cad.bspline import nurbs_of_surface
from cadskin.shape.ideal import (
    Cone,
    Cylinder,
    Freeform,
    IdealSurface,
    Plane,
    Sphere,
    SurfaceKind,
    Torus,
)

__all__ = ["FaceSurface", "face_surface", "ideal_surface", "principal_curvatures", "unit_normals"]

Evaluator = Callable[[Floats], Floats]


@dataclass(frozen=True, eq=False)
class FaceSurface:
    """The surface of one B-rep face.

    Parameters
    ----------
    kind : str
        One of `cadskin.shape.ideal.SurfaceKind`.
    reversed : bool
        True where the normal out of the material is -Su x Sv.
    geometry : Geom_Surface
        The kernel's own surface, placed.
    parameters : tuple of float
        Radius; reference radius and half angle; major and minor radius; else empty.
    spans : (int, int)
        Number of smooth pieces in u and v, a measure of how fast the metric changes.
    varies : (bool, bool)
        Whether the metric changes with u and with v.
    """

    kind: SurfaceKind
    reversed: bool
    geometry: Any
    frame: Points
    parameters: tuple[float, ...]
    spans: tuple[int, int]
    varies: tuple[bool, bool]
    _evaluate: Evaluator = field(repr=False)

    def derivatives(self, uv: Floats) -> Floats:
        """Return S, Su, Sv, Suu, Suv, Svv (n, 6, 3) at parameters ``uv`` (n, 2).

        The second derivatives of an offset surface hold their normal part only, as much as curvature needs.
        """
        return self._evaluate(np.ascontiguousarray(uv, dtype=np.float64))

    def points(self, uv: Floats) -> Points:
        """Return the points (n, 3) [mm] at parameters ``uv`` (n, 2)."""
        return self.derivatives(uv)[:, 0]


def face_surface(face: Any) -> FaceSurface:
    """Read the surface of a face (its orientation included) for batch evaluation.

    Examples
    --------
    >>> import cadquery as cq
    >>> surface = face_surface(cq.Workplane().sphere(2.0).faces().val().wrapped)
    >>> float(np.linalg.norm(surface.points(np.array([[0.3, 0.2]]))))
    2.0
    """
    geometry = BRep_Tool.Surface_s(face)
    reversed_ = face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED
    return _read(geometry, reversed_)


def _read(geometry: Any, reversed_: bool) -> FaceSurface:
    surface = geometry
    while isinstance(surface, Geom_RectangularTrimmedSurface):
        surface = surface.BasisSurface()
    for kinds, reader in _READERS:
        if isinstance(surface, kinds):
            found: FaceSurface | None = reader(surface, geometry, reversed_)
            if found is not None:
                return found
    kind: SurfaceKind = "bspline" if isinstance(surface, Geom_BSplineSurface) else "other"
    return _made(kind, geometry, reversed_, _one_by_one(geometry), spans=(8, 8), varies=(True, True))


def _made(
    kind: SurfaceKind,
    geometry: Any,
    reversed_: bool,
    evaluate: Evaluator,
    *,
    spans: tuple[int, int] = (1, 1),
    varies: tuple[bool, bool] = (False, False),
    frame: Points | None = None,
    parameters: tuple[float, ...] = (),
) -> FaceSurface:
    frame = np.zeros((4, 3)) if frame is None else frame
    return FaceSurface(kind, reversed_, geometry, frame, parameters, spans, varies, evaluate)


def _elementary_reader(kind: SurfaceKind, code: int) -> Any:
    def read(surface: Any, geometry: Any, reversed_: bool) -> FaceSurface:
        frame = frame_of(surface.Position())
        parameters = _size_of(surface)
        a, b = (*parameters, 0.0, 0.0)[:2]

        def evaluate(uv: Floats) -> Floats:
            out = np.zeros((len(uv), 6, 3))
            evaluate_elementary(code, frame, a, b, uv, out)
            return out

        varies = (False, code in (_elementary.CONE, _elementary.SPHERE, _elementary.TORUS))
        return _made(
            kind,
            geometry,
            reversed_,
            evaluate,
            spans=(1, 6),
            varies=varies,
            frame=frame,
            parameters=parameters,
        )

    return read


def _size_of(surface: Any) -> tuple[float, ...]:
    if isinstance(surface, Geom_ToroidalSurface):
        return surface.MajorRadius(), surface.MinorRadius()
    if isinstance(surface, Geom_ConicalSurface):
        return surface.RefRadius(), surface.SemiAngle()
    return () if isinstance(surface, Geom_Plane) else (surface.Radius(),)


def _read_bspline(surface: Any, geometry: Any, reversed_: bool) -> FaceSurface | None:
    if isinstance(surface, Geom_BezierSurface):
        surface = GeomConvert.SurfaceToBSplineSurface_s(surface)
    nurbs = nurbs_of_surface(surface)
    if nurbs is None:
        return None
    return _made("bspline", geometry, reversed_, nurbs.derivatives, spans=nurbs.n_spans, varies=(True, True))


def _read_extrusion(surface: Any, geometry: Any, reversed_: bool) -> FaceSurface:
    curve, spans = curve_evaluator(surface.BasisCurve())
    direction = np.array(xyz(surface.Direction()))

    def evaluate(uv: Floats) -> Floats:
        basis = curve(uv[:, 0])
        out = np.zeros((len(uv), 6, 3))
        out[:, 0] = basis[:, 0] + uv[:, 1:] * direction
        out[:, 1] = basis[:, 1]
        out[:, 2] = direction
        out[:, 3] = basis[:, 2]
        return out

    return _made("extrusion", geometry, reversed_, evaluate, spans=(spans, 1), varies=(True, False))


def _read_revolution(surface: Any, geometry: Any, reversed_: bool) -> FaceSurface:
    curve, spans = curve_evaluator(surface.BasisCurve())
    axis = surface.Axis()
    origin, axial = np.array(xyz(axis.Location())), np.array(xyz(axis.Direction()))

    def evaluate(uv: Floats) -> Floats:
        basis = curve(uv[:, 1])
        basis[:, 0] -= origin
        along = (basis @ axial)[:, :, None] * axial
        across = basis - along
        turned = np.cross(axial, basis)
        cosine, sine = np.cos(uv[:, 0])[:, None], np.sin(uv[:, 0])[:, None]
        out = np.zeros((len(uv), 6, 3))
        for target, order in ((0, 0), (2, 1), (5, 2)):
            out[:, target] = along[:, order] + cosine * across[:, order] + sine * turned[:, order]
        for target, order in ((1, 0), (4, 1)):
            out[:, target] = cosine * turned[:, order] - sine * across[:, order]
        out[:, 3] = -cosine * across[:, 0] - sine * turned[:, 0]
        out[:, 0] += origin
        return out

    return _made("revolution", geometry, reversed_, evaluate, spans=(1, spans), varies=(False, True))


def _read_offset(surface: Any, geometry: Any, reversed_: bool) -> FaceSurface:
    basis = _read(surface.BasisSurface(), False)
    distance = surface.Offset()
    one_by_one = _one_by_one(geometry)

    def evaluate(uv: Floats) -> Floats:
        base = basis.derivatives(uv)
        out = _offset_derivatives(base, distance)
        broken = ~np.isfinite(out).all(axis=(1, 2))
        if broken.any():
            out[broken] = one_by_one(uv[broken])
        return out

    varies = (True, True) if basis.kind == "bspline" else basis.varies
    return _made("offset", geometry, reversed_, evaluate, spans=basis.spans, varies=varies)


def _offset_derivatives(base: Floats, distance: float) -> Floats:
    """Return the derivatives of S + d n by the equations of Weingarten (second order: normal part only)."""
    with np.errstate(all="ignore"):
        normal = np.cross(base[:, 1], base[:, 2])
        normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        first = [np.einsum("ni,ni->n", base[:, i], base[:, j]) for i, j in ((1, 1), (1, 2), (2, 2))]
        second = [np.einsum("ni,ni->n", base[:, i], normal) for i in (3, 4, 5)]
        determinant = first[0] * first[2] - first[1] ** 2
        shape_uu = (second[0] * first[2] - second[1] * first[1]) / determinant
        shape_uv = (second[1] * first[0] - second[0] * first[1]) / determinant
        shape_vu = (second[1] * first[2] - second[2] * first[1]) / determinant
        shape_vv = (second[2] * first[0] - second[1] * first[1]) / determinant
        normal_u = -(shape_uu[:, None] * base[:, 1] + shape_uv[:, None] * base[:, 2])
        normal_v = -(shape_vu[:, None] * base[:, 1] + shape_vv[:, None] * base[:, 2])
        out = np.zeros_like(base)
        out[:, 0] = base[:, 0] + distance * normal
        out[:, 1] = base[:, 1] + distance * normal_u
        out[:, 2] = base[:, 2] + distance * normal_v
        for target, left, right in ((3, normal_u, 1), (4, normal_u, 2), (5, normal_v, 2)):
            out[:, target] = -np.einsum("ni,ni->n", left, out[:, right])[:, None] * normal
    return out


def _one_by_one(surface: Any) -> Evaluator:
    """Ask the geometry kernel for each point; where it has no derivatives they are NaN."""

    def evaluate(uv: Floats) -> Floats:
        out = np.full((len(uv), 6, 3), np.nan)
        point = gp_Pnt()
        d = [gp_Vec() for _ in range(5)]  # D1U, D1V, D2U, D2V, D2UV
        for row, (u, v) in zip(out, uv.tolist(), strict=True):
            try:
                surface.D2(u, v, point, *d)
            except Standard_Failure:
                surface.D0(u, v, point)
                row[0] = xyz(point)
                continue
            row[:] = xyz(point), xyz(d[0]), xyz(d[1]), xyz(d[2]), xyz(d[4]), xyz(d[3])
        return out

    return evaluate


_READERS: tuple[tuple[Any, Any], ...] = (
    (Geom_Plane, _elementary_reader("plane", _elementary.PLANE)),
    (Geom_CylindricalSurface, _elementary_reader("cylinder", _elementary.CYLINDER)),
    (Geom_ConicalSurface, _elementary_reader("cone", _elementary.CONE)),
    (Geom_SphericalSurface, _elementary_reader("sphere", _elementary.SPHERE)),
    (Geom_ToroidalSurface, _elementary_reader("torus", _elementary.TORUS)),
    ((Geom_BSplineSurface, Geom_BezierSurface), _read_bspline),
    (Geom_SurfaceOfLinearExtrusion, _read_extrusion),
    (Geom_SurfaceOfRevolution, _read_revolution),
    (Geom_OffsetSurface, _read_offset),
)


def unit_normals(derivatives: Floats, *, reversed: bool | Bools = False) -> Vectors:
    """Return the unit normals (n, 3) out of the material; zero where Su x Sv vanishes.

    Parameters
    ----------
    derivatives : (n, 6, 3) float
        From `FaceSurface.derivatives`.
    reversed : bool or (n,) bool
        Orientation of the face.
    """
    normals = np.cross(derivatives[:, 1], derivatives[:, 2])
    length = np.linalg.norm(normals, axis=1)
    sign = np.where(reversed, -1.0, 1.0)
    factor = np.divide(sign, length, out=np.zeros(len(normals)), where=length > 0)
    return np.asarray(normals * factor[:, None])


def principal_curvatures(derivatives: Floats, normals: Vectors) -> tuple[Floats, Floats]:
    """Return the principal curvatures and directions with respect to given unit normals.

    The shape operator is written in an orthonormal tangent basis, where it is a symmetric 2x2 matrix.

    Parameters
    ----------
    derivatives : (n, 6, 3) float
        S, Su, Sv, Suu, Suv, Svv.
    normals : (n, 3) float

    Returns
    -------
    curvatures : (n, 2) float
        k1 >= k2 [1/mm], positive where the surface bends towards its normal.
    directions : (n, 2, 3) float
        Unit directions of k1 and k2, with ``d1 x d2`` along the normal.

    References
    ----------
    M. P. do Carmo, Differential Geometry of Curves and Surfaces, 1976, section 3-3.
    """
    su, sv = derivatives[:, 1], derivatives[:, 2]
    e1, f1 = np.einsum("ni,ni->n", su, su), np.einsum("ni,ni->n", su, sv)
    e2, f2, g2 = (np.einsum("ni,ni->n", derivatives[:, k], normals) for k in (3, 4, 5))
    with np.errstate(all="ignore"):
        length = np.sqrt(e1)
        t1 = su / length[:, None]
        t2 = np.cross(normals, t1)
        height = np.einsum("ni,ni->n", sv, t2)  # Sv = (f1 / length) t1 + height t2
        slope = f1 / e1
        a = e2 / e1
        mixed = (f2 - slope * e2) / (length * height)
        b = (g2 - 2.0 * slope * f2 + slope**2 * e2) / height**2
    mean, spread = 0.5 * (a + b), np.hypot(0.5 * (a - b), mixed)
    angle = 0.5 * np.arctan2(2.0 * mixed, a - b)
    d1 = np.cos(angle)[:, None] * t1 + np.sin(angle)[:, None] * t2
    directions = np.stack([d1, np.cross(normals, d1)], axis=1)
    return np.stack([mean + spread, mean - spread], axis=1), directions


def ideal_surface(face: Any) -> IdealSurface:
    """Return the ideal surface of a face with its parameters (ISO 17450-1, partition).

    Examples
    --------
    >>> import cadquery as cq
    >>> ideal_surface(cq.Workplane().cylinder(10, 3.0).faces("%CYLINDER").val().wrapped).radius
    3.0
    """
    surface = face_surface(face)
    origin, axis = surface.frame[0], surface.frame[3]
    sizes = surface.parameters
    if surface.kind == "plane":
        normal = np.cross(surface.frame[1], surface.frame[2])
        return Plane(origin, -normal if surface.reversed else normal)
    if surface.kind == "cylinder":
        return Cylinder(origin, axis, sizes[0])
    if surface.kind == "sphere":
        return Sphere(origin, sizes[0])
    if surface.kind == "torus":
        return Torus(origin, axis, sizes[0], sizes[1])
    if surface.kind == "cone":
        radius, half_angle = sizes
        apex = origin - axis * (radius / math.tan(half_angle))
        return Cone(apex, axis if half_angle > 0 else -axis, abs(half_angle))
    return Freeform(surface.kind)
