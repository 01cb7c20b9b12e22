"""Surface operators: area, exact energies of linear functions, eigenvalues on the sphere, boundary length."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import dia_array
from scipy.sparse.linalg import eigsh
from scipy.spatial import ConvexHull, Delaunay

from cadskin.errors import GeometryError
from cadskin.shape.operators import boundary_edges, boundary_mass, cotangent_laplacian, lumped_mass


@pytest.fixture(scope="module")
def sheet():
    rng = np.random.default_rng(3)
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(0, 6, 19), np.linspace(0, 4, 13)))
    inside = (x > 0) & (x < 6) & (y > 0) & (y < 4)
    flat = np.column_stack([x, y]) + inside[:, None] * rng.uniform(-0.1, 0.1, (len(x), 2))
    return np.column_stack([flat, np.zeros(len(x))]), Delaunay(flat).simplices.astype(np.int64)


def sphere(count):
    k = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * k / count), np.pi * (1 + np.sqrt(5)) * k
    points = np.column_stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)])
    return points, ConvexHull(points).simplices.astype(np.int64)


def test_mass_is_area(sheet):
    assert lumped_mass(*sheet).sum() == pytest.approx(24.0, rel=1e-12)
    assert (lumped_mass(*sheet) > 0).all()


def test_energy_of_linear_functions_is_exact(sheet):
    points, triangles = sheet
    laplacian = cotangent_laplacian(points, triangles)
    slope = np.array([0.3, -1.7, 0.0])
    u = points @ slope + 5.0
    assert u @ (laplacian @ u) == pytest.approx(slope @ slope * 24.0, rel=1e-12)
    inside = boundary_mass(points, triangles) == 0
    assert np.abs((laplacian @ u)[inside]).max() < 1e-12


def test_structure(sheet):
    laplacian = cotangent_laplacian(*sheet)
    assert np.abs(laplacian - laplacian.T).max() < 1e-14
    assert np.abs(laplacian.sum(axis=1)).max() < 1e-12
    assert np.linalg.eigvalsh(laplacian.toarray())[0] > -1e-12


def test_eigenvalues_of_the_sphere_converge_at_second_order():
    """l (l + 1): 2 three times, 6 five times."""
    exact = np.repeat([2.0, 6.0], [3, 5])
    errors = []
    for count in (300, 1200):
        points, triangles = sphere(count)
        mass = dia_array((lumped_mass(points, triangles)[None], [0]), shape=(count, count)).tocsc()
        found = eigsh(cotangent_laplacian(points, triangles).tocsc(), k=9, M=mass, sigma=-0.1)[0]
        errors.append(np.abs(np.sort(found)[1:] - exact).max())
    assert errors[1] < 0.35 * errors[0] < 0.35 * 0.2


def test_boundary(sheet):
    assert boundary_mass(*sheet).sum() == pytest.approx(20.0, rel=1e-12)
    assert len(boundary_edges(sheet[1])) == 2 * (18 + 12)
    points, triangles = sphere(100)
    assert boundary_mass(points, triangles).sum() == 0.0


def test_a_degenerate_triangle_is_named():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]])
    with pytest.raises(
        GeometryError, match=r"triangle 1 is degenerate \(1 in all\): its corners \[0, 1, 3\]"
    ):
        cotangent_laplacian(points, np.array([[0, 1, 2], [0, 1, 3]]))
