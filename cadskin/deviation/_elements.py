"""The elements that a surface field is solved on: the triangles of the mesh, refined, and a collar.

Meshes of parts have some four to ten vertices per correlation length, too few for linear elements. There the
elements are quadratic, and the mesh is refined until the correlation between its own vertices is right; on
fine meshes linear elements do. The triangles are those of the surface, not of its facets: their sides are the
arcs that the normals tell, and their areas those of curved triangles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array, dia_array

from cadskin.deviation._collar import WIDTH, make_collar, triangles_of_lengths
from cadskin.errors import DeviationError
from cadskin.shape.operators import (
    boundary_edges,
    boundary_mass,
    cotangent_laplacian,
    lumped_mass,
    mesh_edges,
    quadratic_operators,
)

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points, Triangles, Vectors
    from cadskin.deviation._collar import Collar

__all__ = ["Elements", "surface_elements", "surface_operators"]

# Vertices per length from which the correlation is within 1e-3 (the first two) and 1e-2, measured: quadratic
# elements on the mesh as it is, refined, linear elements.
_ENOUGH = {
    "squared_exponential": (3.5, 3.5, 24.0),
    "matern52": (4.5, 4.5, 26.0),
    "matern32": (3.5, 3.5, 14.0),
    "whittle": (5.5, 5.0, 18.0),
    "exponential": (18.0, 13.0, 60.0),
}
_GROWTH = 1.3  # of the rows of the collar
_NEARLY = 0.9  # share of it that does
_MOST = 2_000_000  # unknowns that the surface itself may get


@dataclass(frozen=True, eq=False)
class Elements:
    """The operator of a surface field in its parts; the first unknowns are the points of the surface.

    Parameters
    ----------
    laplacian : (n, n) csr_array
        With the squared local length.
    factor : (n, latent) csr_array
        F of the mass F F^T.
    edge : (n,) float
        Boundary mass with the local length.
    places : (n, 3) float
        Places in space that keep neighbours together.
    note : str
        What was done.
    triangles : (m, 3) int
        Between neighbouring unknowns, all of one sense: a quadratic element has four.
    sides : (m, 3) float
        Their lengths along the surface, from each corner to the next.
    local : (n,) float
        Local correlation length.
    region : (n,) int
        0 on free edges, 1 elsewhere on the surface, 2 in the collar.
    spacing : float
        Of quadratic elements, in correlation lengths; 0 for linear ones.
    """

    laplacian: csr_array
    factor: csr_array
    edge: Floats
    places: Points
    note: str
    triangles: Triangles
    sides: Floats
    local: Floats
    region: Ints
    spacing: float = 0.0


def surface_operators(
    points: Points, triangles: Triangles, border: Collar | None, local: Floats
) -> tuple[csr_array, Floats, Floats]:
    """Laplacian with the squared local length, mass, and boundary mass with the local length."""
    even = bool((local == 1.0).all())
    squares = None if even else (local**2)[triangles].mean(axis=1)
    laplacian = cotangent_laplacian(points, triangles, weights=squares)
    mass = lumped_mass(points, triangles)
    if border is None:
        return laplacian, mass, local * boundary_mass(points, triangles)
    everywhere = np.concatenate([local, local[border.origin]])
    beyond = None if even else (everywhere**2)[border.triangles].mean(axis=1)
    more, extra, edge = border.operators(len(everywhere), beyond)
    laplacian.resize(more.shape)
    return csr_array(laplacian + more), extra + np.pad(mass, (0, len(border.origin))), everywhere * edge


def surface_elements(
    points: Points,
    triangles: Triangles,
    kernel: str,
    local: Floats,
    *,
    normals: Vectors | None = None,
    collar: bool = True,
    margin: float = 1.0,
) -> Elements:
    """Return the elements of a surface.

    Parameters
    ----------
    points : (n, 3) float
        Divided by the correlation length.
    triangles : (m, 3) int
    kernel : str
    local : (n,) float
        Local correlation length over the one that ``points`` are divided by.
    normals : (n, 3) float, optional
        Of the surface; without them it is that of the facets.
    collar : bool
        False: linear elements on the mesh alone.
    margin : float
        Factor on the vertices per length from which on elements are linear.

    Raises
    ------
    DeviationError
        A point without triangles.
    """
    loose = np.setdiff1d(np.arange(len(points)), triangles)
    if len(loose):
        raise DeviationError(
            f"metric='surface' needs triangles: point {loose[0]} of the patch has none ({len(loose)} in "
            "all); remove it from the mesh, or use metric='euclidean'"
        )
    found = _vertices_per_length(points, triangles, local)
    level, quadratic, note = _resolution(found, len(triangles), kernel, margin)
    if collar and quadratic:
        spacing = 0.5**level / found
        return _quadratic_elements(points, triangles, local, normals, level, spacing, note)
    border = make_collar(points, triangles, WIDTH * local) if collar else None
    laplacian, mass, edge = surface_operators(points, triangles, border, local)
    places = points if border is None else border.extended(points, triangles)
    factor = csr_array(dia_array((np.sqrt(mass)[None], [0]), shape=laplacian.shape))
    everything, corners = _with_collar(triangles, points[triangles], border)
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    region = _regions(triangles, len(points), len(places))
    everywhere = local if border is None else np.concatenate([local, local[border.origin]])
    return Elements(
        laplacian, factor, edge, places, f"linear elements{note}", everything, sides, everywhere, region
    )


def _with_collar(triangles: Triangles, corners: Points, border: Collar | None) -> tuple[Triangles, Points]:
    """Triangles of surface and collar, all of one sense, and their corners."""
    if border is None:
        return triangles, corners
    turned = border.triangles[:, ::-1], border.corners[:, ::-1]
    return np.concatenate([triangles, turned[0]]), np.concatenate([corners, turned[1]])


def _regions(triangles: Triangles, count: int, total: int) -> Ints:
    """0 on free edges, 1 elsewhere on the surface of ``count`` points, 2 beyond (total,)."""
    region = np.full(total, 2, dtype=np.int64)
    region[:count] = 1
    region[np.unique(boundary_edges(triangles))] = 0
    return region


def _vertices_per_length(points: Points, triangles: Triangles, local: Floats) -> float:
    """Return one over the edge length in correlation lengths, that of a square grid; a mean over the area."""
    corners = points[triangles]
    sides = corners - np.roll(corners, 1, axis=1)
    squares = np.einsum("tki,tki->t", sides, sides) / 4.0  # 1 for half a unit square
    squares /= (local[triangles] ** 2).mean(axis=1)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return float(1.0 / max(np.sqrt((area * squares).sum() / max(area.sum(), 1e-300)), 1e-12))


def _resolution(found: float, count: int, kernel: str, margin: float = 1.0) -> tuple[int, bool, str]:
    """How often to refine ``count`` triangles, whether with quadratic elements, a note on what is missing."""
    bare, refined, linear = _ENOUGH[kernel]
    if found >= _NEARLY * linear * margin:
        return 0, False, ""
    wanted = 0 if found >= _NEARLY * bare else max(1, int(np.ceil(np.log2(_NEARLY * refined / found))))
    room = int(np.floor(np.log2(_MOST / (2.0 * count)) / 2.0)) if count else 0
    level = min(wanted, room)
    if level == wanted:
        return level, True, ""
    note = f" (only {found:.2g} vertices per length on so large a mesh: the correlation is less accurate)"
    return max(level, 0), level >= 0, note


def _quadratic_elements(
    points: Points,
    triangles: Triangles,
    local: Floats,
    normals: Vectors | None,
    level: int,
    spacing: float,
    note: str,
) -> Elements:
    corners, areas = _curved_triangles(points, triangles, normals)
    for _ in range(level):
        points, triangles, local, corners, areas = _refined(points, triangles, local, corners, areas)
    border = make_collar(points, triangles, WIDTH * local, growth=_GROWTH)
    places = points
    everything, corners = _with_collar(triangles, corners, border)
    if border is not None:
        places = border.extended(points, triangles)
        local = np.concatenate([local, local[border.origin]])
        beyond = np.cross(
            border.corners[:, 1] - border.corners[:, 0], border.corners[:, 2] - border.corners[:, 0]
        )
        areas = np.concatenate([areas, 0.5 * np.linalg.norm(beyond, axis=1)])
    weights = None if (local == 1.0).all() else (local**2)[everything]
    laplacian, factor = quadratic_operators(everything, corners, len(places), weights=weights, areas=areas)
    edges, of_side = mesh_edges(everything)
    local = np.concatenate([local, local[edges].mean(axis=1)])
    edge = local * _edge_mass(places, everything, edges, border)
    times = ("", "refined once", "refined twice")[level] if level < 3 else f"refined {level} times"
    return Elements(
        laplacian,
        factor,
        edge,
        np.concatenate([places, places[edges].mean(axis=1)]),
        f"quadratic elements on the mesh{' ' if times else ''}{times}{note}",
        *_quarters(everything, corners, of_side + len(places)),
        local,
        _regions_of_edges(_regions(triangles, len(points), len(places)), edges, boundary_edges(triangles)),
        spacing,
    )


def _quarters(triangles: Triangles, corners: Points, middles: Ints) -> tuple[Triangles, Floats]:
    """Return the four triangles (4 m, 3) between corners and middles of the sides, and their sides."""
    one, two, three = triangles.T
    first, second, third = middles.T
    parts = [(one, first, third), (first, two, second), (third, second, three), (second, third, first)]
    a, b, c = 0.5 * np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).T
    return (
        np.concatenate([np.stack(part, axis=1) for part in parts]),
        np.tile(np.stack([a, b, c], axis=1), (4, 1)),
    )


def _regions_of_edges(region: Ints, edges: Ints, free: Ints) -> Ints:
    """Regions of vertices and of edges behind them; ``free`` are the free edges of the surface."""
    base = len(region)
    known = np.sort(free, axis=1)
    of_edge = np.where((region[edges] == 2).any(axis=1), 2, 1)
    of_edge[np.isin(edges[:, 0] * base + edges[:, 1], known[:, 0] * base + known[:, 1])] = 0
    return np.concatenate([region, of_edge])


def _edge_mass(places: Points, triangles: Triangles, edges: Ints, border: Collar | None) -> Floats:
    """Return the boundary mass (n,) of quadratic elements, by Simpson's rule."""
    if border is None:
        ends = boundary_edges(triangles)
        length = np.linalg.norm(places[ends[:, 0]] - places[ends[:, 1]], axis=1)
    else:
        ends, length = np.sort(border.outer, axis=1), border.outer_length
    base = len(places)
    middle = base + np.searchsorted(edges[:, 0] * base + edges[:, 1], ends[:, 0] * base + ends[:, 1])
    rows = np.concatenate([ends[:, 0], ends[:, 1], middle])
    shares = np.concatenate([length / 6, length / 6, 2 * length / 3])
    total = np.bincount(rows.astype(np.int64), weights=shares, minlength=base + len(edges))
    return np.asarray(total, dtype=np.float64)


