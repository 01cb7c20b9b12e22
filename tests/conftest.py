"""Small parts built from arrays, without a CAD kernel: a box and a shaft, with exact normals."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from cadskin.shape import Cylinder, DiscreteShape, Face, NominalModel, Plane, Samples, Source
from cadskin.shape.nominal import build_features


@dataclass(frozen=True, eq=False)
class PlainSkin:
    """The least that counts as a skin model: each vertex moves by the mean of its samples' vectors."""

    nominal: NominalModel
    deviation: np.ndarray
    provenance: dict = field(default_factory=dict)

    @property
    def vertex_deviation(self):
        ids = self.nominal.samples.vertex_ids
        return np.bincount(ids, weights=self.deviation) / np.bincount(ids)

    @property
    def surface(self):
        samples = self.nominal.samples
        shift = np.zeros_like(self.nominal.surface.points)
        np.add.at(shift, samples.vertex_ids, samples.normals * self.deviation[:, None])
        counts = np.bincount(samples.vertex_ids)[:, None]
        return self.nominal.surface.with_points(self.nominal.surface.points + shift / counts)


def part_of_patches(patches, groups, name):
    """Weld grids (points (u, v, 3), normals (u, v, 3), ideal) into a part; ``groups`` joins faces."""
    grids = [points.reshape(-1, 3) for points, _, _ in patches]
    _, first, index = np.unique(
        np.round(np.concatenate(grids), 9) + 0.0, axis=0, return_index=True, return_inverse=True
    )
    points = np.concatenate(grids)[first]
    vertex_grids, start = [], 0
    for grid, _, _ in patches:
        count = grid.shape[0] * grid.shape[1]
        vertex_grids.append(index.ravel()[start : start + count].reshape(grid.shape[:2]))
        start += count
    triangles, face_ids = [], []
    for i, (vertices, (_, normals, _)) in enumerate(zip(vertex_grids, patches, strict=True)):
        a, b = vertices[:-1, :-1].ravel(), vertices[1:, :-1].ravel()
        c, d = vertices[1:, 1:].ravel(), vertices[:-1, 1:].ravel()
        mine = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
        mine = mine[(mine[:, 0] != mine[:, 1]) & (mine[:, 1] != mine[:, 2]) & (mine[:, 2] != mine[:, 0])]
        corners = points[mine]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal_at = np.zeros_like(points)
        normal_at[vertices.ravel()] = normals.reshape(-1, 3)
        if (cross * normal_at[mine[:, 0]]).sum() < 0:
            mine = mine[:, ::-1]
        triangles.append(mine)
        face_ids.append(np.full(len(mine), i))
    surface = DiscreteShape(points, np.concatenate(triangles), np.concatenate(face_ids))
    areas = np.bincount(surface.face_ids, weights=surface.triangle_areas)
    faces = tuple(
        Face(
            index=i,
            ideal=ideal,
            area=float(areas[i]),
            centre=grid.reshape(-1, 3).mean(axis=0),
            normal=normals.reshape(-1, 3)[0],
            bounds=np.stack([grid.reshape(-1, 3).min(axis=0), grid.reshape(-1, 3).max(axis=0)]),
        )
        for i, (grid, normals, ideal) in enumerate(patches)
    )
    vertex_rows, face_rows, normal_rows, starts = [], [], [], [0]
    for group in groups:
        vertices = np.concatenate([vertex_grids[k].ravel() for k in group])
        of_face = np.concatenate([np.full(vertex_grids[k].size, k) for k in group])
        normals = np.concatenate([patches[k][1].reshape(-1, 3) for k in group])
        _, once = np.unique(vertices, return_index=True)
        vertex_rows.append(vertices[once])
        face_rows.append(of_face[once])
        normal_rows.append(normals[once])
        starts.append(starts[-1] + len(once))
    count = starts[-1]
    samples = Samples(
        np.concatenate(vertex_rows),
        np.concatenate(face_rows),
        np.full((count, 2), np.nan),
        np.concatenate(normal_rows),
        np.zeros((count, 2)),
        np.tile(np.eye(3)[:2], (count, 1, 1)),
        np.zeros(count, dtype=bool),
    )
    features = build_features(surface, groups, faces, samples, np.array(starts))
    return NominalModel(surface, faces, features, samples, source=Source(kind="mesh", part=name))


def make_box(size=(60.0, 40.0, 20.0), divisions=8):
    """A box centred at the origin; faces -x +x -y +y -z +z."""
    half = np.asarray(size) / 2
    ticks = np.linspace(-1, 1, divisions + 1)
    patches = []
    for axis in range(3):
        for sign in (-1, 1):
            normal = np.eye(3)[axis] * sign
            u, v = (k for k in range(3) if k != axis)
            grid = np.zeros((divisions + 1, divisions + 1, 3))
            grid[..., axis] = sign * half[axis]
            grid[..., u] = ticks[:, None] * half[u]
            grid[..., v] = ticks[None, :] * half[v]
            patches.append((grid, np.broadcast_to(normal, grid.shape), Plane(normal * half[axis], normal)))
    return part_of_patches(patches, [[i] for i in range(6)], "box")


def make_shaft(radius=10.0, length=40.0, around=48, along=12):
    """A cylinder along z of two half faces that are one feature (0), with caps below (1) and above (2)."""
    patches = []
    heights = np.linspace(0, length, along + 1)
    for half in range(2):
        angle = np.pi * (half + np.linspace(0, 1, around // 2 + 1))
        normal = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
        normals = np.repeat(normal[:, None], along + 1, axis=1)
        grid = radius * normals + heights[None, :, None] * np.array([0, 0, 1.0])
        patches.append((grid, normals, Cylinder(np.zeros(3), np.array([0, 0, 1.0]), radius)))
    angle = 2 * np.pi * np.arange(around + 1) / around
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    for sign, height in ((-1, 0.0), (1, length)):
        normal = np.array([0.0, 0.0, sign])
        grid = np.linspace(0, radius, 6)[None, :, None] * ring[:, None] + np.array([0, 0, height])
        patches.append((grid, np.broadcast_to(normal, grid.shape), Plane(grid[0, 0], normal)))
    return part_of_patches(patches, [[0, 1], [2], [3]], "shaft")


def wavy(part, amplitude=0.05):
    """Smooth deviations that differ on the two sides of every edge."""
    x, y, z = part.surface.points[part.samples.vertex_ids].T
    phase = 1.3 * part.feature_ids()
    return amplitude * np.sin(0.12 * x + 0.17 * y + 0.21 * z + phase)


@pytest.fixture(scope="session")
def array_box():
    return make_box()


@pytest.fixture(scope="session")
def array_shaft():
    return make_shaft()


@pytest.fixture(scope="session")
def plain_skin():
    """Make a stand-in skin model: ``plain_skin(part, deviation=None)``."""

    def make(part, deviation=None):
        return PlainSkin(part, wavy(part) if deviation is None else np.asarray(deviation, dtype=float))

    return make
