"""Profile filters of ISO 16610; none is applied by default (ISO 1101:2017).

References
----------
.. [1] ISO 16610-21 (linear Gaussian), -22 (spline), -31 (robust Gaussian regression), -28 (end effects).
.. [2] J. Raja, B. Muralikrishnan, S. Fu, Recent advances in separation of roughness, waviness and form,
   Precis. Eng. 26 (2002), doi:10.1016/S0141-6359(02)00103-4.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import GeometryError

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors

__all__ = [
    "closed_gaussian",
    "filter_roundness",
    "gaussian_transmission",
    "open_gaussian",
    "robust_gaussian",
    "spline",
]

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


def filter_roundness(
    points: Points, centre: Points, normal: Vectors, cutoff: float, *, short_wave: bool = False
) -> Points:
    """Return the points of a section with their radial profile filtered (Gaussian, closed).

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
    smooth = closed_gaussian(even[1], cutoff)
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
