"""Small parts made of arrays, with exact normals: true `NominalModel` objects without a geometry kernel."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import Delaunay

from cadskin.shape import Cone, Cylinder, DiscreteShape, Face, Freeform, NominalModel, Plane, Samples
from cadskin.shape.nominal import build_features


@dataclass(frozen=True)
class Patch:
    """One B-rep face, meshed alone."""

    points: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray
    ideal: object
    curvatures: np.ndarray | None = None
    singular: np.ndarray | None = None
    internal: bool = False
    name: str | None = None


@dataclass(frozen=True)
class Line:
    """A straight side of a profile; the material lies on the left of its direction."""

    start: tuple[float, float]
    end: tuple[float, float]
    name: str | None = None

    def sampled(self, h):
        start, end = np.array(self.start, float), np.array(self.end, float)
        n = max(1, round(float(np.linalg.norm(end - start)) / h))
        points = start + np.linspace(0, 1, n + 1)[:, None] * (end - start)
        tangent = (end - start) / np.linalg.norm(end - start)
        normals = np.tile([tangent[1], -tangent[0]], (n + 1, 1))
        return points, normals

    def ideal(self):
        points, normals = self.sampled(1e9)
        return Plane([*points[0], 0.0], [*normals[0], 0.0]), 0.0, False


@dataclass(frozen=True)
class Arc:
    """A round side of a profile from angle a to b; b > a bulges outward, b < a is a hole."""

    centre: tuple[float, float]
    radius: float
    a: float
    b: float
    name: str | None = None

    def sampled(self, h):
        n = max(2, round(self.radius * abs(self.b - self.a) / h))
        t = np.linspace(self.a, self.b, n + 1)
        ray = np.stack([np.cos(t), np.sin(t)], axis=1)
        return np.array(self.centre) + self.radius * ray, ray * np.sign(self.b - self.a)

    def ideal(self):
        outward = self.b > self.a
        curvature = -1 / self.radius if outward else 1 / self.radius
        return Cylinder([*self.centre, 0.0], [0, 0, 1], self.radius), curvature, not outward


def extrude(loops, height, h, *, groups=None, open_top=False) -> NominalModel:
    """Extrude a profile (loops of `Line` and `Arc`, material on the left) from z = 0 to ``height``."""
    sides = []
    rims = []
    nz = max(1, round(height / h))
    for loop in loops:
        rim = []
        for segment in loop:
            points, normals = segment.sampled(h)
            rim.append(points[:-1])
            ideal, curvature, internal = segment.ideal()
            sides.append(_wall(points, normals, height, nz, ideal, curvature, internal, segment.name))
        rims.append(np.concatenate(rim))
    flat, triangles = _planar_mesh(rims, h)
    up = np.tile([0.0, 0.0, 1.0], (len(flat), 1))
    bottom = Patch(
        np.column_stack([flat, np.zeros(len(flat))]), triangles[:, ::-1], -up, Plane([0, 0, 0], [0, 0, -1]),
        name="bottom",
    )  # fmt: skip
    top = Patch(
        np.column_stack([flat, np.full(len(flat), height)]), triangles, up, Plane([0, 0, height], [0, 0, 1]),
        name="top",
    )  # fmt: skip
    return assemble([bottom, *([] if open_top else [top]), *sides], groups)


def _wall(points, normals, height, nz, ideal, curvature, internal, name):
    n = len(points) - 1
    z = np.linspace(0, height, nz + 1)
    grid = np.column_stack([np.repeat(points, nz + 1, axis=0), np.tile(z, n + 1)])
    i, j = np.meshgrid(np.arange(n), np.arange(nz), indexing="ij")
    a, b = (i * (nz + 1) + j).ravel(), ((i + 1) * (nz + 1) + j).ravel()
    even = ((i + j) % 2 == 0).ravel()[:, None]
    one = np.where(even, np.stack([a, b, b + 1], 1), np.stack([a, b, a + 1], 1))
    two = np.where(even, np.stack([a, b + 1, a + 1], 1), np.stack([b, b + 1, a + 1], 1))
    grid_normals = np.column_stack([np.repeat(normals, nz + 1, axis=0), np.zeros(len(grid))])
    curvatures = np.tile(sorted([0.0, curvature], reverse=True), (len(grid), 1))
    return Patch(
        grid, np.concatenate([one, two]), grid_normals, ideal, curvatures, internal=internal, name=name
    )


def _planar_mesh(rims, h):
    """Delaunay mesh of a profile: the rim points and a hexagonal lattice inside."""
    border = np.concatenate(rims)
    low, high = border.min(0), border.max(0)
    rows = np.arange(low[1], high[1], h * np.sqrt(3) / 2)
    lattice = np.concatenate(
        [
            np.column_stack([np.arange(low[0] - (k % 2) * h / 2, high[0], h), np.full_like(x, y)])
            for k, y in enumerate(rows)
            for x in [np.arange(low[0] - (k % 2) * h / 2, high[0], h)]
        ]
    )
    gap = np.linalg.norm(lattice[:, None] - border[None], axis=2).min(axis=1)
    inside = lattice[(gap > 0.6 * h) & _inside(lattice, rims)]
    points = np.concatenate([border, inside])
    triangles = Delaunay(points).simplices.astype(np.int64)
    corners = points[triangles]
    edge1, edge2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    doubled = edge1[:, 0] * edge2[:, 1] - edge1[:, 1] * edge2[:, 0]
    triangles[doubled < 0] = triangles[doubled < 0][:, ::-1]
    keep = _inside(corners.mean(axis=1), rims) & (np.abs(doubled) > 1e-9 * h * h)
    return points, triangles[keep]


def _inside(points, rims):
    """Even-odd rule."""
    odd = np.zeros(len(points), bool)
    for rim in rims:
        for (x0, y0), (x1, y1) in zip(rim, np.roll(rim, -1, axis=0), strict=True):
            crosses = (y0 > points[:, 1]) != (y1 > points[:, 1])
            at = x0 + (points[:, 1] - y0) / np.where(y1 == y0, 1.0, y1 - y0) * (x1 - x0)
            odd ^= crosses & (points[:, 0] < at)
    return odd


def assemble(patches, groups=None) -> NominalModel:
    """Merge patches at equal points and make features of ``groups`` of faces (default: one per face)."""
    groups = [[i] for i in range(len(patches))] if groups is None else groups
    stacked = np.concatenate([patch.points for patch in patches])
    _, first, vertex = np.unique(np.round(stacked, 7) + 0.0, axis=0, return_index=True, return_inverse=True)
    vertex = vertex.reshape(-1)
    offsets = np.cumsum([0, *[len(patch.points) for patch in patches]])
    triangles = np.concatenate(
        [vertex[patch.triangles + o] for patch, o in zip(patches, offsets, strict=False)]
    )
    face_ids = np.repeat(np.arange(len(patches)), [len(patch.triangles) for patch in patches])
    surface = DiscreteShape(stacked[first], triangles, face_ids)
    faces = tuple(_face(i, patch) for i, patch in enumerate(patches))
    rows, starts = [], [0]
    for group in groups:
        own = np.concatenate([np.arange(offsets[k], offsets[k + 1]) for k in group])
        _, once = np.unique(vertex[own], return_index=True)
        rows.append(own[np.sort(once)])
        starts.append(starts[-1] + len(once))
    row = np.concatenate(rows)
    patch_of = np.repeat(np.arange(len(patches)), np.diff(offsets))
    normals = np.concatenate([patch.normals for patch in patches])[row]
    samples = Samples(
        vertex_ids=vertex[row],
        face_ids=patch_of[row],
        uv=np.full((len(row), 2), np.nan),
        normals=normals,
        curvatures=np.concatenate([_curvatures(patch) for patch in patches])[row],
        directions=np.concatenate([_directions(patch) for patch in patches])[row],
        singular=np.concatenate([_singular(patch) for patch in patches])[row],
    )
    features = build_features(surface, groups, faces, samples, np.array(starts))
    return NominalModel(surface, faces, features, samples)


def _face(index, patch):
    corners = patch.points[patch.triangles]
    areas = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    centre = (corners.mean(axis=1) * areas[:, None]).sum(axis=0) / areas.sum()
    bounds = np.stack([patch.points.min(0), patch.points.max(0)])
    middle = patch.normals[len(patch.normals) // 2]
    return Face(
        index,
        patch.ideal,
        float(areas.sum()),
        centre,
        middle,
        bounds,
        internal=patch.internal,
        name=patch.name,
    )


def _curvatures(patch):
    return np.zeros((len(patch.points), 2)) if patch.curvatures is None else patch.curvatures


def _singular(patch):
    return np.zeros(len(patch.points), bool) if patch.singular is None else patch.singular


def _directions(patch):
    """Principal directions: around and along the axis of a cylinder in the order of its curvatures."""
    normals = patch.normals
    if isinstance(patch.ideal, Cylinder):
        axis = np.tile([0.0, 0.0, 1.0], (len(normals), 1))
        around = np.cross(axis, normals)
        return np.stack([around, axis] if patch.internal else [axis, around], axis=1)
    other = np.where(np.abs(normals[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]])
    first = np.cross(normals, other)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first)], axis=1)


def box(size=(6.0, 4.0, 3.0), h=1.0) -> NominalModel:
    """Faces: bottom, top, front (-y), right (+x), back (+y), left (-x)."""
    x, y, z = size
    corners = [(0.0, 0.0), (x, 0.0), (x, y), (0.0, y)]
    names = ["front", "right", "back", "left"]
    sides = [Line(corners[k], corners[(k + 1) % 4], names[k]) for k in range(4)]
    return extrude([sides], z, h)


def open_box(size=(6.0, 4.0, 3.0), h=1.0) -> NominalModel:
    """A box without its top: an open shell."""
    x, y, z = size
    corners = [(0.0, 0.0), (x, 0.0), (x, y), (0.0, y)]
    names = ["front", "right", "back", "left"]
    sides = [Line(corners[k], corners[(k + 1) % 4], names[k]) for k in range(4)]
    return replace(extrude([sides], z, h, open_top=True), closed=False)


def cylinder(radius=3.0, height=5.0, h=0.7) -> NominalModel:
    """Faces: bottom, top, mantle (two half-cylinders, one feature)."""
    halves = [Arc((0, 0), radius, k * np.pi, (k + 1) * np.pi, "mantle") for k in range(2)]
    return extrude([halves], height, h, groups=[[0], [1], [2, 3]])


def plate_with_hole(size=(10.0, 8.0, 2.0), radius=2.0, h=0.6) -> NominalModel:
    """Faces: bottom, top, four sides, hole (two half-cylinders, one feature)."""
    x, y, z = size
    corners = [(-x / 2, -y / 2), (x / 2, -y / 2), (x / 2, y / 2), (-x / 2, y / 2)]
    sides = [Line(corners[k], corners[(k + 1) % 4], f"side {k}") for k in range(4)]
    hole = [Arc((0, 0), radius, -k * np.pi, -(k + 1) * np.pi, "hole") for k in range(2)]
    return extrude([sides, hole], z, h, groups=[[k] for k in range(6)] + [[6, 7]])


def filleted_box(size=(6.0, 5.0, 3.0), radius=1.5, h=0.5) -> NominalModel:
    """A box whose edge at the origin (along z) is round: face "fillet" is tangent to "front" and "left"."""
    x, y, z = size
    sides = [
        Arc((radius, radius), radius, np.pi, 1.5 * np.pi, "fillet"),
        Line((radius, 0), (x, 0), "front"),
        Line((x, 0), (x, y), "right"),
        Line((x, y), (0, y), "back"),
        Line((0, y), (0, radius), "left"),
    ]
    return extrude([sides], z, h)


def wedge(angle, length=5.0, height=3.0, h=0.6) -> NominalModel:
    """A prism whose profile is a triangle with ``angle`` [rad] between two sides of equal length."""
    tip = (length * np.cos(angle), length * np.sin(angle))
    sides = [Line((0, 0), (length, 0), "a"), Line((length, 0), tip, "c"), Line(tip, (0, 0), "b")]
    return extrude([sides], height, h)


def bent_plate(angle, length=4.0, height=3.0, h=0.5) -> NominalModel:
    """A prism of which two sides ("a" and "b") meet with ``angle`` [rad] between their normals."""
    half = 0.5 * angle
    left, right = (
        (-length * np.cos(half), length * np.sin(half)),
        (length * np.cos(half), length * np.sin(half)),
    )
    top = 2.0 + length * np.sin(half)
    sides = [
        Line(left, (0, 0), "a"),
        Line((0, 0), right, "b"),
        Line(right, (right[0], top)),
        Line((right[0], top), (left[0], top)),
        Line((left[0], top), left),
    ]
    return extrude([sides], height, h)


def thin_wall(thickness=0.2, h=0.5, length=5.0, height=4.0) -> NominalModel:
    """A plate of small thickness: faces "front" and "back" lie ``thickness`` apart."""
    return box((length, thickness, height), h)


def pyramid(n_sides=4, radius=4.0, height=4.0, subdivide=3) -> NominalModel:
    """A pyramid on a regular polygon: ``n_sides`` faces meet at the tip."""
    angle = 2 * np.pi * np.arange(n_sides) / n_sides
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(n_sides)])
    tip, centre = np.array([0, 0, height]), np.zeros(3)
    faces = [[(ring[k], ring[(k + 1) % n_sides], tip)] for k in range(n_sides)]
    faces.append([(ring[(k + 1) % n_sides], ring[k], centre) for k in range(n_sides)])
    return assemble([_flat_patch(corners, subdivide, f"side {k}") for k, corners in enumerate(faces)])


def _flat_patch(big_triangles, subdivide, name):
    points = np.concatenate([np.array(t, float) for t in big_triangles])
    triangles = np.arange(len(points)).reshape(-1, 3)
    for _ in range(subdivide):
        a, b, c = (points[triangles[:, k]] for k in range(3))
        quads = [(a, (a + b) / 2, (a + c) / 2), (b, (b + c) / 2, (a + b) / 2), (c, (a + c) / 2, (b + c) / 2)]
        quads.append(((a + b) / 2, (b + c) / 2, (a + c) / 2))
        points = np.concatenate([np.stack(q, axis=1).reshape(-1, 3) for q in quads])
        points, index = _merged(points)
        triangles = index.reshape(-1, 3)
    a, b, c = points[triangles[0]]
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    return Patch(points, triangles, np.tile(normal, (len(points), 1)), Plane(a, normal), name=name)


def _merged(points):
    _, first, index = np.unique(np.round(points, 7) + 0.0, axis=0, return_index=True, return_inverse=True)
    return points[first], index.reshape(-1)


def cone(radius=3.0, height=4.0, h=0.6) -> NominalModel:
    """Faces: bottom and mantle; the sample at the apex is singular and holds the axis as a stand-in."""
    n_around, n_up = round(2 * np.pi * radius / h), round(np.hypot(radius, height) / h)
    t = 2 * np.pi * np.arange(n_around) / n_around
    ray = np.column_stack([np.cos(t), np.sin(t), np.zeros(n_around)])
    levels = np.arange(n_up) / n_up
    rings = np.concatenate([radius * (1 - s) * ray + [0, 0, height * s] for s in levels])
    k = np.arange(n_around)
    ahead = (k + 1) % n_around
    triangles = []
    for level in range(n_up - 1):
        a, b = level * n_around + k, level * n_around + ahead
        triangles += [np.stack([a, b, b + n_around], 1), np.stack([a, b + n_around, a + n_around], 1)]
    apex = len(rings)
    last = (n_up - 1) * n_around
    triangles.append(np.stack([last + k, last + ahead, np.full(n_around, apex)], 1))
    slant = np.column_stack([height * ray[:, :2], np.full(n_around, radius)]) / np.hypot(radius, height)
    normals = np.concatenate([np.tile(slant, (n_up, 1)), [[0, 0, 1.0]]])
    singular = np.arange(apex + 1) == apex
    mantle = Patch(
        np.concatenate([rings, [[0, 0, height]]]), np.concatenate(triangles), normals,
        Cone([0, 0, height], [0, 0, -1], np.arctan2(radius, height)), singular=singular, name="mantle",
    )  # fmt: skip
    flat, bottom = _planar_mesh([radius * ray[:, :2]], h)
    down = np.tile([0, 0, -1.0], (len(flat), 1))
    base = Patch(
        np.column_stack([flat, np.zeros(len(flat))]), bottom[:, ::-1], down, Plane([0, 0, 0], [0, 0, -1]),
        name="bottom",
    )  # fmt: skip
    return assemble([base, mantle])


def sphere(radius=2.0, subdivide=3) -> NominalModel:
    """One face without an edge (an octahedron subdivided and pushed out)."""
    axes = np.eye(3)
    octants = [
        tuple(np.array(s)[:, None] * axes)[:: 1 if np.prod(s) > 0 else -1]
        for s in np.ndindex(2, 2, 2)
        for s in [tuple(2 * v - 1 for v in s)]
    ]
    points, triangles = np.array(octants, float).reshape(-1, 3), np.arange(24).reshape(-1, 3)
    for _ in range(subdivide):
        a, b, c = (points[triangles[:, k]] for k in range(3))
        parts = [(a, a + b, a + c), (b, b + c, a + b), (c, a + c, b + c), (a + b, b + c, a + c)]
        points = np.concatenate([np.stack(q, axis=1).reshape(-1, 3) for q in parts])
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        points, index = _merged(points)
        triangles = index.reshape(-1, 3)
    curvature = np.full((len(points), 2), -1 / radius)
    return assemble([Patch(radius * points, triangles, points, Freeform("sphere"), curvature)])
