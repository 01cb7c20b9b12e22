"""Requests that no part can meet: said, named, and bounded."""

import numpy as np
import pytest
from support.parts import box, thin_wall

from cadskin.conform import prepare_conforming, simulate_conforming
from cadskin.conform.requirements import datum_features, nominal_part
from cadskin.deviation import GaussianField, Paraboloid, SizeOffset
from cadskin.errors import (
    CadskinError,
    Cancelled,
    ConformityError,
    DeviationError,
    GeometryError,
    SpecificationError,
)
from cadskin.skin.simulate import child_seed
from cadskin.spec import (
    Datum,
    DatumTarget,
    Specification,
    flatness,
    parallelism,
    perpendicularity,
    position,
    surface_profile,
)
from cadskin.spec.selection import as_selection

BOTTOM, TOP, RIGHT = 0, 1, 3
MODEL = GaussianField(0.01, 50.0)


@pytest.fixture(scope="module")
def part():
    return box((60.0, 40.0, 20.0), h=12.0)


def test_zone_narrower_than_the_floating_point(part):
    with pytest.raises(SpecificationError, match=r"flatness-1 .*narrower than coordinates of 60 mm"):
        simulate_conforming(part, MODEL, Specification(flatness(TOP, 1e-14)))


def test_zone_wider_than_the_part(part):
    with pytest.raises(SpecificationError, match=r"wider than the part.*unit"):
        simulate_conforming(part, MODEL, Specification(flatness(TOP, 100.0)))


def test_datum_is_the_feature_itself(part):
    spec = Specification(parallelism(TOP, 0.02, datums="A"), datums={"A": TOP})
    with pytest.raises(SpecificationError, match="its datum A is the toleranced feature itself"):
        simulate_conforming(part, MODEL, spec)


def test_systematic_part_that_is_outside_names_the_tolerance(part):
    spec = Specification(flatness(TOP, 0.02), flatness(BOTTOM, 0.2))
    with pytest.raises(ConformityError, match=r"flatness-1 .* binds: .*against a limit of 0.02 mm"):
        simulate_conforming(part, Paraboloid(0.1), spec, max_tries=3)


def test_model_that_is_not_gaussian_has_no_second_sampler(part):
    class Cubed(Paraboloid):
        name = "cubed"

        def prepare(self, nominal, features=None):
            return (100.0 * MODEL).prepare(nominal, features)

    with pytest.raises(ConformityError, match=r"flatness-1 .* binds.*Gaussian model"):
        simulate_conforming(part, Cubed(0.1), Specification(flatness(TOP, 0.002)), max_tries=40)


def test_no_tolerance_at_all(part):
    with pytest.raises(SpecificationError, match="holds no tolerance"):
        simulate_conforming(part, MODEL, Specification())


def test_no_face_matches(part):
    with pytest.raises(CadskinError, match="flatness-1"):
        simulate_conforming(part, MODEL, Specification(flatness("%SPHERE", 0.02)))


def test_contradictory_nesting_binds_by_the_narrower(part):
    """A form that is wider than its orientation: allowed, warned of, and met."""
    with pytest.warns(UserWarning, match="already bounds it"):
        spec = Specification(flatness(TOP, 0.05), parallelism(TOP, 0.01, datums="A"), datums={"A": BOTTOM})
    with pytest.warns(UserWarning, match="already bounds it"):
        made = prepare_conforming(part, MODEL, spec).draw(np.random.SeedSequence(1))
    assert made.values["parallelism-1"] <= 0.01


def test_very_tight_coupled_tolerances_end_and_conform(part):
    spec = Specification(
        position(TOP, 0.002, datums="A"), perpendicularity(RIGHT, 0.001, datums="A"),
        surface_profile(4, 0.002, datums="A"), datums={"A": BOTTOM},
    )  # fmt: skip
    made = prepare_conforming(part, MODEL, spec, joint_tries=3, sweeps=1).draw(np.random.SeedSequence(2))
    assert made.values["position-1"] <= 0.002
    assert made.values["perpendicularity-1"] <= 0.001
    assert "blocks in turn" in made.tally.samplers


def test_unsupported_tolerances_are_listed_with_a_reason(part):
    with pytest.warns(UserWarning, match="has no value"):
        spec = Specification(flatness(TOP, 0.02), position(RIGHT, None, datums="A"), datums={"A": BOTTOM})
    with pytest.warns(UserWarning, match="has no value"):
        prepared = prepare_conforming(part, MODEL, spec)
    assert [(item.tolerance, item.reason) for item in prepared.unsupported] == [
        ("position-1", "it has no value")
    ]


def test_cancelling_and_wrong_numbers(part):
    spec = Specification(flatness(TOP, 0.02))
    with pytest.raises(Cancelled):
        simulate_conforming(part, MODEL, spec, size=3, progress=lambda done, total: done < 1)
    with pytest.raises(DeviationError, match="size"):
        simulate_conforming(part, MODEL, spec, size=-1)
    with pytest.raises(DeviationError, match="max_tries"):
        simulate_conforming(part, MODEL, spec, max_tries=0)
    with pytest.raises(DeviationError, match="must be a DeviationModel"):
        simulate_conforming(part, np.zeros(part.n_samples), spec)


def test_parts_that_pass_through_themselves_are_drawn_anew():
    """A wall that is not much thicker than its zones: one part in several would be turned inside out."""
    wall = thin_wall(thickness=0.2)
    spec = Specification(default=surface_profile(None, 1.0))
    model = GaussianField(0.1, 200.0)
    sampler = prepare_conforming(wall, model, spec)
    seed = np.random.SeedSequence(3)
    seeds = [child_seed(seed, i) for i in range(40)]
    thickness = [_thinnest(wall, made.deviation) for made in sampler.draw_all(seeds)]
    assert min(thickness) < 0  # without the check
    lot = simulate_conforming(wall, model, spec, size=40, rng=3)
    kept = [_thinnest(wall, one) for one in lot.deviations]
    assert min(kept) > 0
    same = [i for i in range(40) if thickness[i] > 0.01]
    np.testing.assert_allclose([kept[i] for i in same], [thickness[i] for i in same])
    assert "solids only" in lot.provenance.options["samplers"]
    with pytest.raises(GeometryError, match="the wall"):
        simulate_conforming(wall, SizeOffset(-0.15), spec, rng=3)


def _thinnest(wall, deviation):
    sides = sorted(wall.features, key=lambda feature: -feature.area)[:2]
    return 0.2 + sum(deviation[side.rows].min() for side in sides)


def test_targets_of_a_datum_are_features_behind_its_tolerances(part):
    """A datum that targets establish couples the faces that carry them."""
    target = DatumTarget("A1", "point", origin=(1.0, 1.0, 0.0), feature=as_selection(BOTTOM))
    spec = Specification(
        parallelism(TOP, 0.05, datums="A"), flatness(RIGHT, 0.05), datums=[Datum("A", targets=(target,))]
    ).bind(part)  # fmt: skip
    found = {feature.id for feature in datum_features(nominal_part(part), spec["parallelism-1"], spec)}
    assert found == {part.feature_of(BOTTOM).id}
