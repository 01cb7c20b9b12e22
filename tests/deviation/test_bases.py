"""Metrology bases: orthonormal by exact quadrature; forms on faces."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from surfaces import ball, plane, ring, tube

from cadskin.deviation import BasisForm, Lobing, SizeOffset, Taper, from_dict
from cadskin.deviation.bases import (
    chebyshev_2d,
    dct,
    fourier_chebyshev,
    fourier_legendre,
    legendre_2d,
    spherical,
    zernike,
)
from cadskin.errors import DeviationError

NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
TURN = np.arange(48) * 2 * np.pi / 48


def gram(functions, weights):
    values = np.stack(functions)
    return (values * weights) @ values.T


def rectangle():
    x, y = (a.ravel() for a in np.meshgrid(NODES, NODES, indexing="ij"))
    return x, y, (WEIGHTS[:, None] * WEIGHTS).ravel() / 4


def test_legendre_is_orthonormal():
    x, y, w = rectangle()
    pairs = itertools.product(range(6), range(6))
    assert np.allclose(gram([legendre_2d(x, y, i, j) for i, j in pairs], w), np.eye(36), atol=1e-12)


def test_dct_is_orthonormal():
    x, y = (a.ravel() for a in np.meshgrid((np.arange(40) + 0.5) / 20 - 1, (np.arange(40) + 0.5) / 20 - 1))
    pairs = itertools.product(range(6), range(6))
    assert np.allclose(
        gram([dct(x, y, i, j) for i, j in pairs], np.full(1600, 1 / 1600)), np.eye(36), atol=1e-12
    )


def test_fourier_legendre_is_orthonormal():
    t, z = (a.ravel() for a in np.meshgrid(TURN, NODES, indexing="ij"))
    w = np.tile(WEIGHTS / 2, 48) / 48
    pairs = list(itertools.product(range(-5, 6), range(5)))
    assert np.allclose(
        gram([fourier_legendre(t, z, i, j) for i, j in pairs], w), np.eye(len(pairs)), atol=1e-12
    )


def test_chebyshev_is_orthonormal():
    """By Gauss-Chebyshev quadrature: equal weights at the cosines, for the weight 1 / sqrt(1 - x²)."""
    nodes = np.cos(np.pi * (np.arange(24) + 0.5) / 24)
    x, y = (a.ravel() for a in np.meshgrid(nodes, nodes, indexing="ij"))
    pairs = list(itertools.product(range(6), range(6)))
    functions = [chebyshev_2d(x, y, i, j) for i, j in pairs]
    assert np.allclose(gram(functions, np.full(576, 1 / 576)), np.eye(36), atol=1e-12)
    t, z = (a.ravel() for a in np.meshgrid(TURN, nodes, indexing="ij"))
    pairs = list(itertools.product(range(-5, 6), range(5)))
    functions = [fourier_chebyshev(t, z, i, j) for i, j in pairs]
    assert np.allclose(gram(functions, np.full(t.size, 1 / t.size)), np.eye(len(pairs)), atol=1e-12)
    assert np.allclose(chebyshev_2d(x, 0 * y, 5, 0), np.sqrt(2) * np.cos(5 * np.arccos(x)), atol=1e-12)


def test_zernike_is_orthonormal():
    radius = np.sqrt((NODES + 1) / 2)  # uniform in area
    r, t = (a.ravel() for a in np.meshgrid(radius, TURN, indexing="ij"))
    w = np.repeat(WEIGHTS / 2, 48) / 48
    pairs = [(n, m) for n in range(8) for m in range(-n, n + 1, 2)]
    assert np.allclose(gram([zernike(r, t, n, m) for n, m in pairs], w), np.eye(len(pairs)), atol=1e-11)


def test_spherical_harmonics_are_orthonormal():
    z, t = (a.ravel() for a in np.meshgrid(NODES, TURN, indexing="ij"))
    ring = np.sqrt(1 - z**2)
    directions = np.column_stack([ring * np.cos(t), ring * np.sin(t), z])
    w = np.repeat(WEIGHTS / 2, 48) / 48
    pairs = [(n, m) for n in range(7) for m in range(-n, n + 1)]
    assert np.allclose(
        gram([spherical(directions, n, m) for n, m in pairs], w), np.eye(len(pairs)), atol=1e-11
    )


def test_cylinder_forms_by_name():
    shaft = tube(radius=20.0, height=60.0, h=3.0)
    assert np.allclose(
        BasisForm("fourier_legendre", {"0,0": 0.01}).sample(shaft), SizeOffset(0.01).sample(shaft)
    )
    taper = BasisForm("fourier_legendre", {"0,1": 0.01}).sample(shaft)
    assert np.allclose(taper, Taper(2 * np.sqrt(3) * 0.01).sample(shaft))
    lobes = Lobing(0.02, lobes=3).sample(shaft)[0]
    assert np.ptp(lobes) == pytest.approx(0.02, rel=1e-3)
    points = shaft.surface.points[shaft.samples.vertex_ids]
    turned = np.arctan2(points[:, 1], points[:, 0])
    spectrum = [abs((lobes * np.exp(1j * n * turned)).mean()) for n in range(6)]
    assert np.argmax(spectrum) == 3
    assert sorted(spectrum)[-2] < 1e-9


def test_lobes_on_faces_without_an_axis():
    """On a plane the polynomial of Zernike of degree and order n, on a sphere the sectoral harmonic."""
    sheet, shell = plane((60.0, 60.0)), ball(20.0, 1500)
    lobes = Lobing(0.02, lobes=3).sample(sheet)[0]
    trefoil = BasisForm("zernike", {"3,3": 1.0}).sample(sheet)[0]
    assert np.allclose(lobes, 0.02 * trefoil / np.ptp(trefoil), atol=1e-12)
    lobes = Lobing(0.02, lobes=2).sample(shell)[0]
    assert np.ptp(lobes) == pytest.approx(0.02)
    harmonics = [BasisForm("spherical", {f"2,{m}": 1.0}).sample(shell)[0] for m in range(-2, 3)]
    rest = lobes - np.stack(harmonics, axis=1) @ np.linalg.lstsq(np.stack(harmonics, axis=1), lobes)[0]
    assert np.abs(rest).max() < 1e-12
    ringed = ring(20.0, 8.0, h=3.0)
    turned = np.arctan2(*ringed.surface.points[ringed.samples.vertex_ids][:, [1, 0]].T)
    lobes = Lobing(0.02, lobes=4).sample(ringed)[0]
    assert np.allclose(np.abs(lobes), 0.01 * np.abs(np.cos(4 * turned)), atol=1e-12)


def test_forms_on_disc_sphere_and_rectangle():
    sheet, shell = plane((60.0, 60.0)), ball(20.0, 1500)
    assert np.abs(BasisForm("zernike", {"2,0": 0.01}).sample(sheet)).max() <= 0.01 * np.sqrt(3) + 1e-12
    values = BasisForm("spherical", {"2,0": 0.01}).sample(shell)[0]
    assert np.sqrt((values**2).mean()) == pytest.approx(0.01, rel=0.01)
    values = BasisForm("legendre", {"1,0": 0.01}).sample(sheet)[0]
    assert np.ptp(values) == pytest.approx(0.02 * np.sqrt(3))


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: BasisForm("wavelets", {"0,0": 1.0}), "basis must be one of"),
        (lambda: BasisForm("dct", {"a": 1.0}), "a coefficient is named 'i,j'"),
        (lambda: BasisForm("dct", {"1,1": np.nan}), r"coefficients?( 1,1)? must be finite"),
        (lambda: BasisForm("fourier_legendre", {"1,1": 0.1}).sample(plane()), "is no cylinder, cone"),
        (lambda: BasisForm("spherical", {"1,1": 0.1}).sample(plane()), "is no sphere"),
        (
            lambda: BasisForm("zernike", {"2,1": 0.1}).sample(plane()),
            "no Zernike polynomial of degree 2 and order 1",
        ),
        (
            lambda: BasisForm("chebyshev", {"-1,0": 0.1}).sample(plane()),
            "no Chebyshev polynomial of degree -1",
        ),
        (lambda: BasisForm("dct", {"0,-2": 0.1}).sample(plane()), "no cosine of degree -2"),
        (lambda: Lobing(0.1, lobes=0), "lobes must be a whole number"),
    ],
)
def test_bad_requests(build, message):
    with pytest.raises(DeviationError, match=message):
        build()


def test_round_trip():
    model = BasisForm("fourier_legendre", {"3,0": 0.002})
    assert from_dict(model.to_dict()) == model
