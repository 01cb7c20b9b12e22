"""Batch evaluation of the elementary surfaces in OCCT's parametrisation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cadskin._jit import kernel

__all__ = ["CONE", "CYLINDER", "PLANE", "SPHERE", "TORUS", "evaluate_elementary"]

PLANE, CYLINDER, CONE, SPHERE, TORUS = range(5)


@kernel
def evaluate_elementary(kind: int, frame: Any, a: float, b: float, uv: Any, out: Any) -> None:
    """Write S, Su, Sv, Suu, Suv, Svv into ``out`` (n, 6, 3), zero on entry.

    ``frame`` (4, 3) holds origin, x, y and z direction. ``a, b`` are the radius of a cylinder or sphere, the
    reference radius and half angle of a cone, the major and minor radius of a torus.
    """
    sine_b = math.sin(b)
    cosine_b = math.cos(b)
    for k in range(uv.shape[0]):
        u = uv[k, 0]
        v = uv[k, 1]
        cu = math.cos(u)
        su = math.sin(u)
        cv = math.cos(v)
        sv = math.sin(v)
        for c in range(3):
            x = frame[1, c]
            y = frame[2, c]
            z = frame[3, c]
            radial = cu * x + su * y
            tangent = cu * y - su * x
            if kind == 0:
                out[k, 0, c] = frame[0, c] + u * x + v * y
                out[k, 1, c] = x
                out[k, 2, c] = y
            elif kind == 1:
                out[k, 0, c] = frame[0, c] + a * radial + v * z
                out[k, 1, c] = a * tangent
                out[k, 2, c] = z
                out[k, 3, c] = -a * radial
            elif kind == 2:
                r = a + v * sine_b
                out[k, 0, c] = frame[0, c] + r * radial + v * cosine_b * z
                out[k, 1, c] = r * tangent
                out[k, 2, c] = sine_b * radial + cosine_b * z
                out[k, 3, c] = -r * radial
                out[k, 4, c] = sine_b * tangent
            else:
                major = 0.0
                minor = a
                if kind == 4:
                    major = a
                    minor = b
                r = major + minor * cv
                out[k, 0, c] = frame[0, c] + r * radial + minor * sv * z
                out[k, 1, c] = r * tangent
                out[k, 2, c] = minor * (cv * z - sv * radial)
                out[k, 3, c] = -r * radial
                out[k, 4, c] = -minor * sv * tangent
                out[k, 5, c] = -minor * (cv * radial + sv * z)


def frame_of(placement: Any) -> Any:
    """Return origin, x, y and z direction (4, 3) of a ``gp_Ax3``."""
    parts = placement.Location(), placement.XDirection(), placement.YDirection(), placement.Direction()
    return np.array([(part.X(), part.Y(), part.Z()) for part in parts])
