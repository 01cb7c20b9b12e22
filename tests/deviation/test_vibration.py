"""Natural vibration modes against exact and tabulated cases."""

from __future__ import annotations

import numpy as np
import pytest
from surfaces import ball, covariance_of, plane, tube

from cadskin.deviation import VibrationModes
from cadskin.deviation._patches import patch_points
from cadskin.deviation._shell import plate_stiffness, shell_stiffness
from cadskin.deviation.vibration import plate_modes, shell_modes
from cadskin.errors import DeviationError
from cadskin.shape.operators import lumped_mass


def patch_of(part):
    (patch,) = patch_points(part)
    return patch


SQUARE = patch_of(plane((1.0, 1.0), h=0.05))


# omega a² sqrt(rho h / D) of a square plate, nu = 0.3: supported 2 pi², 5 pi² (exact); fixed and free as the
# Ritz method gives them, Leissa: The free vibration of rectangular plates, J. Sound Vib. 31 (1973), the
# digits of the free plate as later Ritz solutions converged them.
@pytest.mark.parametrize(
    ("edges", "exact", "accuracy"),
    [
        ("supported", [2 * np.pi**2, 5 * np.pi**2, 5 * np.pi**2], 3e-3),
        ("fixed", [35.985, 73.394, 73.394, 108.22], 1e-2),
        ("free", [0, 0, 0, 13.468, 19.596, 24.270], 1e-2),
    ],
)
def test_square_plates(edges, exact, accuracy):
    values, _ = plate_modes(SQUARE, len(exact), edges=edges)
    assert np.sqrt(values) == pytest.approx(exact, rel=accuracy)


def test_frequencies_converge_with_the_square_of_the_element():
    errors = []
    for h in (0.1, 0.05, 0.025):
        values, _ = plate_modes(patch_of(plane((1.0, 1.0), h=h, jitter=0.0)), 1, edges="supported")
        errors.append(abs(np.sqrt(values[0]) / (2 * np.pi**2) - 1))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (rates > 1.8).all()


def test_a_strip_is_a_free_beam():
    """Without Poisson's ratio bending modes are those of the free-free beam, (beta L)² = 22.373, 61.673."""
    strip = patch_of(plane((20.0, 1.0), h=0.25))
    values, modes = plate_modes(strip, 8, poisson=0.0)
    along = strip.points[:, 0] - 10.0
    bending = [k for k in range(3, 8) if abs(np.corrcoef(modes[k], strip.points[:, 1] * along)[0, 1]) < 0.5]
    found = np.sqrt(values[bending[:2]]) * 20.0**2
    assert found == pytest.approx([22.373, 61.673], rel=5e-3)
    beta = 4.730040745 / 20.0
    x = strip.points[:, 0]
    ratio = (np.cosh(4.730040745) - np.cos(4.730040745)) / (np.sinh(4.730040745) - np.sin(4.730040745))
    beam = np.cosh(beta * x) + np.cos(beta * x) - ratio * (np.sinh(beta * x) + np.sin(beta * x))
    assert abs(np.corrcoef(modes[bending[0]], beam)[0, 1]) > 0.9999


def test_plates_bend_by_a_quadratic_exactly():
    """The patch test: the energy of w = x² / 2 + x y is that of the plate, 1/2 (1 + 2 (1 - nu)) per area."""
    x, y = SQUARE.points[:, :2].T
    stiffness = plate_stiffness(x, y, SQUARE.triangles, 0.3)
    state = np.column_stack([x**2 / 2 + x * y, x, -(x + y)]).ravel()
    assert state @ (stiffness @ state) == pytest.approx(1.0 + 2 * 0.7, rel=1e-10)


@pytest.mark.parametrize("part", [tube(10.0, 20.0, 2.5), ball(10.0, 300), plane((10.0, 10.0), h=2.0)])
def test_rigid_motions_cost_nothing(part):
    patch = patch_of(part)
    stiffness = shell_stiffness(patch.points, patch.triangles, 0.5, 0.3)
    size = abs(stiffness).max()
    for k in range(6):
        turn = np.eye(3)[k - 3] if k > 2 else np.zeros(3)
        move = np.cross(turn, patch.points) + (np.eye(3)[k] if k < 3 else 0.0)
        state = np.concatenate([move, np.tile(turn, (len(move), 1))], axis=1).ravel()
        assert np.abs(stiffness @ state).max() < 1e-11 * size * np.abs(state).max()


def test_a_flat_shell_is_a_plate():
    plate, _ = plate_modes(SQUARE, 8)
    shell, _ = shell_modes(SQUARE, 8, thickness=1e-3)
    assert shell[3:] == pytest.approx(plate[3:], rel=1e-4)


def test_a_free_tube_bends_like_a_ring():
    """Rayleigh: n (n² - 1) / sqrt(n² + 1) for the strip of a long tube; a free edge takes off up to nu²."""
    values, modes = shell_modes(patch_of(tube(20.0, 30.0, 2.0)), 12, thickness=0.5)
    found = np.sqrt(values) * 20.0**2
    assert (
        found[:4] == 0
    ).all()  # of six rigid motions, the way along and the turn about the axis have no form
    ring = 2 * 3 / np.sqrt(5)
    assert ring * np.sqrt(1 - 0.3**2) < found[4] < ring
    assert found[4] == pytest.approx(found[5], rel=1e-4)
    points = patch_of(tube(20.0, 30.0, 2.0)).points
    angle = np.arctan2(points[:, 1], points[:, 0])
    fit = np.column_stack([np.cos(2 * angle), np.sin(2 * angle)])
    rest = modes[4] - fit @ np.linalg.lstsq(fit, modes[4], rcond=None)[0]
    assert np.sqrt(np.mean(rest**2)) < 0.05


@pytest.mark.parametrize("edges", ["free", "supported", "fixed"])
def test_modes_are_orthogonal_on_plates(edges):
    _, modes = plate_modes(SQUARE, 8, edges=edges)
    mass = lumped_mass(SQUARE.points, SQUARE.triangles)
    assert np.allclose((modes * mass) @ modes.T, np.eye(8), atol=2e-3)


def test_amplitudes_are_root_mean_squares():
    part = tube(20.0, 30.0, 4.0, turn=2.0)
    random = VibrationModes([0.01, 0.02], first=3, random=True, edges="fixed").prepare(part)
    mass = lumped_mass(part.surface.points, part.surface.triangles)[part.samples.vertex_ids]
    power = np.diag(covariance_of(random)) @ mass / mass.sum()
    assert power == pytest.approx(0.01**2 + 0.02**2, rel=1e-5)
    offset = VibrationModes([0.03]).sample(plane(h=8.0))[0]
    assert np.allclose(offset, 0.03)


def test_bad_parameters():
    with pytest.raises(DeviationError, match="edges"):
        VibrationModes([1.0], edges="loose")
    with pytest.raises(DeviationError, match="poisson"):
        VibrationModes([1.0], poisson=0.6)
    with pytest.raises(DeviationError, match="closed surface"):
        VibrationModes([1.0], edges="fixed").prepare(ball(count=100))
    with pytest.raises(DeviationError, match="too coarse"):
        VibrationModes([1.0], first=400).prepare(plane(h=20.0))


def test_a_patch_too_large_is_refused_with_the_way_out(monkeypatch):
    monkeypatch.setattr("cadskin.deviation.vibration._UNKNOWNS", 100)
    with pytest.raises(DeviationError, match=r"unknowns, more than 100; use a larger edge_length"):
        VibrationModes([0.01]).prepare(plane(h=8.0))
