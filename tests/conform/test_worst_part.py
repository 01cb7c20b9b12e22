"""The worst part: closed forms, and never beaten by a random part."""

import numpy as np
import pytest
from support.parts import box

from cadskin.conform import simulate_conforming
from cadskin.conform.measures import measure
from cadskin.conform.worst import worst_part
from cadskin.deviation import GaussianField, WhiteNoise
from cadskin.errors import ConformityError, SelectionError, SpecificationError
from cadskin.spec import Specification, flatness, parallelism, position, surface_profile, tolerance
from cadskin.verify import verify

BOTTOM, TOP, RIGHT = 0, 1, 3


@pytest.fixture(scope="module")
def part():
    return box((60.0, 40.0, 20.0), h=12.0)


def test_volume_of_a_part_in_a_profile_zone(part):
    spec = Specification(
        surface_profile(TOP, 0.2, datums="A|B|C"), surface_profile(RIGHT, 0.1, datums="A|B|C"),
        datums={"A": BOTTOM, "B": 2, "C": 5},
    )  # fmt: skip
    weights = np.zeros(part.n_samples)
    for face in (TOP, RIGHT):
        rows = part.feature_of(face).rows
        weights[rows] = measure("volume", part)[rows]
    found = worst_part(part, spec, weights)
    assert found.value == pytest.approx(0.1 * 60 * 40 + 0.05 * 40 * 20, rel=1e-6)
    assert verify(found.skin, spec).conforming
    assert found.left_out == ()


def test_unequal_zone(part):
    spec = Specification(surface_profile(TOP, 0.2, datums="A", outside=0.05), datums={"A": BOTTOM})
    assert worst_part(part, spec, measure("mean(1)", part)).value == pytest.approx(0.05, rel=1e-6)
    assert worst_part(part, spec, measure("-mean(1)", part)).value == pytest.approx(0.15, rel=1e-6)


def test_tilt_of_a_located_plane(part):
    """The sum of x δ / sum of x², with each |δ| <= t/2: t/2 sum |x| / sum x²."""
    spec = Specification(position(TOP, 0.2, datums="A"), datums={"A": BOTTOM})
    weights = measure("tilt(1)", part)
    found = worst_part(part, spec, weights)
    assert found.value == pytest.approx(0.1 * np.abs(weights).sum(), rel=1e-6)


def test_tilt_of_a_flat_and_parallel_plane(part):
    """Parallelism lets the level go but holds the slope as a band of its width does."""
    spec = Specification(parallelism(TOP, 0.2, datums="A"), datums={"A": BOTTOM})
    weights = measure("tilt(1)", part)
    assert worst_part(part, spec, weights).value == pytest.approx(0.1 * np.abs(weights).sum(), rel=1e-6)
    with pytest.raises(ConformityError, match="do not bound the measure"):
        worst_part(part, spec, measure("mean(1)", part))
    with pytest.raises(ConformityError, match="do not bound the measure"):
        worst_part(part, Specification(flatness(TOP, 0.2)), weights)


def test_distance_of_two_corners(part):
    """The datums hold one corner; the other one is pushed out by half of each of three zones."""
    spec = Specification(
        *(surface_profile(face, 0.2, datums="A|B|C") for face in (TOP, RIGHT, 4)),
        datums={"A": BOTTOM, "B": 2, "C": 5},
    )
    near, far = part.surface.points.min(axis=0), part.surface.points.max(axis=0)
    texts = [" ".join(str(number) for number in corner) for corner in (near, far)]
    found = worst_part(part, spec, measure(f"distance({texts[0]}, {texts[1]})", part))
    assert found.value == pytest.approx(0.1 * (60 + 40 + 20) / np.linalg.norm(far - near), rel=1e-6)
    ends = [int(np.argmin(((part.surface.points - corner) ** 2).sum(axis=1))) for corner in (near, far)]
    length = np.linalg.norm(np.diff(found.skin.points[ends], axis=0))
    assert length - np.linalg.norm(far - near) == pytest.approx(found.value, abs=2e-4)


def test_random_parts_do_not_beat_it(part):
    spec = Specification(surface_profile(TOP, 0.2, datums="A"), datums={"A": BOTTOM})
    weights = measure("tilt(1)", part)
    bound = worst_part(part, spec, weights).value
    rows = part.feature_of(TOP).rows
    best = 0.0
    for model in (GaussianField(0.05, 50.0).on(TOP), WhiteNoise(0.05).on(TOP)):
        fields = model.sample(part, size=50_000, rng=1)
        inside = np.abs(fields[:, rows]).max(axis=1) <= 0.1  # the datum is perfect: the zone is fixed
        assert inside.sum() > 100
        best = max(best, float((fields[inside] @ weights).max()))
    assert 0.2 * bound < best < bound
    lot = simulate_conforming(part, GaussianField(0.05, 50.0).on(TOP), spec, size=20, rng=2, check=False)
    assert (lot.deviations @ weights).max() < bound


def test_general_tolerance_bounds_the_whole_part(part):
    spec = Specification(
        surface_profile(TOP, 0.1, datums="A"), datums={"A": BOTTOM, "B": 2, "C": 5},
        default=tolerance("surface_profile", None, 0.4, datums="A|B|C", scope="general"),
    )  # fmt: skip
    found = worst_part(part, spec, measure("volume", part))
    assert found.value == pytest.approx(0.05 * 60 * 40 + 0.2 * (60 + 40) * 20, rel=1e-6)


def test_what_has_no_bound_is_named(part):
    spec = Specification(surface_profile(TOP, 0.1, datums="A"), datums={"A": BOTTOM})
    with pytest.raises(ConformityError, match=r"no tolerance bounds .*so the measure has no largest"):
        worst_part(part, spec, measure("volume", part))


@pytest.mark.parametrize(
    "text", ["weight", "mean", "mean(1, 2)", "volume(1)", "distance(0 0 0, 1 1)", "distance(a b c, 0 0 0)",
             "distance(0 0 0, 0 0 0)", "mean(1", ""]
)  # fmt: skip
def test_measures_that_do_not_exist(part, text):
    with pytest.raises(SpecificationError):
        measure(text, part)


def test_measures_are_what_they_say(part):
    flat = np.zeros(part.n_samples)
    rows = part.feature_of(TOP).rows
    flat[rows] = 0.01
    assert measure("mean(1)", part) @ flat == pytest.approx(0.01)
    assert measure("gap(1, 0)", part) @ flat == pytest.approx(-0.01)
    assert measure("volume", part) @ flat == pytest.approx(24.0)
    slope = np.zeros(part.n_samples)
    slope[rows] = 0.001 * part.feature_of(TOP).points[:, 0]
    assert abs(measure("tilt(1)", part) @ slope) == pytest.approx(0.001)
    with pytest.raises(SelectionError):
        measure("mean(77)", part)
