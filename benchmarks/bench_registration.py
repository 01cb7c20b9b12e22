"""Registration of scans to CAD: pose error, labels and time, against small_gicp in the same run.

A cadquery bracket; 20 um noise, 3 % outliers, no bottom, one corner missing; start 3.9 degrees and 4.4 mm
off. small_gicp gets a cloud of 400,000 exact CAD points as its target; its time is given without and with the
indexing of that target (our index is made once per part and not counted). One thread, CPU seconds.
Run

    python benchmarks/bench_registration.py [--million]
"""

from __future__ import annotations

import argparse
import os
import time

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # before numpy loads

import numpy as np  # noqa: E402
from scipy.spatial.transform import Rotation  # noqa: E402

import cadskin as cs  # noqa: E402
from cadskin.stats import RigidMotion  # noqa: E402
from cadskin.stats.surface_distance import Contacts, contacts, signed_distances  # noqa: E402


def bracket() -> cs.NominalModel:
    import cadquery as cq

    plate = cq.Workplane().box(120, 80, 10, centered=(True, True, False)).edges("|Z").fillet(6)
    wall = cq.Workplane().center(-50, 0).box(14, 80, 30, centered=(True, True, False))
    part = plate.union(wall.edges("|X and >Z").fillet(8))
    holes = [(30, 20), (30, -20), (5, 0), (-20, 25)]
    part = part.faces("<Z").workplane().pushPoints(holes).hole(9)
    part = part.cut(cq.Workplane("YZ", origin=(-70, 10, 20)).cylinder(60, 4))
    return cs.nominal(part, edge_length=2.5)


def exact(part: cs.NominalModel, n: int, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Points on the true surfaces, their faces and normals."""
    surface = part.surface
    triangles = rng.choice(surface.n_triangles, n, p=surface.triangle_areas / surface.area)
    weights = rng.dirichlet([1, 1, 1], n)
    points = np.einsum("nk,nkd->nd", weights, surface.points[surface.triangles[triangles]])
    normals = np.einsum("nk,nkd->nd", weights, part.samples.normals[part.corner_samples[triangles]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    where = Contacts(triangles, surface.face_ids[triangles], weights, normals, np.zeros(n, dtype=bool))
    for _ in range(3):
        points = points - signed_distances(part, points, where)[:, None] * normals
    return points, where.faces, normals


def scan(part: cs.NominalModel, n: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    points, faces, normals = exact(part, int(2.2 * n), rng)
    hidden = (normals[:, 2] < -0.5) | ((points[:, 0] > 40) & (points[:, 1] > 20))
    points, faces = points[~hidden][:n], faces[~hidden][:n].copy()
    points = points + 0.02 * rng.standard_normal(points.shape)
    bad = rng.choice(len(points), int(0.03 * len(points)), replace=False)
    low, high = part.surface.points.min(axis=0) - 10, part.surface.points.max(axis=0) + 10
    points[bad] = rng.uniform(low, high, (len(bad), 3))
    points[bad[::2]] = np.array([50, -30, 15]) + rng.uniform(-4, 4, (len(bad[::2]), 3))
    faces[bad] = -1
    return points, faces


def error_um(
    part: cs.NominalModel, rotation: np.ndarray, translation: np.ndarray, true: RigidMotion
) -> float:
    moved = true.apply(part.surface.points) @ rotation.T + translation
    return 1e3 * float(np.sqrt(((moved - part.surface.points) ** 2).sum(axis=1).mean()))


def compare(part: cs.NominalModel, n: int) -> None:
    points, faces = scan(part, n)
    axis = np.radians(3.9) * np.array([0.6, -0.64, 0.48])
    true = RigidMotion(Rotation.from_rotvec(axis).as_matrix(), np.array([2.5, -3.0, 2.0]))
    given = true.apply(points)
    cs.register(given[:2000], part, alignment="robust")  # compile
    start = time.process_time()
    found = cs.register(given, part, alignment="robust")
    ours = time.process_time() - start
    where = contacts(part, found.motion.apply(given))
    inlier = (faces >= 0) & ~where.on_edge
    right = float((where.faces[inlier] == faces[inlier]).mean())
    start = time.process_time()
    measured = cs.measure(given, part, motion=found)
    reading = time.process_time() - start
    error = error_um(part, found.motion.rotation, found.motion.translation, true)
    print(
        f"{len(points)} points, ours: {error:.3f} um, "
        f"{ours:.2f} s, labels {100 * right:.2f} % right; reading {part.n_samples} samples {reading:.2f} s, "
        f"coverage {100 * measured.coverage:.0f} %"
    )
    try:
        import small_gicp
    except ImportError:
        print("  small_gicp is not installed")
        return
    dense = exact(part, 400_000, np.random.default_rng(2))[0]
    for kind in ("GICP", "PLANE_ICP"):
        start = time.process_time()
        target, tree = small_gicp.preprocess_points(dense, downsampling_resolution=0.5, num_threads=1)
        indexing = time.process_time() - start
        start = time.process_time()
        source, _ = small_gicp.preprocess_points(given, downsampling_resolution=0.5, num_threads=1)
        result = small_gicp.align(
            target, source, tree, registration_type=kind, max_correspondence_distance=5.0, num_threads=1
        )
        if result.converged:  # once more with a narrow gate against the outliers
            result = small_gicp.align(
                target, source, tree, init_T_target_source=result.T_target_source,
                registration_type=kind, max_correspondence_distance=0.5, num_threads=1,
            )  # fmt: skip
        theirs = time.process_time() - start
        matrix = result.T_target_source
        print(
            f"  small_gicp {kind}: {error_um(part, matrix[:3, :3], matrix[:3, 3], true):.3f} um, "
            f"{theirs:.2f} s ({theirs + indexing:.2f} with its target); ours takes {ours / theirs:.2f} "
            f"({ours / (theirs + indexing):.2f}) of its time"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--million", action="store_true", help="a million points too")
    part = bracket()
    print(part)
    for n in [103_000, *([1_000_000] if parser.parse_args().million else [])]:
        compare(part, n)


if __name__ == "__main__":
    main()
