"""71 From a scan to deviations: a made part is scanned in any pose, brought to its CAD model and measured.

The scan is made up: points anywhere on the mesh of a simulated part, 10 um noise, 2 % outliers, turned and
moved. `register` finds the pose without a guess, `measure` reads the deviation at every nominal sample. A
best fit takes off what the form has of a rigid motion: both fields are aligned before they are compared.
`main` returns the root mean square difference of the aligned fields, in um.
"""

from __future__ import annotations

import cadquery as cq
import numpy as np
from scipy.spatial.transform import Rotation

import cadskin as cs
from cadskin.stats import align_fields


def made_part() -> cs.SkinModel:
    bracket = cq.Workplane().box(60, 40, 8).faces(">Z").workplane().center(-20, 0).rect(10, 40).extrude(15)
    bracket = bracket.faces("<Z").workplane().center(15, 8).rect(14, 10).cutThruAll()
    part = cs.nominal(bracket, edge_length=2.5)
    return cs.simulate(part, cs.GaussianField(sigma=0.02, length=20), rng=3)


def scan(skin: cs.SkinModel, count: int, rng: np.random.Generator) -> np.ndarray:
    surface = skin.surface
    triangles = rng.choice(surface.n_triangles, count, p=surface.triangle_areas / surface.area)
    weights = rng.dirichlet([1, 1, 1], count)
    points = np.einsum("nk,nkd->nd", weights, surface.points[surface.triangles[triangles]])
    points += 0.01 * rng.standard_normal(points.shape)
    points[::50] += rng.uniform(-5, 5, points[::50].shape)
    turn = Rotation.from_rotvec([1.0, 2.0, -0.5]).as_matrix()
    return points @ turn.T + [120.0, -30.0, 65.0]


def measured() -> tuple[cs.SkinModel, cs.MeasuredPart]:
    skin = made_part()
    points = scan(skin, 40_000, np.random.default_rng(5))
    found = cs.register(points, skin.nominal, alignment="robust", start="search")
    return skin, cs.measure(points, skin.nominal, motion=found)


def main() -> float:
    skin, part = measured()
    fields = align_fields([skin, part], skin.nominal, alignment="least_squares")
    difference = fields[1] - fields[0]
    return float(1000 * np.sqrt(np.nanmean(difference**2)))


if __name__ == "__main__":
    skin, part = measured()
    print(f"{100 * part.coverage:.1f} % of the samples measured, {part.outliers.sum()} points set aside")
    print(f"pose known to {1000 * np.sqrt(part.registration.covariance[0, 0]):.2f} um in x (noise alone)")
    print(f"difference to the truth: {main():.1f} um")
