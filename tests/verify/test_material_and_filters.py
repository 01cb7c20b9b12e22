"""Virtual boundaries and filters against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from cadskin.errors import GeometryError, SpecificationError
from cadskin.shape.association import Line, Pose
from cadskin.spec import Specification, position, size
from cadskin.verify import filters, material_report, verify
from cadskin.verify import surface_filters as areal
from cadskin.verify.boundary import Boundary, boundary_violation, virtual_size

FRAME = Pose(np.zeros(3), np.eye(3), np.zeros(2))
Z = np.array([0.0, 0.0, 1.0])


def cylinder(radius, centre=(0.0, 0.0), lean=0.0, n=60):
    angle = 2 * np.pi * np.arange(n) / n
    rings = []
    for z in (0.0, 10.0, 20.0):
        x = centre[0] + lean * z + radius * np.cos(angle)
        rings.append(np.column_stack([x, centre[1] + radius * np.sin(angle), np.full(n, z)]))
    return np.concatenate(rings)


def test_virtual_sizes():
    assert virtual_size(10.0, 0.1, internal=True, requirement="LMR") == pytest.approx(10.1)
    assert virtual_size(10.0, 0.1, internal=False, requirement="LMR") == pytest.approx(9.9)
    with pytest.raises(SpecificationError):
        virtual_size(-1.0, 0.1, internal=True)


@pytest.mark.parametrize(("internal", "radius"), [(True, 5.02), (False, 4.98)])
def test_shifted_cylinder_violates_by_its_shift_less_its_room(internal, radius):
    """Shift 0.06 along x (a sample direction): the hole of radius 5.02 reaches in to 4.96, MMVS is 4.95."""
    virtual = 9.9 if internal else 10.1
    found = boundary_violation(
        [Boundary(cylinder(radius, (0.06, 0.0)), np.zeros(3), Z, virtual, internal)], FRAME
    )
    assert found.value == pytest.approx(0.06 - 0.07, abs=1e-12)
    assert found.ok


def test_pattern_moves_together():
    """Two holes shifted the same way conform after the frame follows; shifted apart they do not."""
    places = [np.array([-20.0, 0, 0]), np.array([20.0, 0, 0])]

    def holes(first, second):
        return [
            Boundary(cylinder(5.0, (-20.0 + first, 0.0)), places[0], Z, 9.9, True),
            Boundary(cylinder(5.0, (20.0 + second, 0.0)), places[1], Z, 9.9, True),
        ]

    fixed = boundary_violation(holes(0.2, 0.2), FRAME)
    assert fixed.value == pytest.approx(0.15, abs=1e-12)
    free = ("tx", "ty", "rz")
    assert boundary_violation(holes(0.2, 0.2), FRAME, free=free).value == pytest.approx(-0.05, abs=1e-9)
    apart = boundary_violation(holes(-0.2, 0.2), FRAME, free=free)
    # Between the sampled points of the holes there is a little room.
    assert 0.1499 < apart.value <= 0.15
    assert not apart.ok


def test_boundary_and_bonus_can_disagree():
    """An axis that leans within the plate: the surface keeps the boundary, the axis method refuses it."""
    radius = 5.01 + 0.001
    angle = 2 * np.pi * np.arange(360) / 360
    lobes = 0.04 * (1 + np.cos(2 * angle)) / 2
    rings = []
    for z, shift in ((0.0, 0.0), (20.0, 0.058)):
        r = radius + lobes
        rings.append(np.column_stack([shift + r * np.cos(angle), r * np.sin(angle), np.full(360, z)]))
    report = material_report(
        np.concatenate(rings), Line(np.zeros(3), Z), internal=True, tolerance=0.08, maximum_material=10.0
    )
    assert report.conforms_iso is True
    assert report.conforms_bonus is False


def test_material_requirement_on_a_part(array_shaft):
    moved = array_shaft.surface.points + np.array([0.05, 0.0, 0.0])
    surface = array_shaft.surface.with_points(moved)
    spec = Specification(
        position(0, 0.04, diameter=True, datums="A", material="MMR"),
        datums={"A": 2},
        dimensions=[size(0, 20.0, (-0.1, 0.1), id="d")],
        checked=False,
    )
    found = verify(surface, spec, nominal=array_shaft)
    assert found.conforming
    evaluation = found["position-1"]
    # A leaves x and y free: the shaft of radius 10 in its boundary of 20.1 + 0.04.
    assert evaluation.details["virtual_boundary_violation"] == pytest.approx(10.0 - 10.07, abs=1e-9)


@pytest.mark.parametrize("harmonic", [2, 15, 50, 120])
def test_closed_gaussian_transmits_each_harmonic_exactly(harmonic):
    angle = 2 * np.pi * np.arange(3600) / 3600
    smooth = filters.closed_gaussian(np.cos(harmonic * angle), 50.0)
    expected = 2.0 ** -((harmonic / 50.0) ** 2)
    np.testing.assert_allclose(smooth, expected * np.cos(harmonic * angle), atol=1e-13)


def test_open_filters_pass_half_at_the_cutoff():
    x = np.arange(4000) * 0.01
    wave = np.cos(2 * np.pi * x / 0.8)
    inner = slice(500, -500)
    for smooth in (filters.open_gaussian(wave, 0.01, 0.8), filters.spline(wave, 0.01, 0.8)):
        assert (smooth[inner] @ wave[inner]) / (wave[inner] @ wave[inner]) == pytest.approx(0.5, abs=2e-3)
    closed = filters.spline(wave, 0.01, 0.8, closed=True)
    assert (closed @ wave) / (wave @ wave) == pytest.approx(0.5, abs=1e-6)


def test_robust_filter_ignores_scratches():
    rng = np.random.default_rng(0)
    values = 0.001 * rng.standard_normal(2000)
    values[1000:1010] -= 1.0
    plain, robust = (f(values, 0.01, 0.8) for f in (filters.open_gaussian, filters.robust_gaussian))
    assert abs(plain).max() > 0.05
    assert abs(robust).max() < 0.002


def grid(n=81, step=0.5):
    x, y = np.meshgrid(np.arange(n) * step, np.arange(n) * step, indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(n * n)])
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1].ravel(), i[1:, :-1].ravel(), i[1:, 1:].ravel(), i[:-1, 1:].ravel()
    return points, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


@pytest.mark.parametrize("wavelength", [40.0, 20.0, 10.0])
def test_areal_filters_have_their_transmission(wavelength):
    """Waves that fit the plate with zero slope at its rim; the mesh has 20 or more points per wave."""
    points, triangles = grid()
    wave = np.cos(2 * np.pi * points[:, 0] / wavelength)
    cutoff = 8.0

    def passed(smooth):
        return (smooth @ wave) / (wave @ wave)

    expected = filters.gaussian_transmission(np.array([cutoff / wavelength]))[0]
    assert passed(areal.gaussian_on_surface(points, triangles, wave, cutoff)) == pytest.approx(
        expected, abs=4e-3
    )
    expected = 1 / (1 + (cutoff / wavelength) ** 4)
    assert passed(areal.spline_on_surface(points, triangles, wave, cutoff)) == pytest.approx(
        expected, abs=4e-3
    )


def test_areal_filter_keeps_constants_and_means():
    points, triangles = grid(31)
    values = np.random.default_rng(1).standard_normal(len(points))
    one = areal.gaussian_on_surface(points, triangles, np.ones(len(points)), 5.0)
    np.testing.assert_allclose(one, 1.0, atol=1e-10)
    _, mass = areal._operators(points, triangles, values, 5.0)
    smooth = areal.gaussian_on_surface(points, triangles, values, 5.0)
    assert mass @ smooth == pytest.approx(mass @ values, abs=1e-8)


def test_robust_areal_filter_ignores_spikes():
    points, triangles = grid(41)
    values = 0.001 * np.random.default_rng(2).standard_normal(len(points))
    values[::97] = 1.0
    assert abs(areal.robust_gaussian_on_surface(points, triangles, values, 8.0)).max() < 0.002


def test_bad_cutoffs_are_refused():
    with pytest.raises(GeometryError, match="cut-off"):
        filters.closed_gaussian(np.zeros(10), -1.0)
    with pytest.raises(GeometryError, match="samples"):
        filters.closed_gaussian(np.zeros(10), 50.0)
    points, triangles = grid(5)
    with pytest.raises(GeometryError, match="values"):
        areal.gaussian_on_surface(points, triangles, np.zeros(3), 1.0)


def test_closed_robust_filter_ignores_a_scratch_and_keeps_the_form():
    """An oval of 10 um with a scratch of 0.5 mm: only the robust filters return the oval."""
    angle = 2 * np.pi * np.arange(3600) / 3600
    form = 0.01 * np.cos(2 * angle)
    values = form + 1e-4 * np.random.default_rng(3).standard_normal(3600)
    values[700:720] -= 0.5
    assert abs(filters.closed_gaussian(values, 50.0) - form).max() > 0.1
    assert abs(filters.closed_robust_gaussian(values, 50.0) - form).max() < 5e-4


@pytest.mark.parametrize("kind", ["gaussian", "spline", "robust"])
@pytest.mark.parametrize("harmonic", [5, 50, 150])
def test_section_filters_have_their_transmission(kind, harmonic):
    """Half of the amplitude at the cut-off; the robust filter on a pure wave weights none of it away."""
    angle = 2 * np.pi * np.arange(7200) / 7200
    radius = 20 + 0.01 * np.cos(harmonic * angle)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle])
    smooth = filters.filter_roundness(points, np.zeros(3), np.array([0, 0, 1.0]), 50.0, kind=kind)
    amplitude = 0.5 * np.ptp(np.linalg.norm(smooth, axis=1))
    ratio = harmonic / 50.0
    expected = 1 / (1 + ratio**4) if kind == "spline" else 2.0 ** -(ratio**2)
    # The weights of the robust filter take a little of the crests, as they should.
    slack = 3e-4 if kind == "robust" else 2e-5
    assert amplitude == pytest.approx(0.01 * expected, abs=slack)


def test_filtered_straightness_of_a_case():
    """A bow of 40 um under a ripple of 10 um: the filter leaves the bow, unfiltered it is more."""
    x = np.linspace(0, 100, 2001)
    height = 0.04 * (1 - ((x - 50) / 50) ** 2)
    points = np.column_stack([x, np.zeros_like(x), height + 0.005 * np.cos(2 * np.pi * x / 0.8)])
    from cadskin.verify import evaluate_case
    from cadskin.verify.cases import Case

    question = {"section_plane_normal": [0, 1.0, 0]}
    plain = evaluate_case(Case("line", "straightness", question, {"S": points}, "STRt (MZLI)")).value
    assert 0.048 < plain < 0.05
    for word in ("Gaussian", "spline", "robust Gaussian"):
        asked = question | {"filter": {"type": f"{word}, open profile", "cutoff_mm": 8.0}}
        found = evaluate_case(Case("line", "straightness", asked, {"S": points}, "STRt (MZLI)")).value
        assert found == pytest.approx(0.04, abs=3e-3), word  # the ends are flattened a little
    with pytest.raises(SpecificationError, match="cutoff"):
        evaluate_case(
            Case("line", "straightness", question | {"filter": {"type": "Gaussian"}}, {"S": points}, None)
        )