def _curved_triangles(points: Points, triangles: Triangles, normals: Vectors | None) -> tuple[Points, Floats]:
    """Corners (m, 3, 3) with the arcs of the surface as sides, and areas (m,) of the curved triangles.

    An arc over a chord c that turns by t is t c / (2 sin(t / 2)); a triangle on a surface of Gaussian
    curvature K is larger than the flat one by 1 + K (a² + b² + c²) / 24.
    """
    corners = points[triangles]
    chords = np.roll(corners, -1, axis=1) - corners  # 01, 12, 20
    lengths = np.linalg.norm(chords, axis=2)
    doubled = np.linalg.norm(np.cross(chords[:, 0], chords[:, 1]), axis=1)
    if normals is None:
        return corners, 0.5 * doubled
    across = normals[triangles]
    turned = np.einsum("tki,tki->tk", np.roll(across, -1, axis=1) - across, chords)
    sine = np.clip(0.5 * np.abs(turned) / np.maximum(lengths, 1e-300), 0.0, _MOST_TURNED)
    arcs = lengths / np.sinc(np.arcsin(sine) / np.pi)
    curved = triangles_of_lengths(arcs) if (sine > 1e-9).any() else corners
    solid = np.einsum("ti,ti->t", across[:, 0], np.cross(across[:, 1], across[:, 2]))
    facing = np.einsum("ti,ti->t", across[:, 0], np.cross(chords[:, 0], chords[:, 1]))
    curvature = np.sign(facing) * solid / np.maximum(doubled, 1e-300)
    growth = np.clip(curvature * (lengths**2).sum(axis=1) / 24.0, -_MOST_GROWN, _MOST_GROWN)
    sides = curved[:, 1:] - curved[:, :1]
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return curved, area * (1.0 + growth)


_MOST_TURNED = 0.5  # sine of half the turn along a side beyond which normals are not trusted
_MOST_GROWN = 0.2


def _refined(
    points: Points, triangles: Triangles, local: Floats, corners: Points, areas: Floats
) -> tuple[Points, Triangles, Floats, Points, Floats]:
    """Halve every edge; the old points keep their numbers."""
    edges, of_side = mesh_edges(triangles)
    one, two, three = triangles.T
    first, second, third = (of_side + len(points)).T
    parts = [(one, first, third), (first, two, second), (third, second, three), (first, second, third)]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    pieces = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return (
        np.concatenate([points, points[edges].mean(axis=1)]),
        np.concatenate([np.stack(part, axis=1) for part in parts]),
        np.concatenate([local, local[edges].mean(axis=1)]),
        np.concatenate([np.stack(piece, axis=1) for piece in pieces]),
        np.tile(0.25 * areas, 4),
    )
