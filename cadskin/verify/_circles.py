"""Gaussian circles of many sections at once, in compiled code."""

from __future__ import annotations

import numpy as np

from cadskin._jit import kernel

__all__ = ["gaussian_circles"]

_STEPS = 60


@kernel
def gaussian_circles(flat: np.ndarray, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return centre and radius (k, 3) of the least-squares circles of sections, and whether each settled.

    Gauss-Newton on the distances from the circle of algebraic least squares (Kasa), about the mean point.

    Parameters
    ----------
    flat : (n, 2) float
        Points, section after section [mm].
    starts : (k + 1,) int
        First point of each section, and n.
    """
    count = len(starts) - 1
    circles, settled = np.zeros((count, 3)), np.zeros(count, dtype=np.bool_)
    for section in range(count):
        begin, end = starts[section], starts[section + 1]
        circles[section], settled[section] = _circle(flat[begin:end])
    return circles, settled


@kernel
def _circle(flat: np.ndarray) -> tuple[np.ndarray, bool]:
    n = len(flat)
    mx, my = flat[:, 0].mean(), flat[:, 1].mean()
    xx = xy = yy = xz = yz = zz = 0.0
    for i in range(n):
        x, y = flat[i, 0] - mx, flat[i, 1] - my
        z = x * x + y * y
        xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
        xz, yz, zz = xz + x * z, yz + y * z, zz + z
    det = xx * yy - xy * xy
    if n < 3 or det <= 1e-14 * (xx + yy) ** 2:
        return np.zeros(3), False
    a, b = 0.5 * (xz * yy - yz * xy) / det, 0.5 * (yz * xx - xz * xy) / det
    radius = np.sqrt(a * a + b * b + zz / n)
    scale, last = radius, np.inf
    for _ in range(_STEPS):
        # Normal equations of (x - a) / d da + (y - b) / d db + dr = d - r.
        suu = suv = svv = su = sv = ru = rv = r0 = 0.0
        for i in range(n):
            x, y = flat[i, 0] - mx - a, flat[i, 1] - my - b
            d = np.sqrt(x * x + y * y)
            if d == 0.0:
                return np.zeros(3), False
            u, v, rest = x / d, y / d, d - radius
            suu, suv, svv, su, sv = suu + u * u, suv + u * v, svv + v * v, su + u, sv + v
            ru, rv, r0 = ru + u * rest, rv + v * rest, r0 + rest
        # The radius is eliminated: dr = (r0 - su da - sv db) / n.
        suu, suv, svv = suu - su * su / n, suv - su * sv / n, svv - sv * sv / n
        ru, rv = ru - su * r0 / n, rv - sv * r0 / n
        det = suu * svv - suv * suv
        if det <= 1e-14 * (suu + svv) ** 2:
            return np.zeros(3), False
        da, db = (ru * svv - rv * suv) / det, (rv * suu - ru * suv) / det
        dr = (r0 - su * da - sv * db) / n
        a, b, radius = a + da, b + db, radius + dr
        size = np.sqrt(da * da + db * db + dr * dr)
        if size <= 1e-15 * scale or (size <= 1e-12 * scale and size >= last):
            break
        last = size
    found = np.array([mx + a, my + b, radius])
    return found, size <= 1e-9 * scale
