"""The whole study in one go, each step timed."""

from __future__ import annotations

import resource
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import cadskin as cs
from cadskin.stats import align_fields

from . import part, shapes, skins, training
from .fe_run import Drawn
from .figures import Material
from .process import MESHES, TRAINING_MESH, DrawingProcess

Result = TypeVar("Result")


@dataclass(frozen=True)
class Timing:
    """CPU seconds of one step, of all threads, and what was done in them."""

    step: str
    size: str
    seconds: float


class Clock:
    """Runs steps and keeps what they took."""

    def __init__(self) -> None:
        self.timings: list[Timing] = []

    def run(self, step: str, size: str, work: Callable[[], Result], *, repeats: int = 1) -> Result:
        """Run ``work`` and keep the mean CPU time; more than one run is timed after a first one."""
        if repeats > 1:
            work()
        start = time.process_time()
        for _ in range(repeats):
            result = work()
        self.timings.append(Timing(step, size, (time.process_time() - start) / repeats))
        return result


@dataclass(frozen=True, eq=False)
class Study:
    """Everything the page tells."""

    material: Material
    timings: list[Timing]
    processes: dict[int, DrawingProcess]  # by the number of the part
    parts: list[Drawn]
    peak_memory: float  # MB
    gibbs_notes: tuple[str, ...]  # how well the trial chains have met
    other_parts: dict[str, dict[int, Drawn]]  # by mesh and number, parts drawn on other meshes too


def run() -> Study:
    """Run the case study on the drawn parts that ship."""
    clock = Clock()
    _warm_up()
    runs, drawn = training.training_set()
    parts = list(drawn.values())
    ran = [name for name in MESHES if training.has(f"nominal_{name}")]
    meshes = {name: training.load(f"nominal_{name}") for name in ran}
    whole = clock.run("mesh the part", "46 faces", part.whole_part, repeats=3)
    bottom = clock.run("mesh the bottom plane (Fig. 7)", "2362 points", part.bottom_plane, repeats=3)
    gibbs, notes = _gibbs(clock, bottom)
    size = f"{bottom.n_samples} points"
    ellipsoid = clock.run("ellipsoid (Fig. 9)", size, lambda: skins.ellipsoid_skin(bottom), repeats=3)
    both = clock.run(
        "the same and noise (Fig. 10)", size, lambda: skins.ellipsoid_and_noise(bottom), repeats=3
    )
    scanned = _scan(clock, parts[0], whole)
    _drawing_time(clock, parts)
    analysis = _analysis(clock, parts)
    material = Material(whole, bottom, gibbs, ellipsoid, both, scanned, analysis, meshes)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    processes = {k: run.process for k, run in runs.items()}
    return Study(material, clock.timings, processes, parts, peak, notes, _other_parts())


def _other_parts() -> dict[str, dict[int, Drawn]]:
    """Return the parts of the training set that were drawn on other meshes as well."""
    found: dict[str, dict[int, Drawn]] = {}
    for mesh in (name for name in MESHES if name != TRAINING_MESH):
        for k in range(training.N_PARTS):
            if training.has(f"{mesh}_{k:02d}"):
                found.setdefault(mesh, {})[k] = training.load(f"{mesh}_{k:02d}")
    return found


def _warm_up() -> None:
    """Compile and import what the steps need, on a small part, so that no step pays for it."""
    small = part.bottom_plane(6.0)
    skins.gibbs_skins(small, 1)
    skins.ellipsoid_and_noise(small)
    skins.zones(skins.ellipsoid_skin(small).surface.points)


def _gibbs(clock: Clock, bottom: cs.NominalModel) -> tuple[cs.SkinEnsemble, tuple[str, ...]]:
    points = f"{bottom.n_samples} points"
    sampler = clock.run(
        "Gibbs: matrices and 32 trial chains", points, lambda: skins.gibbs_model().prepare(bottom)
    )
    clock.run("Gibbs: one chain of 1000 sweeps", points, lambda: sampler.sample(size=8, rng=1), repeats=1)
    clock.timings[-1] = _per(clock.timings[-1], 8)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cs.CadskinWarning)  # the mesh is as coarse as the paper's
        field = cs.GaussianField(skins.GIBBS_SIGMA, skins.GIBBS_LENGTH, "whittle", metric="surface")
        exact = field.prepare(bottom)
    clock.run("the same law without a chain: one field", points, lambda: exact.sample(size=100, rng=1))
    clock.timings[-1] = _per(clock.timings[-1], 100)
    lot = clock.run(
        "three skin models of flatness 0.3 (Fig. 1, 2)", points, lambda: skins.gibbs_skins(bottom)
    )
    surface = lot[0].surface.points
    clock.run("minimum-zone flatness of one", points, lambda: skins.flatness(surface), repeats=5)
    return lot, sampler.notes


def _scan(clock: Clock, drawn: Drawn, whole: cs.NominalModel) -> cs.MeasuredPart:
    points = shapes.scan(drawn)
    size = f"{len(points)} points"
    found = clock.run("register a scan, no guess (Fig. 8)", size, lambda: shapes.registered(points, whole))
    return clock.run(
        "read it at every sample", f"{whole.n_samples} samples", lambda: shapes.read(points, whole, found)
    )


def _drawing_time(clock: Clock, parts: list[Drawn]) -> None:
    mean = sum(drawn.cpu_seconds for drawn in parts) / len(parts)
    clock.timings.append(
        Timing("draw one part (CalculiX, one thread)", f"{len(parts[0].points)} nodes", mean)
    )


def _analysis(clock: Clock, parts: list[Drawn]) -> shapes.Analysis:
    nominal = shapes.inspected_plane()
    size = f"{len(parts)} x {nominal.n_samples}"
    raw = clock.run("read the drawn bottoms", size, lambda: shapes.drawn_fields(parts, nominal))
    fields = clock.run(
        "align them", size, lambda: align_fields(raw, nominal, alignment="least_squares"), repeats=5
    )
    clock.run("landmarks (Fig. 11)", f"{len(parts)} x 220", lambda: shapes.landmarks_of(nominal, fields))
    model = clock.run(
        "mean and modes, Z(4) to Z(7)",
        size,
        lambda: cs.StatisticalShapeModel.fit(fields, nominal=nominal),
        repeats=5,
    )
    clock.run(
        "predict one skin model, Z(8) (Fig. 13)", size.split(" x ")[1],
        lambda: model.skin_model(model.instance({1: -2})).surface, repeats=5,
    )  # fmt: skip
    return clock.run("analysis with all checks", size, lambda: shapes.analyse(parts, nominal))


def _per(timing: Timing, count: int) -> Timing:
    return Timing(timing.step, timing.size, timing.seconds / count)
