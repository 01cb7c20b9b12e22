"""Darboux frames of meshes by quadric fits, against one pass of vertex normals; growth with the mesh.

A freeform sheet, 120 x 80 mm. One thread, CPU seconds, both from the same mesh in one process. Run

    python benchmarks/bench_darboux.py
"""

from __future__ import annotations

import argparse

from bench_fields import best, plane  # sets the number of threads before numpy loads

import numpy as np  # isort: skip

from cadskin.shape.darboux import darboux_frames
from cadskin.shape.discrete import vertex_normals


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, nargs="+", default=[10_000, 100_000, 1_000_000])
    rows = []
    for count in parser.parse_args().points:
        surface = plane(count).surface
        x, y, _ = surface.points.T
        points = np.column_stack([x, y, 5 * np.sin(x / 20) * np.cos(y / 15)])
        normals = best(vertex_normals, points, surface.triangles)
        frames = best(darboux_frames, points, surface.triangles, repeats=2)
        rows.append((len(points), normals, frames))
        print(
            f"{len(points)} points: normals {normals:.4f} s, frames {frames:.4f} s, "
            f"{frames / normals:.1f} times as long"
        )
    if len(rows) > 1:
        points, normals, frames = np.log(np.array(rows)).T
        growth = [np.polyfit(points, cost, 1)[0] for cost in (normals, frames)]
        print(f"grows like n^{growth[0]:.2f} (normals) and n^{growth[1]:.2f} (frames)")


if __name__ == "__main__":
    main()
