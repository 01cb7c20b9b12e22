"""From ten drawn parts to mean, modes and a prediction: figures 8 and 11 to 13 of the paper.

The bottom plane is inspected without a rim of 6 mm at the bends, because the sheet already curves there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cadquery as cq
import numpy as np
from scipy.interpolate import CloughTocher2DInterpolator
from scipy.spatial.transform import Rotation

import cadskin as cs
from cadskin.conform.flat import flatness_bounds
from cadskin.stats import (
    Conformity,
    LandmarkGrid,
    Registration,
    align_fields,
    conformity,
    landmark_grid,
    leave_one_out,
    parallel_analysis,
)

from .fe_run import Drawn
from .process import ARM_HALF_WIDTH
from .skins import FLATNESS, flatness

INSPECTED_HALF_LENGTH = 40.0  # mm; the bend begins at 46
CELL = 5.0  # mm, landmarks
SCAN_NOISE = 0.005  # mm
MOST_UNCERTAIN = 0.1  # mm, standard uncertainty of a reading


def inspected_plane(edge_length: float = 1.855) -> cs.NominalModel:
    """Return the nominal model of the inspected part of the bottom plane."""
    side, width = 2 * INSPECTED_HALF_LENGTH, 2 * ARM_HALF_WIDTH
    cross = cq.Workplane().box(side, width, 1, centered=(True, True, False))
    cross = cross.union(cq.Workplane().box(width, side, 1, centered=(True, True, False))).clean()
    return cs.nominal(cross.faces("<Z"), edge_length=edge_length, allow_open=True)


def whole_side(drawn: Drawn, layer: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return flat (n, 3) and drawn (n, 3) places of a layer of nodes, all four quarters of the sheet."""
    own = drawn.grid[:, 2] == layer
    flat, moved = drawn.points[own], (drawn.points + drawn.displacements)[own]
    signs = [np.array([sx, sy, 1.0]) for sx in (1, -1) for sy in (1, -1)]
    flat_all, moved_all = (np.vstack([points * sign for sign in signs]) for points in (flat, moved))
    _, first = np.unique(flat_all.round(4), axis=0, return_index=True)
    return flat_all[first], moved_all[first]


def bottom_heights(drawn: Drawn, places: np.ndarray) -> np.ndarray:
    """Return the deviation [mm] of the drawn bottom at places (n, 2), + = material added (downwards).

    The displacements are interpolated over the flat sheet; the point that has come to a place is found by
    fixed-point iteration. The free edges have moved inwards by some 0.02 mm: there the edge itself counts.
    """
    flat, moved = whole_side(drawn)
    near = np.abs(flat[:, :2]).max(axis=1) < INSPECTED_HALF_LENGTH + 12
    shift = CloughTocher2DInterpolator(flat[near, :2], (moved - flat)[near])
    origin = np.array(places)
    for _ in range(4):
        origin = np.asarray(places) - shift(_on_sheet(origin))[:, :2]
    return np.asarray(-shift(_on_sheet(origin))[:, 2])


def _on_sheet(places: np.ndarray) -> np.ndarray:
    """Pull places (n, 2) that lie beside an arm onto its edge."""
    beside = np.abs(places).min(axis=1) > ARM_HALF_WIDTH
    out = places.copy()
    row = np.flatnonzero(beside)
    column = np.abs(places[row]).argmin(axis=1)
    out[row, column] = np.sign(places[row, column]) * ARM_HALF_WIDTH
    return out


def drawn_fields(parts: Sequence[Drawn], nominal: cs.NominalModel) -> np.ndarray:
    """Return the deviation field (n, n_c) [mm] of each part as the solver's frame has it."""
    places = nominal.surface.points[nominal.samples.vertex_ids, :2]
    return np.stack([bottom_heights(part, places) for part in parts])


@dataclass(frozen=True, eq=False)
class Analysis:
    """What the paper's statistical shape analysis gives on the drawn parts; lengths in mm."""

    nominal: cs.NominalModel
    raw: np.ndarray  # (n, n_c), not aligned
    fields: np.ndarray  # (n, n_c), least-squares plane taken off
    flatness: np.ndarray  # (n,)
    grid: LandmarkGrid
    landmarks: np.ndarray  # (n, d)
    model: cs.StatisticalShapeModel  # on the nominal mesh
    landmark_model: cs.StatisticalShapeModel
    kept: cs.StatisticalShapeModel  # modes that parallel analysis finds real
    left_out: np.ndarray  # (k,) error on a part that was left out, by number of modes
    conformity: Conformity

    def predicted(self, coefficients: dict[int, float]) -> cs.SkinModel:
        """Return the skin model at coefficients in sigma units, Z(8)."""
        return self.model.skin_model(self.model.instance(coefficients))

    def flatness_of(self, coefficients: dict[int, float]) -> float:
        """Return the flatness of `predicted` [mm]."""
        return field_flatness(self.nominal, self.model.instance(coefficients))

    def variance(self, alignment: str) -> float:
        """Return the total variance [mm²] that parts aligned this way have."""
        fields = align_fields(self.raw, self.nominal, alignment=alignment)
        return cs.StatisticalShapeModel.fit(fields, nominal=self.nominal).total_variance


