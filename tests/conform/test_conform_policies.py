"""Policies: targets are hit, scaling and rejection do what they say, none leaves the law alone."""

import numpy as np
import pytest
from support.parts import box, plate_with_hole

from cadskin.conform import (
    Conformity,
    pca_zone,
    policies_of,
    prepare_conforming,
    simulate_conforming,
    target,
)
from cadskin.conform.blocks import independent_blocks
from cadskin.deviation import DeviationModel, GaussianField, Paraboloid, WhiteNoise
from cadskin.errors import ConformityError, SpecificationError
from cadskin.skin import simulate, simulate_ensemble
from cadskin.skin.simulate import child_seed
from cadskin.spec import (
    Specification,
    cylindricity,
    flatness,
    parallelism,
    perpendicularity,
    position,
    surface_profile,
    tolerance,
)
from cadskin.verify import verify

BOTTOM, TOP, RIGHT, LEFT = 0, 1, 3, 5
MODEL = GaussianField(0.01, 50.0)


@pytest.fixture(scope="module")
def part():
    return box((60.0, 40.0, 20.0), h=12.0)


@pytest.fixture(scope="module")
def plate():
    return plate_with_hole((40.0, 30.0, 8.0), 6.0, 4.0)


def test_a_whole_part_conforms_on_the_welded_mesh(plate):
    hole, bottom, top, right = 6, 0, 1, 3
    spec = Specification(
        flatness(bottom, 0.02), parallelism(top, 0.03, datums="A"), perpendicularity(right, 0.02, datums="A"),
        position("hole", 0.03, datums="A|B|C"), cylindricity("hole", 0.01), surface_profile(5, 0.05),
        datums={"A": bottom, "B": 2, "C": 5},
    )  # fmt: skip
    lot = simulate_ensemble(plate, GaussianField(0.006, 25.0), size=8, spec=spec, rng=1)
    assert plate.features[hole].kind == "cylinder"
    assert verify(lot, spec).conforming.all()
    record = lot.provenance.options
    assert record["unsupported"] == []
    assert set(record["conform"].values()) == {"conditioned"}
    assert 0 < record["acceptance"] <= 1


def test_sample_depends_on_seed_and_number_alone(part):
    spec = Specification(flatness(BOTTOM, 0.008), parallelism(TOP, 0.015, datums="A"), datums={"A": BOTTOM})
    many = simulate_conforming(part, MODEL, spec, size=4, rng=3, check=False)
    few = simulate_conforming(part, MODEL, spec, size=2, rng=3, check=False)
    np.testing.assert_array_equal(many.deviations[:2], few.deviations)
    prepared = prepare_conforming(part, MODEL, spec)
    np.testing.assert_array_equal(prepared.draw(child_seed(np.random.SeedSequence(3), 3)).deviation,
                                  many.deviations[3])  # fmt: skip
    assert np.abs(many.deviations[0] - many.deviations[1]).max() > 1e-3
    one = simulate(part, MODEL, spec=spec, rng=3)
    np.testing.assert_array_equal(one.deviation, many.deviations[0])


def test_fields_drawn_together_are_the_same(part):
    prepared = prepare_conforming(part, MODEL, Specification(flatness(TOP, 0.003)))
    seeds = [child_seed(np.random.SeedSequence(3), i) for i in range(11)]
    for made, seed in zip(prepared.draw_all(seeds), seeds, strict=True):
        np.testing.assert_array_equal(made.deviation, prepared.draw(seed).deviation)


def test_target_is_hit_to_rounding(part):
    spec = Specification(flatness(TOP, 0.02), parallelism(RIGHT, 0.03, datums="A"), datums={"A": LEFT})
    lot = simulate_conforming(
        part,
        MODEL,
        spec,
        size=5,
        rng=4,
        conform={"flatness-1": target(0.0125), "parallelism-1": target(0.02)},
    )
    found = verify(lot, spec)
    np.testing.assert_allclose(found.values[:, 0], 0.0125, atol=1e-12)
    np.testing.assert_allclose(found.values[:, 1], 0.02, atol=1e-12)


def test_target_by_distribution_gives_parts_that_do_not_conform(part):
    spec = Specification(flatness(TOP, 0.02))
    drawn = target(lambda rng: rng.uniform(0.01, 0.03))
    values = verify(
        simulate_conforming(part, MODEL, spec, size=40, rng=5, conform=drawn, check=False), spec
    ).values[:, 0]
    assert values.min() > 0.01
    assert values.max() < 0.03
    assert 8 <= (values > 0.02).sum() <= 32  # binomial(40, 1/2): outside with probability 2e-4


def test_scale_touches_only_what_is_outside(part):
    spec = Specification(flatness(TOP, 0.008))
    raw = simulate_conforming(part, MODEL, spec, size=20, rng=6, conform="none", check=False)
    scaled = simulate_conforming(part, MODEL, spec, size=20, rng=6, conform="scale", check=False)
    rows = part.feature_of(TOP).rows
    values = verify(raw, spec).values[:, 0]
    assert (values > 0.008).any()
    assert (values < 0.008).any()
    for before, after, value in zip(raw.deviations, scaled.deviations, values, strict=True):
        factor = min(1.0, 0.008 / value)
        np.testing.assert_allclose(after[rows], factor * before[rows], rtol=1e-3)
    assert verify(scaled, spec).conforming.all()
    assert "scaled" in scaled.provenance.options["samplers"]


