"""Batch evaluation of the curves that surfaces of extrusion and revolution are made of."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from OCP.Geom import (
    Geom_BezierCurve,
    Geom_BSplineCurve,
    Geom_Circle,
    Geom_Ellipse,
    Geom_Line,
    Geom_TrimmedCurve,
)
from OCP.GeomConvert import GeomConvert
from OCP.gp import gp_Pnt, gp_Vec

from cadskin._typing import Floats, Vectors
from cadskin.cad._occ import xyz
from cadskin.cad.bspline import nurbs_of_curve

__all__ = ["curve_evaluator"]

Evaluator = Callable[[Floats], Floats]


def curve_evaluator(curve: Any) -> tuple[Evaluator, int]:
    """Return C, C', C'' (n, 3, 3) of a curve as a function of its parameter, and its number of pieces."""
    while isinstance(curve, Geom_TrimmedCurve):
        curve = curve.BasisCurve()
    if isinstance(curve, Geom_BezierCurve):
        curve = GeomConvert.CurveToBSplineCurve_s(curve)
    if isinstance(curve, Geom_BSplineCurve):
        nurbs = nurbs_of_curve(curve)
        if nurbs is not None:
            derivatives = nurbs.derivatives
            return (lambda t: derivatives(np.stack([t, np.zeros(len(t))], axis=1))[:, [0, 1, 3]]), (
                nurbs.n_spans[0]
            )
    if isinstance(curve, Geom_Line):
        start, along = (np.array(xyz(part)) for part in (curve.Lin().Location(), curve.Lin().Direction()))
        return (lambda t: np.stack([start + t[:, None] * along, *_rows(t, along, 0 * along)], axis=1)), 1
    if isinstance(curve, (Geom_Circle, Geom_Ellipse)):
        return _ellipse_evaluator(curve), 6
    return _curve_one_by_one(curve), 8


def _rows(t: Floats, *vectors: Vectors) -> list[Floats]:
    return [np.broadcast_to(vector, (len(t), 3)) for vector in vectors]


def _ellipse_evaluator(curve: Any) -> Evaluator:
    is_circle = isinstance(curve, Geom_Circle)
    major, minor = (
        (curve.Radius(), curve.Radius()) if is_circle else (curve.MajorRadius(), curve.MinorRadius())
    )
    place = curve.Position()
    centre = np.array(xyz(place.Location()))
    x, y = major * np.array(xyz(place.XDirection())), minor * np.array(xyz(place.YDirection()))

    def evaluate(t: Floats) -> Floats:
        cosine, sine = np.cos(t)[:, None], np.sin(t)[:, None]
        offset = cosine * x + sine * y
        return np.stack([centre + offset, cosine * y - sine * x, -offset], axis=1)

    return evaluate


def _curve_one_by_one(curve: Any) -> Evaluator:
    def evaluate(t: Floats) -> Floats:
        out = np.full((len(t), 3, 3), np.nan)
        point, first, second = gp_Pnt(), gp_Vec(), gp_Vec()
        for row, parameter in zip(out, t.tolist(), strict=True):
            curve.D2(parameter, point, first, second)
            row[:] = xyz(point), xyz(first), xyz(second)
        return out

    return evaluate
