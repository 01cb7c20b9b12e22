"""Proofs that a slab (two parallel planes, or two lines in a plane) is the narrowest of all."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points
    from cadskin.shape.association.minimax import Minimax
    from cadskin.shape.association.result import Kind, Proof

__all__ = ["hull_proof", "least_margin", "open_tilts", "tilt_proof", "tilts_excluded"]

_CLOSE = 1e-14  # of the size of the points: a slab narrower by less counts as equal
_NEAR = 4000  # near contacts of each side that are asked
_HALVINGS = 40  # of half the width: how far points below the contacts are asked


def tilts_excluded(depth: float, margin: float, target: float) -> tuple[float, float]:
    """Return between which tilts two sets of points hold every slab wider than a target.

    Points of one set lie ``depth`` or more above those of the other, and the sets reach past each other by
    ``margin`` or more along every direction of the slab. Tilted by phi in any direction, a slab that holds
    them is at least ``depth cos(phi) + margin sin(phi)`` wide.

    Parameters
    ----------
    depth, margin, target : float
        [mm]; the depth may be negative.

    Returns
    -------
    least, most : float
        Tangents of half the tilt, 1 at a right angle; the first is the larger where no tilt is excluded.

    Examples
    --------
    >>> contacts = tilts_excluded(0.05, 0.001, 0.05)
    >>> extent = tilts_excluded(-0.05, 50.0, 0.05)
    >>> [round(end, 12) for end in (*contacts, *extent)]
    [0.0, 0.02, 0.001, inf]
    """
    short = target - depth  # of the target where nothing is tilted
    bend = max(depth + target, 0.0)
    square = margin * margin - bend * short
    root = margin + float(np.sqrt(max(square, 0.0)))
    if square < 0.0 or root <= 0.0:
        return (0.0, 0.0) if short <= 0.0 else (np.inf, 0.0)
    return max(short / root, 0.0), root / bend if bend > 0.0 else np.inf


def least_margin(upper: Floats, lower: Floats) -> float:
    """Return how far two sets reach past each other along the direction in which they do so least.

    Parameters
    ----------
    upper, lower : (k, 2) or (k, 1) float
        Places in the plane (or on the line) of the slab [mm].

    Returns
    -------
    float
        The least over all directions of the largest ``(upper - lower) . direction`` [mm]; 0 or less where the
        sets do not alternate.
    """
    if upper.shape[1] == 1:
        return float(min(upper.max() - lower.min(), lower.max() - upper.min()))
    # The polygon of differences has the edges of both sets; its support is least at the normal of one.
    sides = np.concatenate([(one[:, None, :] - one[None, :, :]).reshape(-1, 2) for one in (upper, lower)])
    length = np.hypot(sides[:, 0], sides[:, 1])
    real = length > 0
    if not real.any():
        return 0.0
    across = np.stack([sides[real, 1], -sides[real, 0]], axis=1) / length[real, None]
    return float(((across @ upper.T).max(axis=1) - (across @ lower.T).min(axis=1)).min())


def open_tilts(
    heights: Floats, places: Floats, contacts: tuple[Floats, Floats], target: float
) -> tuple[float, float] | None:
    """Return between which tilts a slab of less than ``target`` is not excluded, None where nowhere.

    Contacts exclude small tilts, the extent of the points large ones; between them count points that are
    somewhat below the contacts and lie farther apart.

    Parameters
    ----------
    heights : (n,) float
        Of the points across the slab [mm].
    places : (n, 2) or (n, 1) float
        In its plane [mm].
    contacts : tuple of (k, 2) or (k, 1) float
        Places of the upper and lower contacts.
    target : float
        [mm]

    Returns
    -------
    tuple of float or None
        Least and largest tilt that is left [rad].
    """
    width = float(np.ptp(heights))
    excluded = [tilts_excluded(width, least_margin(*contacts), target)]
    extent = _outermost(places)
    excluded.append(tilts_excluded(-width, least_margin(extent, extent), target))
    left = _gap(excluded)
    if left is None:
        return None
    for depth, upper, lower in _near_contacts(heights, places):
        excluded.append(tilts_excluded(depth, least_margin(upper, lower), target))
    left = _gap(excluded)
    return None if left is None else (2.0 * np.arctan(left[0]), 2.0 * np.arctan(left[1]))


def _near_contacts(heights: Floats, places: Floats) -> Iterator[tuple[float, Floats, Floats]]:
    """Yield depths with the outermost places of the points above and below."""
    top, bottom = float(heights.max()), float(heights.min())
    n = len(heights)
    if n > 4 * _NEAR:
        order = np.argpartition(heights, [_NEAR, n - _NEAR])
        kept = np.concatenate([order[:_NEAR], order[-_NEAR:], np.arange(0, n, n // _NEAR)])
        heights, places = heights[kept], places[kept]
    for reach in 0.5 * (top - bottom) * 0.5 ** np.arange(_HALVINGS):
        upper, lower = heights >= top - reach, heights <= bottom + reach
        depth = float(heights[upper].min() - heights[lower].max())
        yield depth, _outermost(places[upper]), _outermost(places[lower])


def _outermost(places: Floats) -> Floats:
    """Return the places that lie farthest along 16 directions."""
    if places.shape[1] == 1:
        return np.asarray(places[[int(places.argmin()), int(places.argmax())]])
    angle = np.arange(8) * np.pi / 8
    along = places @ np.stack([np.cos(angle), np.sin(angle)])
    return np.asarray(places[np.unique(np.concatenate([along.argmin(axis=0), along.argmax(axis=0)]))])


def _gap(excluded: list[tuple[float, float]]) -> tuple[float, float] | None:
    """Return the first and the last tilt up to a right angle that no interval holds, None where all are."""
    reach, first, last = 0.0, None, 0.0
    for least, most in sorted(excluded):
        if most < least:
            continue
        if least > reach:
            first, last = (reach if first is None else first), least
        reach = max(reach, most)
    if reach < 1.0:
        return (reach if first is None else first), 1.0
    return None if first is None or first >= 1.0 else (first, min(last, 1.0))


def tilt_proof(points: Points, found: Minimax, kind: Kind) -> tuple[Proof | None, float]:
    """Return the proof that no tilt narrows a slab, from the points that lie in or near its planes.

    Returns
    -------
    proof : Proof or None
        None where some tilts are left.
    angle : float
        The largest of them [rad].
    """
    upper, lower = points[found.active[found.sides > 0]], points[found.active[found.sides < 0]]
    if not (len(upper) and len(lower)):
        return None, 0.5 * np.pi
    axes = found.pose.axes
    within = np.ascontiguousarray(axes[:, 1:2] if kind == "profile line" else axes[:, :2])
    places, heights = points @ within, points @ axes[:, 2]
    slack = _CLOSE * float(np.ptp(places, axis=0).max())
    left = open_tilts(heights, places, (upper @ within, lower @ within), found.value - slack)
    if left is not None:
        return None, left[1]
    text = f"no tilt narrows the slab by {slack:.1e} mm: its contacts, points near them and the extent"
    return ("global", found.value - slack, text), 0.0


def hull_proof(found: Minimax, hull: float | None) -> Proof:
    """Return the proof that compares a slab with the width of the convex hull, None where that is unknown."""
    if hull is None:
        return "local", None, "Kuhn-Tucker conditions; the convex hull is flat or has too many edges"
    bound = min(hull, found.value)
    if found.value <= hull * (1 + 1e-9) + 1e-12:
        return "global", bound, "the width of the convex hull"
    return "local", bound, "Kuhn-Tucker conditions; the convex hull has a narrower width"
