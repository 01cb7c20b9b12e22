"""Sizes with limits and models named by tolerances move the features, and are verified."""

import numpy as np
import pytest
from scipy.stats import kstest
from support.parts import plate_with_hole

from cadskin.conform import bound_part, capable_model, prepare_conforming, process_of, simulate_conforming
from cadskin.conform.policy import policies_of, target
from cadskin.conform.process import model_of_tolerance
from cadskin.conform.sizes import mean_offsets, middle_models
from cadskin.deviation import GaussianField, Paraboloid
from cadskin.errors import ConformityError, SpecificationError
from cadskin.skin.simulate import simulate_ensemble
from cadskin.spec import Dimension, Specification, flatness, size, surface_profile
from cadskin.verify import verify


@pytest.fixture(scope="module")
def part():
    return plate_with_hole()


def bore_of(part):
    return part.feature(kind="cylinder")


def sized(part, lower, upper, *tolerances, **more):
    bore = size(bore_of(part).face_indices[0], 2 * bore_of(part).ideal.radius, (lower, upper), id="bore")
    return Specification(*tolerances, dimensions=[bore], **more).bind(part)


def test_hole_is_moved_to_the_middle_of_its_limits_and_stays_inside(part):
    spec = sized(part, 0.02, 0.08, default=surface_profile(None, 0.4))
    lot = simulate_conforming(part, process_of(part, spec), spec, size=12, rng=3)
    bore, diameters = bore_of(part), []
    for skin in lot:
        found = verify(skin, spec, sizes=True)["bore"]
        assert found.ok
        diameters += [found.details["smallest"], found.details["largest"]]
    nominal = 2 * bore.ideal.radius
    assert 0.02 <= min(diameters) - nominal < max(diameters) - nominal <= 0.08
    assert np.mean(diameters) - nominal == pytest.approx(0.05, abs=0.01)
    assert lot.deviations[:, bore.rows].mean() < 0  # a hole that grows loses material


def test_offset_of_the_size_has_its_law(part):
    spec = sized(part, -0.03, 0.03)
    (model,) = middle_models(spec, part)
    drawn = simulate_ensemble(part, model, size=400, rng=1, check=False).deviations
    rows = bore_of(part).rows
    assert np.ptp(drawn[:, rows], axis=1).max() == 0.0
    assert not np.delete(drawn, np.r_[rows], axis=1).any()
    assert kstest(2 * drawn[:, rows][:, 0] / (0.06 / 12), "norm").pvalue > 1e-3
    assert not mean_offsets(spec, part).any()


def test_raw_parts_miss_a_size_that_conditioned_parts_keep(part):
    spec = sized(part, -0.004, 0.004)
    model = GaussianField(0.003, 20.0)
    raw = [verify(skin, spec, sizes=True)["bore"].ok
           for skin in simulate_ensemble(part, model, size=12, rng=2, check=False)]  # fmt: skip
    kept = [verify(skin, spec, sizes=True)["bore"].ok
            for skin in simulate_conforming(part, model, spec, size=6, rng=2)]  # fmt: skip
    assert not all(raw)
    assert all(kept)


def test_a_bound_part_stands_for_its_specification(part, monkeypatch):
    """The same process and the same bits, and nothing is bound again; another part is refused."""
    from cadskin.conform import bound

    spec = sized(part, -0.03, 0.03, flatness(0, 0.05))
    law = process_of(part, spec)
    lot = simulate_conforming(part, law, spec, size=2, rng=5)
    once = bound_part(spec, part)
    monkeypatch.setattr(bound, "bound_to", lambda *_: pytest.fail("bound again"))
    assert process_of(part, once) == law
    assert np.array_equal(simulate_conforming(part, law, once, size=2, rng=5).deviations, lot.deviations)
    with pytest.raises(SpecificationError, match="bound to another"):
        process_of(plate_with_hole(), once)


def test_sizes_that_cannot_be_used_are_listed(part):
    spec = sized(part, 5.0, 5.1, flatness(0, 0.1))
    prepared = prepare_conforming(part, capable_model(part, spec), spec)
    assert [item.tolerance for item in prepared.unsupported] == ["bore"]
    assert "is not the size of" in prepared.unsupported[0].reason
    one = Specification(flatness(0, 0.1), dimensions=[
        Dimension("d", "size", "diameter", 4.0, None, 4.1, feature=spec.dimensions[0].feature)
    ]).bind(part)  # fmt: skip
    assert "one limit only" in prepare_conforming(part, GaussianField(0.001, 9.0), one).unsupported[0].reason
    with pytest.raises(SpecificationError, match="the size bore can be conditioned"):
        policies_of({"bore": target(0.01)}, spec)
    assert policies_of("scale", spec)["bore"].method == "conditioned"
    assert policies_of("none", spec)["bore"].method == "none"


