"""Open surfaces and small solids made of arrays: true `NominalModel` objects without a geometry kernel."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, Delaunay

from cadskin.deviation._linear import COLUMNS
from cadskin.shape import (
    Cone,
    Cylinder,
    DiscreteShape,
    Face,
    Freeform,
    NominalModel,
    Plane,
    Samples,
    Sphere,
    Torus,
)
from cadskin.shape.nominal import build_features


def model_of(parts) -> NominalModel:
    """Join parts (points, triangles, normals, ideal, name) at equal points; one feature each."""
    stacked = np.concatenate([part[0] for part in parts])
    _, first, vertex = np.unique(np.round(stacked, 7) + 0.0, axis=0, return_index=True, return_inverse=True)
    vertex = vertex.reshape(-1)
    offsets = np.cumsum([0, *[len(part[0]) for part in parts]])
    triangles = np.concatenate([vertex[part[1] + o] for part, o in zip(parts, offsets[:-1], strict=True)])
    face_ids = np.repeat(np.arange(len(parts)), [len(part[1]) for part in parts])
    surface = DiscreteShape(stacked[first], triangles, face_ids)
    rows = []
    for k in range(len(parts)):
        own = np.arange(offsets[k], offsets[k + 1])
        rows.append(own[np.sort(np.unique(vertex[own], return_index=True)[1])])
    row = np.concatenate(rows)
    normals = np.concatenate([part[2] for part in parts])[row]
    samples = Samples(
        vertex_ids=vertex[row],
        face_ids=np.repeat(np.arange(len(parts)), [len(r) for r in rows]),
        uv=np.full((len(row), 2), np.nan),
        normals=normals,
        curvatures=np.zeros((len(row), 2)),
        directions=_frames(normals),
        singular=np.zeros(len(row), bool),
    )
    faces = tuple(_face(k, surface, part) for k, part in enumerate(parts))
    starts = np.cumsum([0, *[len(r) for r in rows]])
    features = build_features(surface, [[k] for k in range(len(parts))], faces, samples, starts)
    return NominalModel(surface, faces, features, samples, closed=False)


def _face(index, surface, part):
    area = float(surface.triangle_areas[surface.face_ids == index].sum())
    centre, bounds = part[0].mean(axis=0), np.stack([part[0].min(0), part[0].max(0)])
    return Face(index, part[3], area, centre, part[2][len(part[2]) // 2], bounds, name=part[4])


def _frames(normals):
    other = np.where(np.abs(normals[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]])
    first = np.cross(normals, other)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first)], axis=1)


def grid_triangles(nu, nv, *, closed=False):
    """Triangles of a (nu, nv) grid of points, the first index wraps around when ``closed``."""
    i, j = (
        a.ravel() for a in np.meshgrid(np.arange(nu if closed else nu - 1), np.arange(nv - 1), indexing="ij")
    )
    a, b = i * nv + j, (i + 1) % nu * nv + j
    even = ((i + j) % 2 == 0)[:, None]
    one = np.where(even, np.stack([a, b, b + 1], 1), np.stack([a, b, a + 1], 1))
    two = np.where(even, np.stack([a, b + 1, a + 1], 1), np.stack([b, b + 1, a + 1], 1))
    return np.concatenate([one, two])


def plane_part(size=(120.0, 80.0), h=4.0, *, jitter=0.3, z=0.0, name="plane"):
    """An irregular mesh of a rectangle with its corner at the origin, normal +z."""
    nx, ny = (round(s / h) + 1 for s in size)
    x, y = (
        a.ravel()
        for a in np.meshgrid(np.linspace(0, size[0], nx), np.linspace(0, size[1], ny), indexing="ij")
    )
    rng = np.random.default_rng(5)
    inside_x = (x > 0) & (x < size[0])
    inside_y = (y > 0) & (y < size[1])
    x = x + inside_x * rng.uniform(-jitter, jitter, len(x)) * h
    y = y + inside_y * rng.uniform(-jitter, jitter, len(y)) * h
    triangles = Delaunay(np.column_stack([x, y])).simplices.astype(np.int64)
    points = np.column_stack([x, y, np.full(len(x), z)])
    corners = points[triangles]
    turn = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    triangles[turn < 0] = triangles[turn < 0][:, ::-1]
    keep = np.abs(turn) > 1e-6 * h * h
    return points, triangles[keep], np.tile([0.0, 0, 1], (len(points), 1)), Plane([0, 0, z], [0, 0, 1]), name


def plane(size=(120.0, 80.0), h=4.0, *, jitter=0.3) -> NominalModel:
    return model_of([plane_part(size, h, jitter=jitter)])


def tube(radius=20.0, height=60.0, h=4.0, *, turn=2 * np.pi) -> NominalModel:
    """The mantle of a shaft, axis z, open at the ends; a strip of it when ``turn`` < 2 pi."""
    closed = turn > 2 * np.pi - 1e-9
    n_around = max(6, round(radius * turn / h))
    n_along = round(height / h) + 1
    angle = np.linspace(0, turn, n_around, endpoint=not closed)
    t, z = (a.ravel() for a in np.meshgrid(angle, np.linspace(0, height, n_along), indexing="ij"))
    normals = np.column_stack([np.cos(t), np.sin(t), np.zeros_like(t)])
    points = radius * normals + np.column_stack([0 * z, 0 * z, z])
    triangles = grid_triangles(n_around, n_along, closed=closed)
    ideal = Cylinder([0, 0, 0], [0, 0, 1], radius)
    return model_of([(points, triangles, normals, ideal, "mantle")])


def ball(radius=20.0, count=800) -> NominalModel:
    """A sphere, its points on a Fibonacci spiral."""
    k = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * k / count), np.pi * (1 + np.sqrt(5)) * k
    normals = np.column_stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)])
    triangles = ConvexHull(normals).simplices.astype(np.int64)
    corners = normals[triangles]
    inward = np.einsum(
        "ij,ij->i", np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), corners[:, 0]
    )
    triangles[inward < 0] = triangles[inward < 0][:, ::-1]
    return model_of([(radius * normals, triangles, normals, Sphere([0, 0, 0], radius), "ball")])


def funnel(half_angle=0.4, low=20.0, high=60.0, h=3.0) -> NominalModel:
    """A cone, its apex at the origin and its axis z, from height ``low`` to ``high``."""
    slope = np.tan(half_angle)
    angle, z = _grid((0, 2 * np.pi), (low, high), 2 * np.pi * slope * high, h)
    ray = np.column_stack([np.cos(angle[0]), np.sin(angle[0]), np.zeros(angle[0].size)])
    points = slope * z[0][:, None] * ray + np.column_stack([0 * z[0], 0 * z[0], z[0]])
    normals = np.cos(half_angle) * ray - [0, 0, np.sin(half_angle)]
    triangles = grid_triangles(angle[1], z[1])
    return model_of([(points, triangles, normals, Cone([0, 0, 0], [0, 0, 1], half_angle), "funnel")])


def ring(major=20.0, minor=8.0, h=3.0, *, tube=2 * np.pi) -> NominalModel:
    """A torus about z; a strip of it when ``tube``, the angle around its tube, is below 2 pi."""
    angle, turn = _grid((0, 2 * np.pi), (0, tube), 2 * np.pi * major, h, minor)
    ray = np.column_stack([np.cos(angle[0]), np.sin(angle[0]), np.zeros(angle[0].size)])
    normals = np.cos(turn[0])[:, None] * ray + np.outer(np.sin(turn[0]), [0, 0, 1])
    points = major * ray + minor * normals
    ideal = Torus([0, 0, 0], [0, 0, 1], major, minor)
    return model_of([(points, grid_triangles(angle[1], turn[1]), normals, ideal, "ring")])


def wave(size=(60.0, 40.0), h=3.0) -> NominalModel:
    """A freeform face z = 4 sin(x / 9) cos(y / 12), normal upwards."""
    x, y = _grid((0, size[0]), (0, size[1]), size[0], h)
    slopes = 4 / 9 * np.cos(x[0] / 9) * np.cos(y[0] / 12), -4 / 12 * np.sin(x[0] / 9) * np.sin(y[0] / 12)
    normals = np.column_stack([-slopes[0], -slopes[1], np.ones(x[0].size)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = np.column_stack([x[0], y[0], 4 * np.sin(x[0] / 9) * np.cos(y[0] / 12)])
    return model_of([(points, grid_triangles(x[1], y[1]), normals, Freeform("bspline"), "wave")])


def _grid(first, second, length, h, radius=1.0):
    """Two coordinates of a grid, each with its number of lines; ``length`` is the way along the first."""
    n, m = round(length / h) + 1, round(radius * (second[1] - second[0]) / h) + 1
    u, v = np.meshgrid(np.linspace(*first, n), np.linspace(*second, m), indexing="ij")
    return (u.ravel(), n), (v.ravel(), m)


def rounded_slab(length=40.0, width=30.0, thickness=2.0, h=2.0) -> NominalModel:
    """A thin slab with half-round long edges: top, bottom and the rounds are one smooth patch."""
    r = thickness / 2
    n_flat, n_round, n_along = round(length / h), max(4, round(np.pi * r / (0.5 * h))), round(width / h) + 1
    arc = np.linspace(0, np.pi, n_round + 1)
    run = np.linspace(0, length, n_flat + 1)
    sections = [
        (np.column_stack([length - run, np.full_like(run, r)]), np.tile([0.0, 1], (len(run), 1)), "top"),
        (
            np.column_stack([-r * np.sin(arc), r * np.cos(arc)]),
            np.column_stack([-np.sin(arc), np.cos(arc)]),
            "left",
        ),
        (np.column_stack([run, np.full_like(run, -r)]), np.tile([0.0, -1], (len(run), 1)), "bottom"),
        (
            np.column_stack([length + r * np.sin(arc), -r * np.cos(arc)]),
            np.column_stack([np.sin(arc), -np.cos(arc)]),
            "right",
        ),
    ]
    y = np.linspace(0, width, n_along)
    parts = []
    for xz, n_xz, name in sections:
        points = np.column_stack(
            [np.repeat(xz[:, 0], n_along), np.tile(y, len(xz)), np.repeat(xz[:, 1], n_along)]
        )
        normals = np.column_stack(
            [np.repeat(n_xz[:, 0], n_along), np.zeros(len(points)), np.repeat(n_xz[:, 1], n_along)]
        )
        flat = name in ("top", "bottom")
        ideal = Plane([0, 0, xz[0, 1]], [0, 0, n_xz[0, 1]]) if flat else Freeform("extrusion")
        parts.append((points, grid_triangles(len(xz), n_along), normals, ideal, name))
    return model_of(parts)


def two_planes(h=4.0) -> NominalModel:
    """Two parallel rectangles 1 mm apart, "low" and "high": the two sides of a thin wall."""
    return model_of(
        [plane_part((60.0, 40.0), h, name="low"), plane_part((60.0, 40.0), h, z=1.0, name="high")]
    )


def covariance_of(sampler) -> np.ndarray:
    """The exact covariance (n_c, n_c) of a linear sampler: its matrix by unit vectors."""
    factor = sampler.transform(np.eye(sampler.latent, dtype=np.float32))
    return factor.T @ factor


def correlation_rows(sampler, rows) -> np.ndarray:
    """The exact rows (k, n_c) of the correlation of a surface field on one patch; sigma is 1.

    Two applications of the sampler's own symmetric map instead of one for every normal number; that both are
    the same is a test.
    """
    (field,), (places,) = sampler.fields, sampler.places_of
    place, scale = np.zeros(sampler.n_samples, dtype=int), np.zeros(sampler.n_samples)
    place[places.samples] = field.place_of_point[places.points]
    scale[places.samples] = field.scale[places.points]
    found = np.zeros((len(rows), sampler.n_samples))
    for start in range(0, len(rows), COLUMNS):
        mine = np.asarray(rows[start : start + COLUMNS])
        loads = np.zeros((len(field.order), COLUMNS), dtype=np.float32)
        loads[place[mine], np.arange(len(mine))] = 1.0
        response = field._coloured(field.mass @ field._coloured(loads))[place, : len(mine)]
        found[start : start + len(mine)] = scale[mine][:, None] * response.T * scale
    return found


def covariance_at(sampler, rows) -> np.ndarray:
    """The exact covariance at some samples."""
    total = []
    for start in range(0, sampler.latent, 256):
        unit = np.zeros((min(256, sampler.latent - start), sampler.latent), dtype=np.float32)
        unit[np.arange(len(unit)), start + np.arange(len(unit))] = 1.0
        total.append(sampler.transform(unit)[:, rows])
    factor = np.concatenate(total)
    return factor.T @ factor