def test_none_is_the_raw_law(part):
    spec = Specification(flatness(TOP, 0.0001))
    lot = simulate_conforming(part, MODEL, spec, size=2, rng=7, conform="none", check=False)
    assert not verify(lot, spec).conforming.any()
    assert lot.provenance.options["conform"] == {"flatness-1": "none"}


def test_reject_gives_up_after_its_tries_and_says_why(part):
    spec = Specification(flatness(TOP, 0.001), flatness(BOTTOM, 0.05))
    with pytest.raises(
        ConformityError, match=r"flatness-1 \(flatness 0.001 on face 1\) binds.*of 5 attempts"
    ):
        simulate_conforming(part, MODEL, spec, conform="reject", max_tries=5)


def test_general_tolerance_holds_where_no_other_does(part):
    spec = Specification(
        flatness(TOP, 0.02), default=tolerance("surface_profile", None, 0.05, scope="general")
    )
    lot = simulate_conforming(part, MODEL, spec, size=3, rng=8)
    bound = prepare_conforming(part, MODEL, spec).spec
    assert len(bound) == 6
    assert verify(lot, bound).conforming.all()


def test_blocks_follow_the_model(part):
    class Strange(DeviationModel):
        name = "strange"

        def prepare(self, nominal, features=None):
            raise NotImplementedError

    assert len(independent_blocks(part, MODEL)) == 6
    assert len(independent_blocks(part, 2 * MODEL + WhiteNoise(0.01).on(TOP) + Paraboloid(0.01))) == 6
    assert len(independent_blocks(part, MODEL, whole=True)) == 1
    assert len(independent_blocks(part, Strange())) == 1


@pytest.mark.parametrize(
    ("conform", "message"),
    [
        ("clip", "is none of"),
        ("target", "needs a value"),
        ({"flat": "none"}, "no tolerance has the id 'flat'"),
        (7, "takes a name"),
    ],
)
def test_wrong_policies_are_named(conform, message):
    with pytest.raises(SpecificationError, match=message):
        policies_of(conform, Specification(flatness(TOP, 0.02)))


@pytest.mark.parametrize("value", [0.0, -1.0, float("inf"), float("nan")])
def test_meaningless_targets_are_refused(value):
    with pytest.raises(SpecificationError, match="must be positive"):
        target(value)
    with pytest.raises(SpecificationError, match="must be positive"):
        target(lambda rng: value).draw(np.random.default_rng(1))
    with pytest.raises(SpecificationError, match="only a target"):
        Conformity("scale", 0.02)


def test_zone_of_the_paper_is_kept_and_never_narrower(part):
    spec = Specification(flatness(TOP, 0.005))
    model = GaussianField(0.008, 50.0)
    lot = simulate_conforming(part, model, spec, size=12, rng=4, conform=Conformity(zone="pca"))
    feature = part.feature(TOP)
    widths = [pca_zone(skin.points[feature.vertex_ids], feature.faces[0].normal).width for skin in lot]
    flatnesses = verify(lot, spec).values[:, 0]
    assert max(widths) <= 0.005
    assert (flatnesses <= np.array(widths) * (1 + 1e-12)).all()
    usual = simulate_conforming(part, model, spec, size=12, rng=4)
    over = [pca_zone(skin.points[feature.vertex_ids]).width for skin in usual]
    assert max(over) > 0.005  # parts that the standard accepts
    assert lot.provenance.options["conform"]["flatness-1"] == "conditioned in the pca zone"
    hit = simulate_conforming(part, model, spec, rng=4, conform=Conformity("target", 0.004, zone="pca"))[0]
    assert pca_zone(hit.points[feature.vertex_ids]).width == pytest.approx(0.004, abs=1e-12)
    with pytest.raises(SpecificationError, match="minimum or pca"):
        Conformity(zone="least")  # type: ignore[arg-type]


def test_targets_that_share_a_feature(part):
    """Two targets are met together where they nest by a datum, and named where they cannot be."""
    spec = Specification(
        flatness(BOTTOM, 0.03), parallelism(TOP, 0.05, datums="A"), datums={"A": BOTTOM}
    )  # fmt: skip
    both = {"flatness-1": target(0.01), "parallelism-1": target(0.02)}
    lot = simulate_conforming(part, GaussianField(0.008, 50.0), spec, size=3, rng=4, conform=both)
    np.testing.assert_allclose(verify(lot, spec).values, [[0.01, 0.02]] * 3, atol=1e-11)
    apart = Specification(flatness(TOP, 0.03), parallelism(TOP, 0.05, datums="A"), datums={"A": BOTTOM})
    wrong = {"flatness-1": target(0.01), "parallelism-1": target(0.002)}
    with pytest.raises(ConformityError, match=r"-1 .*(cannot be met together|binds)"):
        simulate_conforming(part, GaussianField(0.008, 50.0), apart, rng=4, conform=wrong, max_tries=5)
