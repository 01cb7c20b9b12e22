"""Write docs/case_study.md: the numbers of a run put into the text of page.md."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

import cadskin as cs

from . import part, shapes, skins, training
from .numbers import FAMILY, Convergence, chance, convergence, correlations, modes_by_printed_rule
from .process import MESHES, TRAINING_MESH, VARIED, DrawingProcess
from .shapes import Analysis
from .study import Study

TEXT = Path(__file__).with_name("page.md")
SHARES = (0.8, 0.9, 0.95, 0.99)


def write_page(path: Path, study: Study) -> Path:
    """Write the page; pictures are expected in ``images`` beside it."""
    values = _nominal(study) | _skins(study) | _training(study) | _mesh(study) | _measured(study)
    values |= _modes(study) | _predictions(study.material.analysis) | _performance(study)
    path.write_text(TEXT.read_text(encoding="utf-8").format(**values), encoding="utf-8")
    return path


def _nominal(study: Study) -> dict[str, Any]:
    surface = study.material.bottom.surface
    return {
        "n_faces": len(study.material.part.faces),
        "limit": skins.FLATNESS,
        "paper_points": part.PAPER_POINTS,
        "paper_triangles": part.PAPER_TRIANGLES,
        "points": surface.n_points,
        "triangles": surface.n_triangles,
        "points_off": 100 * (surface.n_points / part.PAPER_POINTS - 1),
        "triangles_off": 100 * (surface.n_triangles / part.PAPER_TRIANGLES - 1),
        "edge_length": part.BOTTOM_EDGE_LENGTH,
    }


def _skins(study: Study) -> dict[str, Any]:
    found = [skins.zones(skin.surface.points) for skin in study.material.gibbs]
    return {
        "pca_over": 100 * (np.mean([zone.pca / zone.minimum for zone in found]) - 1),
        "gibbs_length": skins.GIBBS_LENGTH,
        "gibbs_notes": "; ".join(study.gibbs_notes),
        "ellipsoid": skins.ELLIPSOID_HEIGHT,
        "noise": skins.NOISE_SIGMA,
    }


def _training(study: Study) -> dict[str, Any]:
    manifest = training.read_manifest()
    entries = manifest["runs"]
    diverged = [name for name, entry in entries.items() if "diverged" in entry]
    absent = [str(k) for k in range(training.N_PARTS) if k not in study.processes]
    names = list(VARIED)
    flatness = study.material.analysis.flatness
    rows = [
        [str(k), *(f"{getattr(process, name):.4g}" for name in names), f"{flat:.3f}"]
        for (k, process), flat in zip(study.processes.items(), flatness, strict=True)
    ]
    head = ["part", *(_words(name) for name in names), "flatness"]
    return {
        "n_parts": len(study.parts),
        "solver": manifest["solver"],
        "spread": ", ".join(f"{_words(name)} {value:g}" for name, value in VARIED.items()),
        "diverged": f"Diverged: {', '.join(diverged)}." if diverged else "No run diverged.",
        "absent": f" Not in the set: {', '.join(absent)}." if absent else "",
        "planned": training.N_PARTS,
        "process_table": _table(head, rows),
        "inspected": shapes.INSPECTED_HALF_LENGTH,
        "pad": DrawingProcess().pad_pressure,
        "command": training.COMMAND,
    }


def _mesh(study: Study) -> dict[str, Any]:
    meshes, analysis = study.material.meshes, study.material.analysis
    found = convergence(meshes, analysis.nominal)
    rows = [
        [name, str(sizes.layers), f"{sizes.bend_length:g}", f"{sizes.flat_length:g}", f"{sizes.arm_length:g}"]
        + ([str(len(meshes[name].points)), f"{meshes[name].cpu_seconds:.0f}", f"{found.flatness[name]:.3f}"]
           if name in meshes else ["not run", "", ""])
        for name, sizes in MESHES.items()
    ]  # fmt: skip
    head = ["mesh", "layers", "bend, mm", "flat, mm", "across, mm", "nodes", "CPU s", "flatness, mm"]
    return {
        "mesh_table": _table(head, rows),
        "training_mesh": TRAINING_MESH,
        "mesh_verdict": verdict(found, float(np.std(analysis.flatness, ddof=1))),
        "mesh_parts": _parts_by_mesh(study),
    }


def _parts_by_mesh(study: Study) -> str:
    """Say how the parts that were drawn on other meshes too compare with the training set."""
    nominal, told = study.material.analysis.nominal, []
    flatness = dict(zip(study.processes, study.material.analysis.flatness, strict=True))
    for name, parts in study.other_parts.items():
        fields = shapes.drawn_fields(list(parts.values()), nominal)
        values = [shapes.field_flatness(nominal, field) for field in fields]
        own = [flatness.get(k, np.nan) for k in parts]
        pairs = [f"{k}: {a:.3f} and {b:.3f}" for k, a, b in zip(parts, own, values, strict=True)]
        told.append(
            f"Flatness of parts on the {TRAINING_MESH} and the {name} mesh, in mm: {'; '.join(pairs)}."
        )
    return " ".join(told)


def verdict(found: Convergence, spread: float) -> str:
    """Say what the meshes tell, beside the standard deviation over the parts [mm]."""
    missing = [name for name in FAMILY if name not in found.flatness]
    if len(found.flatness) < 2:
        return "The nominal process was run on one mesh only, which tells nothing of convergence."
    if missing:
        told = f"Without the {' and '.join(missing)} mesh there is no extrapolation."
    elif found.limit is None or found.order is None or found.uncertainty is None:
        steps = [found.flatness[one] - found.flatness[other] for one, other in pairwise(FAMILY)]
        told = (
            f"From {FAMILY[0]} to {FAMILY[-1]} the flatness falls by {steps[0]:.3f}, then by "
            f"{steps[1]:.3f} mm.\n"
            "That shows no limit: Richardson's extrapolation has no meaning, and none of these meshes is\n"
            "fine enough."
        )
    else:
        told = (
            f"Richardson's extrapolation gives order {found.order:.2f} and limit {found.limit:.3f} mm; the\n"
            f"grid convergence index of the medium mesh (Roache 1997, factor 1.25) is\n"
            f"{found.uncertainty:.3f} mm."
        )
    weight = (
        "The mesh decides more about the flatness\nthan the process parameters do."
        if max(found.spread, found.uncertainty or 0.0) > spread
        else "That is less than the parts differ."
    )
    return (
        f"{told} The meshes differ by {found.spread:.3f} mm,\n"
        f"the parts of the training set by {spread:.3f} mm (standard deviation). {weight}\n"
        "What follows is right about the method and about these computed shapes; it is no prediction of the\n"
        "flatness of a real part."
    )


def _measured(study: Study) -> dict[str, Any]:
    seen = study.material.scanned
    return {
        "scan_points": len(seen.faces),
        "scan_noise": 1000 * shapes.SCAN_NOISE,
        "scan_notes": "; ".join(seen.registration.notes) if seen.registration else "",
        "scan_coverage": 100 * seen.coverage,
    }


def _modes(study: Study) -> dict[str, Any]:
    a = study.material.analysis
    model, on_grid = a.model, a.landmark_model
    shares = np.cumsum(model.variances) / model.total_variance
    grid_shares = np.cumsum(on_grid.variances) / on_grid.total_variance
    rows = [
        [
            str(k + 1),
            _um(model.sigmas[k]),
            f"{shares[k]:.4f}",
            _um(on_grid.sigmas[k]),
            f"{grid_shares[k]:.4f}",
        ]
        for k in range(min(4, model.n_modes, on_grid.n_modes))
    ]
    head = ["mode", "on the mesh: sqrt(lambda), um", "share so far", "on the landmarks, um", "share so far"]
    rules = [
        [f"{eps:g}", str(modes_by_printed_rule(model, eps)), str(model.truncate(share=eps).n_modes)]
        for eps in SHARES
    ]
    related = correlations(model.scores[:, 0], list(study.processes.values()))
    return {
        "n_landmarks": len(a.grid.cells),
        "cell": a.grid.size,
        "mean_rms": _um(float(np.sqrt((model.mean**2 * model.weights).sum()))),
        "total_sigma": _um(float(np.sqrt(model.total_variance))),
        "mode_table": _table(head, rows),
        "rule_table": _table(["eps", "modes kept, as printed", "modes kept by cadskin"], rules),
        "by_chance": chance(len(study.parts)),
        "correlations": ", ".join(f"{_words(name)} {value:+.2f}" for name, value in related.items()),
    }


def _predictions(a: Analysis) -> dict[str, Any]:
    names = {"none": "none", "least_squares": "least-squares plane", "minimum_zone": "minimum zone"}
    rows = [[text, _um(float(np.sqrt(a.variance(name))))] for name, text in names.items()]
    return {
        "alignment_table": _table(["alignment", "standard deviation over parts and area, um"], rows),
        "flat_minus": a.flatness_of({1: -2}),
        "flat_mean": a.flatness_of({}),
        "flat_plus": a.flatness_of({1: 2}),
        "n_real": a.kept.n_modes,
        "left_out": ", ".join(_um(value) for value in a.left_out[:4]),
        "conformity": str(a.conformity),
    }


def _performance(study: Study) -> dict[str, Any]:
    rows = [[t.step, t.size, _seconds(t.seconds)] for t in study.timings]
    return {
        "memory": study.peak_memory,
        "performance_table": _table(["step", "size", "CPU s"], rows),
        "machine": _machine(),
        "python": platform.python_version(),
        "version": cs.__version__,
    }


def _seconds(value: float) -> str:
    return f"{value:.2g}" if value < 10 else f"{value:.0f}"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _um(value: float) -> str:
    return f"{1000 * value:.3g}"


def _words(name: str) -> str:
    return name.replace("_", " ")


def _machine() -> str:
    """Return the name of the processor where the system tells it."""
    told = Path("/proc/cpuinfo")
    if told.is_file():
        for line in told.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()
