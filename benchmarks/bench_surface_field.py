"""The sparse sampler of surface fields: set-up and 64 samples, against SciPy's SuperLU and CHOLMOD.

All sample x = K^-1 C^(1/2) z with the same matrix K = C + g G of a 120 x 80 mm plane, C the lumped mass,
length 12 mm, drawing the noise themselves; set-up is the factor alone. One thread, CPU seconds, the best of
some runs. Beside it, the set-up of the whole model with its collar and its exact standard deviation, which
the others do not have. Run

    python benchmarks/bench_surface_field.py
    python benchmarks/bench_surface_field.py --cholmod other/env/bin/python   # that has scikit-sparse

CHOLMOD (LGPL and GPL) runs in a child process, so that this one needs no scikit-sparse; without it the
comparison is left out and the output says so.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from bench_fields import plane  # sets the number of threads before numpy loads

import numpy as np  # isort: skip
from scipy.sparse import csr_array, dia_array, save_npz
from scipy.sparse.linalg import splu

from cadskin.deviation._cholesky import SparseCholesky
from cadskin.deviation._linear import COLUMNS, columns_of, write_columns
from cadskin.deviation._philox import fill_normals, padded_count
from cadskin.deviation._surface import SurfaceField
from cadskin.shape.operators import cotangent_laplacian, lumped_mass

LENGTH, POLE, SAMPLES = 12.0, 0.5, 64

CHILD = """
import json, sys, time
import numpy as np, scipy.sparse as sp
from sksparse.cholmod import cholesky
K, m = sp.csc_matrix(sp.load_npz(sys.argv[1])), np.load(sys.argv[2])
rows = []
calls = [("auto", "default")] + [(m, o) for m in ("simplicial", "supernodal") for o in ("nesdis", "amd")]
for mode, order in calls:
    best = []
    for _ in range(3):
        start = time.process_time()
        factor = cholesky(K, mode=mode, ordering_method=order)
        middle = time.process_time()
        z = np.random.default_rng(0).standard_normal((len(m), int(sys.argv[3]))) * np.sqrt(m)[:, None]
        factor(z)
        best.append((middle - start, time.process_time() - middle))
    rows.append([f"CHOLMOD {mode}, {order}", *min(best, key=sum)])
print(json.dumps(rows))
"""


def sparse_model(points: np.ndarray, triangles: np.ndarray) -> tuple[csr_array, np.ndarray]:
    """Return K = C + g G and the diagonal of C."""
    mass = lumped_mass(points, triangles)
    return csr_array(
        POLE * cotangent_laplacian(points, triangles) + dia_array((mass[None], [0]), shape=(len(mass),) * 2)
    ), mass


def ours(matrix: csr_array, mass: np.ndarray, places: np.ndarray) -> tuple[str, float, float]:
    """Return set-up and sampling time of the own factor."""
    count = len(mass)
    solver = SparseCholesky(matrix, places)
    root = np.sqrt(mass).astype(np.float32)[solver.order, None]
    rows = np.argsort(solver.order).astype(np.uint32)
    everywhere = np.arange(count, dtype=np.uint32)
    noise = np.zeros((COLUMNS, padded_count(count)), dtype=np.float32)
    out = np.ones((COLUMNS, count))
    seeds = [np.random.SeedSequence(1, spawn_key=(i,)) for i in range(COLUMNS)]

    def draw() -> None:
        for _ in range(SAMPLES // COLUMNS):
            fill_normals(seeds, noise)
            loads = columns_of(noise[:, :count])
            loads *= root
            solver.solve_columns(loads)
            write_columns(loads, rows, np.ones(count), everywhere, out)

    draw()
    drawing = min(timed(draw) for _ in range(5))
    factor = min(timed(SparseCholesky, matrix, places) for _ in range(5))
    return "ours", factor, drawing


def timed(work, *arguments) -> float:
    start = time.process_time()
    work(*arguments)
    return time.process_time() - start


def superlu(matrix: csr_array, mass: np.ndarray) -> tuple[str, float, float]:
    options = {"options": {"SymmetricMode": True}, "diag_pivot_thresh": 0.0}
    columns = matrix.tocsc()
    best = []
    for _ in range(2):
        start = time.process_time()
        factor = splu(columns, permc_spec="MMD_AT_PLUS_A", **options)
        middle = time.process_time()
        loads = np.random.default_rng(0).standard_normal((len(mass), SAMPLES)) * np.sqrt(mass)[:, None]
        factor.solve(loads)
        best.append((middle - start, time.process_time() - middle))
    return "SciPy SuperLU", *min(best, key=sum)


def cholmod(python: str, matrix: csr_array, mass: np.ndarray) -> list[tuple[str, float, float]]:
    with tempfile.TemporaryDirectory() as folder:
        files = [str(Path(folder) / name) for name in ("matrix.npz", "mass.npy")]
        save_npz(files[0], matrix)
        np.save(files[1], mass)
        found = subprocess.run(
            [python, "-c", CHILD, *files, str(SAMPLES)], capture_output=True, text=True, check=False
        )
    if found.returncode:
        print(f"CHOLMOD is left out: {python} has no working scikit-sparse ({found.stderr.splitlines()[-1]})")
        return []
    return [tuple(row) for row in json.loads(found.stdout)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, nargs="+", default=[10_000, 100_000])
    parser.add_argument("--cholmod", default=sys.executable, help="a Python with scikit-sparse")
    arguments = parser.parse_args()
    small = plane(2_000).surface
    ours(*sparse_model(small.points / LENGTH, small.triangles), small.points)  # compiles
    for count in arguments.points:
        surface = plane(count).surface
        full = timed(SurfaceField, surface.points / LENGTH, surface.triangles, "whittle")
        matrix, mass = sparse_model(surface.points / LENGTH, surface.triangles)
        rows = [ours(matrix, mass, surface.points), superlu(matrix, mass)]
        rows += cholmod(arguments.cholmod, matrix, mass)
        own = rows[0]
        print(f"{len(mass)} points; the model's whole set-up (collar, deviation): {full:.2f} s")
        for name, factor, drawing in rows:
            print(
                f"  {name:26s} factor {factor:7.4f} s, {SAMPLES} samples {drawing:7.4f} s; "
                f"together {(factor + drawing) / (own[1] + own[2]):5.2f} x, samples {drawing / own[2]:5.2f} x"
            )


if __name__ == "__main__":
    main()
