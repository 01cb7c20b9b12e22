"""B-rep faces as records: exact area, centre, outward normal, box and ideal surface of each face."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepGProp import BRepGProp, BRepGProp_Face
from OCP.BRepTools import BRepTools
from OCP.BRepTopAdaptor import BRepTopAdaptor_FClass2d
from OCP.GeomAbs import GeomAbs_SurfaceType
from OCP.gp import gp_Pnt, gp_Pnt2d, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_State

from cadskin._typing import Points, Vectors
from cadskin.cad._occ import faces_of, xyz
from cadskin.errors import GeometryError
from cadskin.shape.ideal import Cone, Cylinder, Freeform, IdealSurface, Plane, Sphere, SurfaceKind, Torus
from cadskin.shape.nominal import Face

__all__ = ["bounding_box", "describe_faces", "surface_area", "volume"]

_FREEFORM: dict[GeomAbs_SurfaceType, SurfaceKind] = {
    GeomAbs_SurfaceType.GeomAbs_BSplineSurface: "bspline",
    GeomAbs_SurfaceType.GeomAbs_BezierSurface: "bspline",
    GeomAbs_SurfaceType.GeomAbs_SurfaceOfRevolution: "revolution",
    GeomAbs_SurfaceType.GeomAbs_SurfaceOfExtrusion: "extrusion",
    GeomAbs_SurfaceType.GeomAbs_OffsetSurface: "offset",
}


def describe_faces(
    shape: Any,
    *,
    names: Sequence[str | None] = (),
    colours: Sequence[str | None] = (),
    step_ids: Sequence[int | None] = (),
) -> tuple[Face, ...]:
    """Return one record per face of a shape, in the order of cadquery's ``.Faces()``.

    Parameters
    ----------
    shape : TopoDS_Shape
    names, colours, step_ids : sequence
        What the file says of each face, in the same order; empty if there is no file.

    Returns
    -------
    tuple of Face

    Raises
    ------
    GeometryError
        A face without an exact surface, or without area.

    Examples
    --------
    >>> import cadquery as cq
    >>> faces = describe_faces(cq.Solid.makeCylinder(2, 5).wrapped)
    >>> [face.kind for face in faces]
    ['cylinder', 'plane', 'plane']
    """
    found = faces_of(shape)
    for key, values in (("names", names), ("colours", colours), ("step_ids", step_ids)):
        if values and len(values) != len(found):
            raise GeometryError(f"{len(values)} {key} given for {len(found)} faces")
    return tuple(
        _describe(
            face,
            i,
            name=names[i] if names else None,
            colour=colours[i] if colours else None,
            step_id=step_ids[i] if step_ids else None,
        )
        for i, face in enumerate(found)
    )


def surface_area(shape: Any) -> float:
    """Return the exact area [mm²] of a shape (numerical integration of OCCT)."""
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(shape, properties)
    return float(properties.Mass())


def volume(shape: Any) -> float:
    """Return the signed enclosed volume [mm³] of a shape (numerical integration of OCCT)."""
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, properties)
    return float(properties.Mass())


def bounding_box(shape: Any) -> Points:
    """Return the tight bounding box (2, 3) [mm] of a shape, lowest and highest corner."""
    box = Bnd_Box()
    box.SetGap(0.0)
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    if box.IsVoid():
        raise GeometryError("the shape is empty: it has no bounding box")
    return np.array([xyz(box.CornerMin()), xyz(box.CornerMax())])


def _describe(face: Any, index: int, *, name: str | None, colour: str | None, step_id: int | None) -> Face:
    surface = BRepAdaptor_Surface(face, True)
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, properties)
    point, normal = _middle(face)
    ideal = _ideal(surface, point, normal)
    return Face(
        index=index,
        ideal=ideal,
        area=abs(float(properties.Mass())),
        centre=np.array(xyz(properties.CentreOfMass())),
        normal=ideal.normal if isinstance(ideal, Plane) else normal,
        bounds=bounding_box(face),
        internal=_internal(ideal, point, normal),
        name=name,
        colour=colour,
        step_id=step_id,
    )


def _middle(face: Any) -> tuple[Points, Vectors]:
    """Return a point inside the face, near the middle of its parameters, and the outward normal there."""
    evaluator = BRepGProp_Face(face)
    point, vector = gp_Pnt(), gp_Vec()
    for u, v in _inner_parameters(face):
        evaluator.Normal(u, v, point, vector)
        length = vector.Magnitude()
        if np.isfinite(length) and length > 1e-12:
            return np.array(xyz(point)), np.array(xyz(vector)) / length + 0.0  # no negative zero
    raise GeometryError("a face has no point with a normal: it is degenerate")


def _inner_parameters(face: Any) -> list[tuple[float, float]]:
    """Return parameters inside the face, the nearest to the middle first; the middle itself comes last."""
    u0, u1, v0, v1 = BRepTools.UVBounds_s(face)
    middle = (0.5 * (u0 + u1), 0.5 * (v0 + v1))
    classifier = BRepTopAdaptor_FClass2d(face, 1e-9)
    for n in (1, 4, 15, 40):
        fractions = (np.arange(n) + 0.5) / n
        grid = sorted(
            ((float(a), float(b)) for a in fractions for b in fractions),
            key=lambda ab: (ab[0] - 0.5) ** 2 + (ab[1] - 0.5) ** 2,
        )
        inside = [
            (u0 + a * (u1 - u0), v0 + b * (v1 - v0))
            for a, b in grid
            if classifier.Perform(gp_Pnt2d(u0 + a * (u1 - u0), v0 + b * (v1 - v0))) == TopAbs_State.TopAbs_IN
        ]
        if inside:
            return [*inside[:5], middle]
    return [middle, (u0 + 0.25 * (u1 - u0), v0 + 0.25 * (v1 - v0))]


def _ideal(surface: Any, point: Points, normal: Vectors) -> IdealSurface:
    """Return the ideal surface of an adapted face, in the frame of the part."""
    match surface.GetType():
        case GeomAbs_SurfaceType.GeomAbs_Plane:
            origin = np.array(xyz(surface.Plane().Location()))
            direction = np.array(xyz(surface.Plane().Axis().Direction()))
            return Plane(origin, (direction if direction @ normal > 0 else -direction) + 0.0)
        case GeomAbs_SurfaceType.GeomAbs_Cylinder:
            cylinder = surface.Cylinder()
            return Cylinder(*_axis(cylinder), cylinder.Radius())
        case GeomAbs_SurfaceType.GeomAbs_Cone:
            apex = np.array(xyz(surface.Cone().Apex()))
            axis = _axis(surface.Cone())[1]
            inward = axis if axis @ (point - apex) > 0 else -axis
            return Cone(apex, inward, abs(surface.Cone().SemiAngle()))
        case GeomAbs_SurfaceType.GeomAbs_Sphere:
            return Sphere(np.array(xyz(surface.Sphere().Location())), surface.Sphere().Radius())
        case GeomAbs_SurfaceType.GeomAbs_Torus:
            torus = surface.Torus()
            return Torus(*_axis(torus), torus.MajorRadius(), torus.MinorRadius())
        case other:
            return Freeform(_FREEFORM.get(other, "other"))


def _axis(elementary: Any) -> tuple[Points, Vectors]:
    axis = elementary.Axis()
    return np.array(xyz(axis.Location())), np.array(xyz(axis.Direction()))


def _internal(ideal: IdealSurface, point: Points, normal: Vectors) -> bool:
    """Return True where the outward normal points towards the axis (or centre): a hole."""
    match ideal:
        case Cylinder():
            outside = _from_axis(point, ideal.origin, ideal.axis)
        case Cone():
            outside = _from_axis(point, ideal.apex, ideal.axis)
        case Sphere():
            outside = point - ideal.centre
        case Torus():
            ring = _from_axis(point, ideal.centre, ideal.axis)
            ring *= ideal.major_radius / max(float(np.linalg.norm(ring)), 1e-300)
            outside = point - (ideal.centre + ring)
        case _:
            return False
    return bool(outside @ normal < 0)


def _from_axis(point: Points, origin: Points, axis: Vectors) -> Vectors:
    relative = point - origin
    return np.asarray(relative - (relative @ axis) * axis)