def test_named_model_drives_its_feature_alone(part):
    spec = Specification(flatness(1, 0.04, model={"paraboloid": {}}), default=surface_profile(None, 0.4))
    model = process_of(part, spec)
    fields = model.sample(part, size=3, rng=1)
    feature = part.feature(1)
    alone = Paraboloid(0.02).sample(part)[0]
    np.testing.assert_allclose(fields[:, feature.rows], np.tile(alone[feature.rows], (3, 1)), atol=1e-15)
    others = np.delete(fields, np.r_[feature.rows], axis=1)
    assert (others.std(axis=0) > 0).all()
    lot = simulate_conforming(part, model, spec, size=3, rng=1)
    assert (verify(lot, spec).values[:, 0] <= 0.04).all()


def test_models_of_several_tolerances_add_up(part):
    spec = Specification(
        flatness(1, 0.04, model={"paraboloid": {"amplitude": 0.01}}),
        surface_profile(1, 0.2, model={"field": {"sigma": "from tolerance", "length": 30}}),
    )
    fields = process_of(part, spec, default=GaussianField(1e-6, 10.0)).sample(part, size=400, rng=4)
    rows = part.feature(1).rows
    np.testing.assert_allclose(fields[:, rows].std(axis=0).mean(), 0.2 / 8, rtol=0.15)
    assert np.ptp(fields[:, rows].mean(axis=0)) > 0.005  # the paraboloid


def test_default_parameters_and_wrong_models(part):
    spec = Specification(flatness(1, 0.08, model={"sum": {"terms": [{"field": {}}, {"paraboloid": {}}]}}))
    model = model_of_tolerance(spec.bind(part)["flatness-1"], length=12.0)
    assert str(model) == "GaussianField(sigma=0.01 mm, length=12 mm) + Paraboloid(amplitude=0.04 mm)"
    for table, message in (({"fild": {}}, "fild"), ({"field": {"lenth": 3}}, "lenth"), ({}, "one table")):
        wrong = Specification(flatness(1, 0.08, model=table))
        with pytest.raises(SpecificationError, match=rf"tolerance flatness-1 \(flatness\): .*{message}"):
            process_of(part, wrong)


def test_policy_of_a_tolerance(part):
    spec = Specification(flatness(1, 0.05, policy="target 0.03"), flatness(0, 0.05, policy="none"))
    found = policies_of("conditioned", spec)
    assert [str(found[name]) for name in ("flatness-1", "flatness-2")] == ["target 0.03", "none"]
    assert str(policies_of({"flatness-2": "scale"}, spec)["flatness-2"]) == "scale"
    lot = simulate_conforming(part, GaussianField(0.01, 20.0), spec, size=2, rng=1)
    np.testing.assert_allclose(verify(lot, spec).values[:, 0], 0.03, atol=1e-12)
    for text in ("clip", "target", "target much"):
        with pytest.raises(SpecificationError):
            policies_of("conditioned", Specification(flatness(1, 0.05, policy=text)))


def test_spread_is_scaled_and_the_middle_is_not(part):
    spec = sized(part, 0.0, 0.06)
    (usual,), (wide,) = middle_models(spec, part), middle_models(spec, part, scale=3.0)
    assert wide.model.arguments == pytest.approx((usual.model.arguments[0], 3 * usual.model.arguments[1]))
    with pytest.raises(ConformityError, match=r"bore .* binds"):
        simulate_conforming(part, GaussianField(1e-6, 9.0), sized(part, 0.02, 0.06), rng=1, max_tries=3)


@pytest.mark.parametrize("outside", [0.0, 0.03, 0.1])
def test_process_aims_at_the_middle_of_an_unequal_zone(part, outside):
    top = part.feature(">Z")
    zone = surface_profile(top.face_indices[0], 0.1, datums="A", outside=outside)
    spec = Specification(zone, datums={"A": "<Z"}, default=surface_profile(None, 0.2)).bind(part)
    lot = simulate_conforming(part, process_of(part, spec), spec, size=12, rng=3)
    assert all(verify(skin, spec)[next(iter(spec)).id].ok for skin in lot)
    assert lot.deviations[:, top.rows].mean() == pytest.approx(outside - 0.05, abs=0.015)
