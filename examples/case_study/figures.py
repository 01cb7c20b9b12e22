"""The figures of the case study, numbered as in the paper."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CloughTocher2DInterpolator

import cadskin as cs

from .charts import COLOURS, LINE, Panel, draw_panels
from .fe_run import Drawn
from .shapes import CELL, Analysis, whole_side
from .skins import zones

BELOW = (0.42, -0.62, -0.66)  # the bottom plane's outer side looks down
ABOVE = (0.42, -0.62, 0.66)
TILE = (760, 570)


@dataclass(frozen=True, eq=False)
class Material:
    """Everything that is drawn."""

    part: cs.NominalModel
    bottom: cs.NominalModel
    gibbs: cs.SkinEnsemble
    ellipsoid: cs.SkinModel
    both: cs.SkinModel
    scanned: cs.MeasuredPart
    analysis: Analysis
    meshes: dict[str, Drawn]  # the nominal process by mesh


def draw_all(folder: Path, material: Material) -> list[Path]:
    """Draw every figure to ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    return [draw(folder / f"case_{name}.png", material) for name, draw in FIGURES.items()]


def _part(path: Path, m: Material) -> Path:
    shapes = [m.part, m.part, m.bottom]
    titles = ["The part, from above", "From below: 46 faces", "The bottom plane alone"]
    return cs.sheet(path, shapes, titles, views=[ABOVE, BELOW, BELOW], columns=3, tile=TILE)


def _tessellation(path: Path, m: Material) -> Path:
    surface = m.bottom.surface
    title = f"Bottom plane: {surface.n_points} points, {surface.n_triangles} triangles"
    panel = Panel(title, "x, mm", "y, mm", equal=True)
    panel.segments(_edges(surface), COLOURS[0], width=1.1)
    return draw_panels(path, [panel], size=(1000, 1040))


def _edges(surface: cs.DiscreteShape) -> np.ndarray:
    """Return the mesh edges (e, 4) ``x0 y0 x1 y1``."""
    t = surface.triangles
    pairs = np.unique(np.sort(np.vstack([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1), axis=0)
    return surface.points[pairs][:, :, :2].reshape(-1, 4)


def _gibbs(path: Path, m: Material) -> Path:
    found = [zones(skin.surface.points) for skin in m.gibbs]
    titles = ["Nominal bottom plane"] + [
        f"Gibbs {k}: flatness {z.minimum:.3f}, PCA zone {z.pca:.3f} mm" for k, z in enumerate(found, 1)
    ]
    return cs.sheet(
        path, [m.bottom, *m.gibbs], titles, view=BELOW, columns=2, tile=TILE, unit="mm", exaggeration=5
    )


def _scanned(path: Path, m: Material) -> Path:
    titles = ["Scan of a drawn part against CAD", "The same from below"]
    return cs.sheet(
        path,
        [m.scanned, m.scanned],
        titles,
        views=[ABOVE, BELOW],
        columns=2,
        tile=TILE,
        exaggeration=1,
        unit="mm",
    )


def _systematic(path: Path, m: Material) -> Path:
    titles = ["Ellipsoid", "Ellipsoid and Gaussian noise"]
    return cs.sheet(
        path, [m.ellipsoid, m.both], titles, view=BELOW, columns=2, tile=TILE, unit="mm", exaggeration=5
    )


def _landmarks(path: Path, m: Material) -> Path:
    grid, nominal = m.analysis.grid, m.analysis.nominal
    panel = Panel(f"{len(grid.cells)} landmarks (i, j), cells of {CELL:g} mm", "x, mm", "y, mm", equal=True)
    corners = grid.cells * CELL
    for a, b in (((0, 0), (1, 0)), ((1, 0), (1, 1)), ((1, 1), (0, 1)), ((0, 1), (0, 0))):
        ends = [corners + CELL * np.array(a), corners + CELL * np.array(b)]
        panel.segments(np.concatenate(ends, axis=1), LINE, width=1.4)
    panel.points(nominal.surface.points[:, :2], COLOURS[5], width=2.2)
    panel.points(grid.centres, COLOURS[4], width=6.5)
    return draw_panels(path, [panel], size=(1000, 1040))


def _alignment(path: Path, m: Material) -> Path:
    before = _sections(m.analysis, m.analysis.raw, "Bottom planes as the solver gives them")
    after = _sections(m.analysis, m.analysis.fields, "Aligned: least-squares plane taken off")
    return draw_panels(path, [before, after])


def _sections(analysis: Analysis, fields: np.ndarray, title: str) -> Panel:
    """Draw the heights of all parts over a line through the middle of an arm."""
    panel = Panel(title, "x, mm (y = 0)", "height, mm, downwards")
    x = np.linspace(-39.5, 39.5, 80)
    points = analysis.nominal.surface.points[analysis.nominal.samples.vertex_ids, :2]
    near = np.abs(points[:, 1]) < 8
    heights = CloughTocher2DInterpolator(points[near], fields[:, near].T)(np.column_stack([x, 0 * x]))
    for k, height in enumerate(heights.T):
        panel.line(np.column_stack([x, height]), COLOURS[k], name=f"part {k}")
    return panel


def _prediction(path: Path, m: Material) -> Path:
    steps = (-2.0, 0.0, 2.0)
    names = ["b1 = -2 sqrt(lambda1)", "mean model", "b1 = +2 sqrt(lambda1)"]
    titles = [
        f"{name}: flatness {m.analysis.flatness_of({1: b}):.3f} mm"
        for name, b in zip(names, steps, strict=True)
    ]
    skins = [m.analysis.predicted({1: b}) for b in steps]
    return cs.sheet(path, skins, titles, view=BELOW, columns=3, tile=TILE, unit="mm")


def _convergence(path: Path, m: Material) -> Path:
    panel = Panel(
        "Nominal process on finer meshes: half a section", "x, mm (y = 0)", "z of the outer side, mm"
    )
    for k, (name, drawn) in enumerate(m.meshes.items()):
        flat, moved = whole_side(drawn)
        own = (np.abs(flat[:, 1]) < 1e-6) & (flat[:, 0] >= 0) & (moved[:, 0] < 46)
        order = np.argsort(flat[own, 0])
        section = moved[own][order][:, [0, 2]]
        panel.line(
            section - [0, section[0, 1]], COLOURS[k], width=2.0, name=f"{name}, {len(drawn.points)} nodes"
        )
    return draw_panels(path, [panel], size=(1000, 640))


FIGURES: dict[str, Callable[[Path, Material], Path]] = {
    "part": _part,
    "tessellation": _tessellation,
    "gibbs": _gibbs,
    "systematic": _systematic,
    "scanned": _scanned,
    "landmarks": _landmarks,
    "alignment": _alignment,
    "prediction": _prediction,
    "convergence": _convergence,
}
