"""Profile filters of ISO 16610; none is applied by default (ISO 1101:2017).

References
----------
.. [1] ISO 16610-21 (linear Gaussian), -22 (spline), -31 (robust Gaussian regression), -28 (end effects).
.. [2] J. Raja, B. Muralikrishnan, S. Fu, Recent advances in separation of roughness, waviness and form,
   Precis. Eng. 26 (2002), doi:10.1016/S0141-6359(02)00103-4.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from cadskin.errors import GeometryError

if TYPE_CHECKING:
    from collections.abc import Callable

    from cadskin._typing import Floats, Points, Vectors

__all__ = [
    "FilterKind",
    "closed_gaussian",
    "closed_robust_gaussian",
    "filter_roundness",
    "filter_straightness",
    "gaussian_transmission",
    "open_gaussian",
    "robust_gaussian",
    "spline",
]

FilterKind: TypeAlias = Literal["gaussian", "robust", "spline"]
ALPHA = float(np.sqrt(np.log(2.0) / np.pi))  # 50 % transmission at the cut-off


def gaussian_transmission(ratio: Floats) -> Floats:
    """Return the amplitude transmission of the long-wave-pass Gaussian filter.

    Parameters
    ----------
    ratio : (n,) float
        Frequency over cut-off frequency (undulations per revolution over the cut-off, or cut-off wavelength
        over wavelength).

    Examples
    --------
    >>> gaussian_transmission(np.array([0.0, 1.0])).tolist()
    [1.0, 0.5]
    """
    return np.asarray(np.exp(-np.pi * (ALPHA * np.asarray(ratio, dtype=np.float64)) ** 2))


def closed_gaussian(values: Floats, cutoff: float) -> Floats:
    """Filter a closed, uniformly sampled profile (n,) with a cut-off in undulations per revolution.

    Raises
    ------
    GeometryError
        A cut-off that is not positive, or fewer than two samples per undulation at the cut-off.
    """
    samples = np.asarray(values, dtype=np.float64)
    if not cutoff > 0:
        raise GeometryError(f"the cut-off must be positive, got {cutoff}")
    if len(samples) < 2 * cutoff:
        raise GeometryError(f"{len(samples)} samples cannot carry a cut-off of {cutoff:g} undulations")
    spectrum = np.fft.rfft(samples)
    spectrum *= gaussian_transmission(np.arange(len(spectrum)) / cutoff)
    return np.asarray(np.fft.irfft(spectrum, n=len(samples)))


def open_gaussian(values: Floats, spacing: float, cutoff: float) -> Floats:
    """Filter an open profile (n,) with a cut-off wavelength; zero-order regression at the ends.

    Parameters
    ----------
    values : (n,) float
    spacing : float
        Distance of neighbours [mm].
    cutoff : float
        [mm].
    """
    return _regression(np.asarray(values, dtype=np.float64), spacing, cutoff, np.ones(len(values)))


def robust_gaussian(
    values: Floats, spacing: float, cutoff: float, *, tol: float = 1e-6, max_iterations: int = 50
) -> Floats:
    """Filter an open profile by robust Gaussian regression: Tukey weights cut at 4.4478 median."""
    samples = np.asarray(values, dtype=np.float64)
    weights, last = np.ones(len(samples)), np.inf
    line = samples
    for _ in range(max_iterations):
        line = _regression(samples, spacing, cutoff, weights)
        residual = samples - line
        cut = 4.4478 * float(np.median(np.abs(residual)))
        if cut <= 0.0 or abs(last - cut) <= tol * cut:
            break
        weights = np.where(np.abs(residual) < cut, (1 - (residual / cut) ** 2) ** 2, 0.0)
        last = cut
    return line


def _regression(samples: Floats, spacing: float, cutoff: float, weights: Floats) -> Floats:
    if not (cutoff > 0 and spacing > 0):
        raise GeometryError(f"cut-off and spacing must be positive, got {cutoff} and {spacing}")
    half = min(int(np.ceil(1.2 * cutoff / spacing)), len(samples) - 1)
    offsets = np.arange(-half, half + 1) * spacing
    kernel = np.exp(-np.pi * (offsets / (ALPHA * cutoff)) ** 2)
    over = np.convolve(weights * samples, kernel)[half : half + len(samples)]
    under = np.convolve(weights, kernel)[half : half + len(samples)]
    return np.asarray(over / np.maximum(under, 1e-300))


def spline(values: Floats, spacing: float, cutoff: float, *, closed: bool = False) -> Floats:
    """Filter a profile with the cubic spline filter (ISO 16610-22): transmission 1 / (1 + alpha^4 sin^4)."""
    from scipy.sparse import csc_matrix, diags, identity
    from scipy.sparse.linalg import spsolve

    samples = np.asarray(values, dtype=np.float64)
    n = len(samples)
    alpha = 1.0 / (2.0 * np.sin(np.pi * spacing / cutoff))
    if closed:
        second = diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(n, n)).tolil()
        second[0, n - 1] = second[n - 1, 0] = 1.0
    else:
        second = diags([1.0, -2.0, 1.0], [0, 1, 2], shape=(n - 2, n))
    q = csc_matrix(second)
    return np.asarray(spsolve(csc_matrix(identity(n) + alpha**4 * (q.T @ q)), samples))


def closed_robust_gaussian(
    values: Floats, cutoff: float, *, tol: float = 1e-6, max_iterations: int = 50
) -> Floats:
    """Filter a closed profile (n,) by robust Gaussian regression; the cut-off is in undulations per turn."""
    samples = np.asarray(values, dtype=np.float64)
    weights, last = np.ones(len(samples)), np.inf
    line = closed_gaussian(samples, cutoff)
    for _ in range(max_iterations):
        residual = samples - line
        cut = 4.4478 * float(np.median(np.abs(residual)))
        if cut <= 0.0 or abs(last - cut) <= tol * cut:
            break
        weights = np.where(np.abs(residual) < cut, (1 - (residual / cut) ** 2) ** 2, 0.0)
        under = np.maximum(closed_gaussian(weights, cutoff), 1e-12)
        line, last = np.asarray(closed_gaussian(weights * samples, cutoff) / under), cut
    return line


def _closed(values: Floats, cutoff: float, kind: FilterKind) -> Floats:
    if kind == "robust":
        return closed_robust_gaussian(values, cutoff)
    if kind == "spline":
        return spline(values, 1.0 / len(values), 1.0 / cutoff, closed=True)
    return closed_gaussian(values, cutoff)


def filter_straightness(
    points: Points, origin: Points, axes: Vectors, cutoff: float, *, kind: FilterKind = "gaussian"
) -> Points:
    """Return the points of a line with their heights filtered (open profile).

    Parameters
    ----------
    points : (n, 3) float
        At (nearly) equal steps along the line.
    origin : (3,) float
        Of the least-squares line.
    axes : (3, 3) float
        Columns: normal of the section, direction of the line, direction of the heights.
    cutoff : float
        [mm]
    kind : {"gaussian", "robust", "spline"}

    Raises
    ------
    GeometryError
        Steps too uneven for a profile filter.
    """
    across, along, height = ((np.asarray(points) - origin) @ axes).T
    order = np.argsort(along)
    step = np.diff(along[order])
    if len(step) < 2 or step.max() > 3.0 * step.mean():
        raise GeometryError("the points of the line are too uneven along it for a profile filter")
    even = np.linspace(along[order[0]], along[order[-1]], len(along))
    heights = np.interp(even, along[order], height[order])
    functions: dict[FilterKind, Callable[[Floats, float, float], Floats]] = {
        "robust": robust_gaussian,
        "spline": spline,
        "gaussian": open_gaussian,
    }
    smooth = functions[kind](heights, float(even[1] - even[0]), cutoff)
    return np.asarray(origin + np.column_stack([across[order], even, smooth]) @ axes.T)


def filter_roundness(
    points: Points,
    centre: Points,
    normal: Vectors,
    cutoff: float,
    *,
    short_wave: bool = False,
    kind: FilterKind = "gaussian",
) -> Points:
    """Return the points of a section with their radial profile filtered (closed profile).

    Parameters
    ----------
    points : (n, 3) float
        Samples of one turn at (nearly) equal angles about ``centre``.
    centre : (3,) float
        Of the least-squares circle.
    normal : (3,) float
    cutoff : float
        Undulations per revolution.
    short_wave : bool
        Keep what the filter takes away, on the mean radius.
    kind : {"gaussian", "robust", "spline"}

    Raises
    ------
    GeometryError
        Angles too uneven to be one turn at equal steps.
    """
    from cadskin.shape.association import frame_about

    axes = frame_about(normal)
    flat = (np.asarray(points) - centre) @ axes
    angles = np.arctan2(flat[:, 1], flat[:, 0])
    order = np.argsort(angles)
    step = np.diff(angles[order], append=angles[order[0]] + 2 * np.pi)
    if step.max() > 3 * 2 * np.pi / len(angles):
        raise GeometryError(
            f"the section has a gap of {np.degrees(step.max()):.3g} degrees; a closed filter "
            "needs a full turn"
        )
    radii = np.linalg.norm(flat[:, :2], axis=1)
    even = _even_profile(angles[order], radii[order])
    smooth = _closed(even[1], cutoff, kind)
    if short_wave:
        smooth = even[1] - smooth + even[1].mean()
    place = (
        centre
        + np.outer(smooth * np.cos(even[0]), axes[:, 0])
        + np.outer(smooth * np.sin(even[0]), axes[:, 1])
    )
    return np.asarray(place)


def _even_profile(angles: Floats, radii: Floats) -> tuple[Floats, Floats]:
    """Interpolate a closed profile at equal angles (periodic cubic spline); even samples stay as they are."""
    from scipy.interpolate import CubicSpline

    n = len(angles)
    target = angles[0] + 2 * np.pi * np.arange(n) / n
    curve = CubicSpline(
        np.append(angles, angles[0] + 2 * np.pi), np.append(radii, radii[0]), bc_type="periodic"
    )
    return target, np.asarray(curve(target))
