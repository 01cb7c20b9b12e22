"""The weld on parts that come through the CAD kernel and the mesher."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("cadquery")

import cadquery as cq

import cadskin as cs
from cadskin.shape import smooth_patches
from cadskin.shape.check import check_mesh, inverted_triangles
from cadskin.skin import check_skin, simulate, weld, weld_report
from cadskin.skin.weld import prepare_weld


@pytest.fixture(scope="module")
def plate():
    return cs.nominal(cq.Workplane().box(30, 20, 6).faces(">Z").workplane().hole(8), edge_length=1.2)


PARTS = {
    "plate": lambda: cq.Workplane().box(30, 20, 6).faces(">Z").workplane().hole(8),
    "rounded edges": lambda: cq.Workplane().box(20, 14, 8).edges("|Z").fillet(3),
    "shell": lambda: cq.Workplane().box(20, 14, 8).faces(">Z").shell(-2),
    "cone": lambda: cq.Workplane(obj=cq.Solid.makeCone(8, 0, 12)),
    "torus": lambda: cq.Workplane(obj=cq.Solid.makeTorus(10, 3)),
    "drilled shaft": lambda: (
        cq.Workplane()
        .circle(6)
        .extrude(20, both=True)
        .cut(cq.Workplane("YZ").circle(2).extrude(9, both=True))
    ),
}


def _noise(part, amplitude):
    """White noise of ``amplitude`` times the local edge length, continuous over tangent edges."""
    ends = part.surface.edges
    length = np.linalg.norm(part.surface.points[ends[:, 0]] - part.surface.points[ends[:, 1]], axis=1)
    shortest = np.full(part.surface.n_points, np.inf)
    np.minimum.at(shortest, ends.ravel(), np.repeat(length, 2))
    values = np.random.default_rng(1).uniform(-1, 1, part.n_samples)
    field = amplitude * values * shortest[part.samples.vertex_ids]
    nodes = smooth_patches(part).node_of_sample
    _, first = np.unique(nodes, return_index=True)
    return field[first][nodes]


@pytest.mark.parametrize("name", sorted(PARTS))
def test_noise_of_a_third_of_the_edge_length(name):
    part = cs.nominal(PARTS[name](), edge_length=1.2)
    field = _noise(part, 1 / 3)
    displacement = weld(part, field)
    report = weld_report(part, field, displacement)
    assert report.n_inverted == 0
    assert report.max_residual < 1e-12
    check_skin(part, field, displacement)
    assert check_mesh(part.surface.with_points(part.surface.points + displacement)).problems() == ()


def test_offset_faces_have_the_volume_of_the_offset_part(plate):
    """Top up by 0.5, bore wider by 1: the volume of the mesh of the part that is built that way."""
    field = np.zeros(plate.n_samples)
    field[plate.feature(">Z").rows] = 0.5
    field[plate.feature(kind="cylinder").rows] = -1.0
    skin = simulate(plate, field)
    bore = skin.feature(kind="cylinder")
    np.testing.assert_allclose(np.hypot(bore.points[:, 0], bore.points[:, 1]), 5.0, atol=1e-12)
    sides = len(
        np.unique(np.round(np.arctan2(bore.points[:, 1], bore.points[:, 0])[bore.points[:, 2] > 3.49], 6))
    )
    polygon = 0.5 * sides * 25 * np.sin(2 * np.pi / sides)
    assert skin.surface.volume == pytest.approx((600 - polygon) * 6.5, rel=1e-3)


def test_the_readme_lines(plate):
    skin = cs.simulate(plate, cs.GaussianField(sigma=0.01, length=15), rng=7)
    assert skin.closed
    assert 0.001 < np.abs(skin.deviation).max() < 0.06
    assert not inverted_triangles(skin.points, plate.surface.points, plate.surface.triangles).any()


def test_chamfered_corners_are_least_squares():
    """Four planes meet at the ends of chamfers: a residual stays there and nowhere else."""
    part = cs.nominal(cq.Workplane().box(20, 14, 8).edges().chamfer(2), edge_length=1.5)
    field = 0.01 * np.random.default_rng(3).uniform(-1, 1, part.n_samples)
    residual = np.abs(prepare_weld(part).realised(weld(part, field)) - field)
    constraints = prepare_weld(part).constraints
    assert constraints.overdetermined.any()
    assert residual[~constraints.overdetermined].max() < 1e-12
    assert 1e-4 < residual.max() < 0.02


def test_conversions_delegate(plate, tmp_path):
    skin = simulate(plate, np.full(plate.n_samples, 0.1))
    assert skin.picture(tmp_path / "plate.png").stat().st_size > 1000
    shape = skin.to_ocp()
    assert cq.Shape.cast(shape).BoundingBox().zmax == pytest.approx(3.1, abs=1e-6)
    pytest.importorskip("pyvista")
    assert skin.to_pyvista().n_points == plate.surface.n_points