def analyse(parts: Sequence[Drawn], nominal: cs.NominalModel) -> Analysis:
    """Align, set landmarks, fit mean and modes, and ask how far ten parts can be trusted."""
    raw = drawn_fields(parts, nominal)
    fields = align_fields(raw, nominal, alignment="least_squares")
    grid, landmarks = landmarks_of(nominal, fields)
    model = cs.StatisticalShapeModel.fit(fields, nominal=nominal)
    on_grid = cs.StatisticalShapeModel.fit(landmarks, weights=grid.areas)
    real = parallel_analysis(model, fields, repeats=40)
    kept = model.truncate(modes=max(real, 1))
    return Analysis(
        nominal=nominal,
        raw=raw,
        fields=fields,
        flatness=np.array([field_flatness(nominal, field) for field in fields]),
        grid=grid,
        landmarks=landmarks,
        model=model,
        landmark_model=on_grid,
        kept=kept,
        left_out=leave_one_out(model).error,
        conformity=conformity(kept, _flatness_by_table(kept), FLATNESS),
    )


def landmarks_of(nominal: cs.NominalModel, fields: np.ndarray) -> tuple[LandmarkGrid, np.ndarray]:
    """Return the grid (i, j) and the height of each landmark (n, d) [mm]."""
    places = nominal.surface.points[nominal.samples.vertex_ids, :2]
    grid = landmark_grid(_inside(0.5), CELL)
    return grid, np.stack([grid.heights(np.column_stack([places, field])) for field in fields])


def _inside(step: float) -> np.ndarray:
    """Places (n, 2) all over the inspected plane."""
    ticks = np.arange(-INSPECTED_HALF_LENGTH + step / 2, INSPECTED_HALF_LENGTH, step)
    x, y = (axis.ravel() for axis in np.meshgrid(ticks, ticks))
    inside = np.minimum(np.abs(x), np.abs(y)) < ARM_HALF_WIDTH
    return np.column_stack([x, y])[inside]


def field_flatness(nominal: cs.NominalModel, field: np.ndarray) -> float:
    """Return the minimum-zone flatness of a deviation field [mm]."""
    places = nominal.surface.points[nominal.samples.vertex_ids, :2]
    return flatness(np.column_stack([places, field]))


def _flatness_by_table(model: cs.StatisticalShapeModel) -> Callable[[np.ndarray], np.ndarray]:
    """Return flatness as a function of fields: of one mode by a table, of more by the minimum zone."""
    nominal = model.nominal
    if model.n_modes > 1:
        return lambda fields: np.array([field_flatness(nominal, field) for field in fields])
    places = nominal.surface.points[nominal.samples.vertex_ids]
    normal = nominal.features[0].normals[0]
    table = np.linspace(-8, 8, 65)
    values = [flatness_bounds(places, normal, model.instance({1: b}))[1] for b in table]
    return lambda fields: np.interp(
        ((fields - model.mean) * model.weights) @ model.modes[0] / model.sigmas[0], table, values
    )


def scan(drawn: Drawn, count: int = 60_000, *, rng: int = 8) -> np.ndarray:
    """Return points (n, 3) [mm] as a fringe projector sees a part: both sides, noise, another frame.

    The surfaces between the nodes are bilinear; the cut edges of the sheet are not seen.
    """
    generator = np.random.default_rng(rng)
    clouds = [_scan_side(drawn, layer, count // 2, generator) for layer in (0, int(drawn.grid[:, 2].max()))]
    points = np.vstack(clouds) + SCAN_NOISE * generator.standard_normal((2 * (count // 2), 3))
    turn = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix()
    return points @ turn.T + [15.0, -8.0, 120.0]


def _scan_side(drawn: Drawn, layer: int, count: int, rng: np.random.Generator) -> np.ndarray:
    own = drawn.grid[:, 2] == layer
    moved = (drawn.points + drawn.displacements)[own]
    at = {(int(i), int(j)): row for row, (i, j) in enumerate(drawn.grid[own, :2])}
    cells = [
        [at[i, j], at[i + 1, j], at[i, j + 1], at[i + 1, j + 1]]
        for i, j in at
        if all(key in at for key in ((i + 1, j), (i, j + 1), (i + 1, j + 1)))
    ]
    corners = moved[np.array(cells)]
    areas = np.linalg.norm(np.cross(corners[:, 3] - corners[:, 0], corners[:, 2] - corners[:, 1]), axis=1)
    chosen = corners[rng.choice(len(cells), count, p=areas / areas.sum())]
    u, v = rng.random((2, count, 1))
    points = (chosen[:, 0] * (1 - u) + chosen[:, 1] * u) * (1 - v)
    points = points + (chosen[:, 2] * (1 - u) + chosen[:, 3] * u) * v
    return np.asarray(points * np.column_stack([rng.choice([-1, 1], (count, 2)), np.ones(count)]))


def registered(points: np.ndarray, part: cs.NominalModel) -> Registration:
    """Return the pose of a scan by a robust best fit, without a first guess."""
    return cs.register(points, part, alignment="robust", start="search")


def read(points: np.ndarray, part: cs.NominalModel, found: Registration) -> cs.MeasuredPart:
    """Return figure 8: the deviation at every nominal sample, NaN where the scan does not tell it."""
    seen = cs.measure(points, part, motion=found)
    known = seen.uncertainty < MOST_UNCERTAIN  # along the cut edges some planes rest on points in a row
    return replace(seen, deviation=np.where(known, seen.deviation, np.nan))
