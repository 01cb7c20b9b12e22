"""The mesher against gmsh and against OCCT's own triangulation, CPU time in one run.

    python benchmarks/bench_mesher.py [triangles]

Each program meshes the same part in this process; times are process CPU seconds of the meshing alone, so that
other load on the machine matters little. The ratio at the end is what counts.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path

import cadquery as cq
import numpy as np
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools

from cadskin.cad.meshing import mesh_shape
from cadskin.cad.meshing.kernel import warm
from cadskin.shape.check import triangle_quality


def make_part():
    """Return a milled plate: 4 x 4 pockets with rounded corners, holes, a filleted rim (about 190 faces)."""
    plate = cq.Workplane().box(100, 100, 20).edges("|Z").fillet(8)
    plate = plate.faces(">Z").workplane().rarray(22, 22, 4, 4).rect(14, 10).cutBlind(-6)
    plate = plate.edges("|Z").edges(cq.selectors.BoxSelector((-45, -45, 3), (45, 45, 11))).fillet(3)
    plate = plate.faces("<Z").workplane().rarray(20, 20, 4, 4).hole(3, 4)
    return plate.faces("<Z").edges().fillet(0.5).val().wrapped


def run_ours(shape, edge_length):
    started = time.process_time()
    mesh = mesh_shape(shape, edge_length=edge_length)
    spent = time.process_time() - started
    return len(mesh.triangles), spent, triangle_quality(mesh.points, mesh.triangles)


def run_gmsh(shape, edge_length, algorithm=6):
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        with tempfile.TemporaryDirectory() as folder:
            path = str(Path(folder) / "part.brep")
            BRepTools.Write_s(shape, path)
            gmsh.model.occ.importShapes(path)
        gmsh.model.occ.synchronize()
        for name, value in (
            ("Mesh.MeshSizeMax", edge_length),
            ("Mesh.MeshSizeMin", edge_length / 8),
            ("Mesh.MeshSizeFromCurvature", 10),
            ("Mesh.Algorithm", algorithm),
        ):
            gmsh.option.setNumber(name, value)
        started = time.process_time()
        gmsh.model.mesh.generate(2)
        spent = time.process_time() - started
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        _, nodes = gmsh.model.mesh.getElementsByType(2)
    finally:
        gmsh.finalize()
    rows = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    rows[tags.astype(np.int64)] = np.arange(len(tags))
    triangles = rows[nodes.astype(np.int64)].reshape(-1, 3)
    return len(triangles), spent, triangle_quality(coordinates.reshape(-1, 3), triangles)


def run_occt(shape, edge_length):
    """Triangulate with OCCT at a chord error of a twentieth of the edge length (it has no edge length)."""
    BRepTools.Clean_s(shape)
    started = time.process_time()
    BRepMesh_IncrementalMesh(shape, edge_length / 20.0, False, 0.3, False)
    spent = time.process_time() - started
    points, triangles = cq.Shape.cast(shape).tessellate(edge_length / 20.0, 0.3)
    return (
        len(triangles),
        spent,
        triangle_quality(np.array([p.toTuple() for p in points]), np.array(triangles)),
    )


def main(wanted=1_000_000):
    warm()
    shape = make_part()
    area = cq.Shape.cast(shape).Area()
    mesh_shape(shape, edge_length=5.0)
    print(f"part: {len(cq.Shape.cast(shape).Faces())} faces, {area:.0f} mm²")
    print(f"{'':22}{'triangles':>10}{'CPU s':>8}{'s/100k':>8}{'median q':>10}{'q 1 %':>8}")
    for count in sorted({3_000, 50_000, wanted}):
        length = float(np.sqrt(area / (0.433 * count)))
        per_triangle = {}
        for name, run in (("cadskin", run_ours), ("gmsh, algorithm 6", run_gmsh), ("OCCT", run_occt)):
            n, spent, q = run(shape, length)
            per_triangle[name] = spent / n
            print(
                f"{name:22}{n:10d}{spent:8.2f}{1e5 * spent / n:8.2f}{np.median(q):10.3f}"
                f"{np.quantile(q, 0.01):8.2f}"
            )
        ratio = per_triangle["cadskin"] / per_triangle["gmsh, algorithm 6"]
        print(f"h = {length:.3f} mm: cadskin / gmsh, CPU per triangle: {ratio:.2f}")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory of this process, gmsh included: {peak:.0f} MB")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
