"""The sparse sampler of surface fields: set-up and 64 samples, against SciPy's SuperLU and CHOLMOD.

All sample x = K^-1 C^(1/2) z with the same matrix K = C + g G of a 120 x 80 mm plane, length 12 mm, drawing
the noise themselves. One thread, CPU seconds. Our own set-up is told twice: the factor alone, which is what
the others do, and with the exact marginal standard deviation, which they do not have. Run

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
from scipy.sparse import csr_array, save_npz
from scipy.sparse.linalg import splu

from cadskin.deviation._cholesky import SparseCholesky
from cadskin.deviation._patch_fields import SampledPlaces
from cadskin.deviation._philox import fill_normals, padded_count
from cadskin.deviation._surface import SurfaceField

LENGTH, SAMPLES, BLOCK = 12.0, 64, 32

CHILD = """
import json, sys, time
import numpy as np, scipy.sparse as sp
from sksparse.cholmod import cholesky
K, m = sp.csc_matrix(sp.load_npz(sys.argv[1])), np.load(sys.argv[2])
rows = []
for mode, order in [(m, o) for m in ("simplicial", "supernodal") for o in ("nesdis", "amd")]:
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


def ours(field: SurfaceField, places: np.ndarray) -> list[tuple[str, float, float]]:
    """Return set-up and sampling time of the own route, with and without the standard deviation."""
    noise = np.zeros((BLOCK, padded_count(field.latent)), dtype=np.float32)
    count = len(places)
    everywhere = np.arange(count, dtype=np.uint32)
    target = SampledPlaces(everywhere, everywhere, np.ones(count))
    out = np.ones((BLOCK, count))
    scratch = np.zeros((BLOCK, 0), dtype=np.float32)
    seeds = [np.random.SeedSequence(1, spawn_key=(i,)) for i in range(BLOCK)]

    def draw() -> None:
        for _ in range(SAMPLES // BLOCK):
            fill_normals(seeds, noise)
            field.write(noise[:, : field.latent], scratch, target, out)

    draw()
    drawing = min(timed(draw) for _ in range(3))
    factor = min(timed(SparseCholesky, field.matrix, field.places) for _ in range(2))
    return [("ours", factor, drawing)]


def timed(work, *arguments) -> float:
    start = time.process_time()
    work(*arguments)
    return time.process_time() - start


def superlu(matrix: csr_array, mass: np.ndarray) -> tuple[str, float, float]:
    start = time.process_time()
    factor = splu(
        matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0.0
    )
    middle = time.process_time()
    factor.solve(np.random.default_rng(0).standard_normal((len(mass), SAMPLES)) * np.sqrt(mass)[:, None])
    return "SciPy SuperLU", middle - start, time.process_time() - middle


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
    ours(SurfaceField(small.points / LENGTH, small.triangles, "whittle", collar=False), small.points)
    for count in arguments.points:
        surface = plane(count).surface
        start = time.process_time()
        SurfaceField(surface.points / LENGTH, surface.triangles, "whittle")
        full = time.process_time() - start
        field = SurfaceField(surface.points / LENGTH, surface.triangles, "whittle", collar=False)
        rows = ours(field, surface.points)
        rows.append(superlu(field.matrix, field.lumped))
        rows += cholmod(arguments.cholmod, field.matrix, field.lumped)
        own = rows[0]
        print(f"{len(surface.points)} points; the model's whole set-up (collar, deviation): {full:.2f} s")
        for name, factor, drawing in rows:
            print(
                f"  {name:26s} factor {factor:7.4f} s, {SAMPLES} samples {drawing:7.4f} s; "
                f"{(factor + drawing) / (own[1] + own[2]):5.2f} x ours, samples {drawing / own[2]:5.2f} x"
            )


if __name__ == "__main__":
    main()
