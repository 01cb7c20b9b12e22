"""Made-up scans of known truth: exact points of a part, noise, outliers, what the scanner did not see."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from cadskin.shape import Plane
from cadskin.stats import RigidMotion
from cadskin.stats.surface_distance import Contacts, signed_distances
from support.parts import Arc, Line, Patch, assemble, extrude


@dataclass(frozen=True)
class Scan:
    points: np.ndarray  # in the frame of the part
    faces: np.ndarray  # true B-rep face, -1 for an outlier


@cache
def bracket(h=3.0):
    """An L-shaped plate, 80 x 50 x 12 mm, with a rounded corner and a hole: no symmetry."""
    sides = [
        Line((0, 0), (80, 0)),
        Line((80, 0), (80, 20)),
        Line((80, 20), (30, 20)),
        Line((30, 20), (30, 50)),
        Line((30, 50), (8, 50)),
        Arc((8, 42), 8, 0.5 * np.pi, np.pi),
        Line((0, 42), (0, 0)),
    ]
    hole = [Arc((62, 10), 5, -k * np.pi, -(k + 1) * np.pi) for k in range(2)]
    groups = [[k] for k in range(9)] + [[9, 10]]
    return extrude([sides, hole], 12.0, h, groups=groups)


@cache
def irregular_tetrahedron():
    """Four different faces and no mirror: its mirror image fits nowhere."""
    tips = np.array([[0, 0, 0], [60, 0, 0], [10, 40, 0], [20, 10, 30.0]])
    patches = []
    for corners in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)):
        a, b, c = tips[list(corners)]
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        n = 12
        weights = np.array([[i, j, n - i - j] for i in range(n + 1) for j in range(n + 1 - i)]) / n
        number = {(round(n * w[0]), round(n * w[1])): k for k, w in enumerate(weights)}
        up = [[number[i, j], number[i + 1, j], number[i, j + 1]] for i in range(n) for j in range(n - i)]
        down = [
            [number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]]
            for i in range(n - 1)
            for j in range(n - 1 - i)
        ]
        points = weights @ np.array([b, c, a])
        triangles = np.array(up + down)
        triangles = triangles[:, [2, 0, 1]]
        patches.append(Patch(points, triangles, np.tile(normal, (len(points), 1)), Plane(a, normal)))
    return assemble(patches)


def exact_points(part, n, rng):
    """Points on the true surfaces with their faces and normals, evenly over the area."""
    surface = part.surface
    triangles = rng.choice(surface.n_triangles, n, p=surface.triangle_areas / surface.area)
    weights = rng.dirichlet([1, 1, 1], n)
    points = np.einsum("nk,nkd->nd", weights, surface.points[surface.triangles[triangles]])
    normals = np.einsum("nk,nkd->nd", weights, part.samples.normals[part.corner_samples[triangles]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    faces = surface.face_ids[triangles]
    where = Contacts(triangles, faces, weights, normals, np.zeros(n, bool))
    for _ in range(3):
        points = points - signed_distances(part, points, where)[:, None] * normals
    return points, faces, normals


def scan(part, n, *, noise=0.02, outliers=0.03, seed=0, partial=True, field=None):
    """A scan without the bottom and one corner; half of the outliers anywhere, half in a clamp."""
    rng = np.random.default_rng(seed)
    points, faces, normals = exact_points(part, 3 * n, rng)
    if field is not None:
        points = points + field(points, faces)[:, None] * normals
    if partial:
        low, high = part.surface.points.min(0), part.surface.points.max(0)
        hidden = (normals[:, 2] < -0.5) | (points[:, :2] > low[:2] + 0.85 * (high - low)[:2]).all(axis=1)
        points, faces = points[~hidden], faces[~hidden]
    points, faces = points[:n] + noise * rng.standard_normal((n, 3)), faces[:n].copy()
    bad = rng.choice(n, int(outliers * n), replace=False)
    low, high = part.surface.points.min(0) - 10, part.surface.points.max(0) + 10
    points[bad] = rng.uniform(low, high, (len(bad), 3))
    clamp = bad[: len(bad) // 2]
    points[clamp] = 0.5 * (low + high) + rng.uniform(-4, 4, (len(clamp), 3)) + [0, -0.3 * (high - low)[1], 9]
    faces[bad] = -1
    return Scan(points, faces)


def pose(angle_deg, shift, seed=0):
    """A motion by an angle about a random axis and a shift [mm]."""
    rng = np.random.default_rng(seed)
    axis = rng.standard_normal(3)
    axis *= np.radians(angle_deg) / np.linalg.norm(axis)
    return RigidMotion(Rotation.from_rotvec(axis).as_matrix(), shift * rng.standard_normal(3) / np.sqrt(3))


def pose_error(part, found, true):
    """Root mean square displacement of the part's vertices [mm]."""
    away = found.after(true).apply(part.surface.points) - part.surface.points
    return float(np.sqrt((away**2).sum(axis=1).mean()))
