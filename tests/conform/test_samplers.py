"""Every sampler of bands against plain rejection on all points, at several acceptance rates."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.stats import kstest, norm
from support.parts import box

from cadskin.conform import conditioned, prepare_conforming
from cadskin.conform._bands import widest
from cadskin.conform._chains import coordinate_sweep
from cadskin.conform._trajectory import heights_of, trajectory
from cadskin.conform.bands import Band, fixed_band, flat_band, level_band
from cadskin.conform.chains import chain_route, run_chain
from cadskin.conform.confirmation import is_flat_enough
from cadskin.conform.flat import flat_places
from cadskin.conform.reduced import reduced_block
from cadskin.conform.requirements import value_of, welded_part
from cadskin.conform.screening import acceptance_of, search_of, search_on
from cadskin.deviation import GaussianField, Paraboloid
from cadskin.deviation._philox import stream_of
from cadskin.errors import ConformityError, DeviationError, SpecificationError
from cadskin.skin import simulate_ensemble, weld
from cadskin.spec import Specification, flatness

TOP = 1
COUNT = 250
RAW = 30_000


@cache
def part():
    return box((60.0, 40.0, 20.0), h=3.0)


@cache
def sampler(length=12.0):
    feature = part().feature_of(TOP)
    return GaussianField(0.01, length).prepare(part(), [feature])


@cache
def raw(length=12.0):
    return sampler(length).sample(size=RAW, rng=1)


def bands(kind, *shares, length=12.0):
    """Bands on the top face; a share is a quantile of the width that raw fields need."""
    feature = part().feature_of(TOP)
    rows = np.arange(feature.start, feature.stop)
    flat = flat_places(feature.points, np.array([0.0, 0, 1]))
    made = []
    for one, share in zip(kind, shares, strict=True):
        loose = {"form": lambda limit: flat_band(flat, rows, limit), "orientation": lambda limit:
                 level_band(rows, limit), "position": lambda limit: fixed_band(rows, limit)}[one]  # fmt: skip
        widths = [loose(1.0).width(np.ascontiguousarray(field[rows])) for field in raw(length)[:4000]]
        made.append(loose(float(np.quantile(widths, share))))
    return tuple(made)


def block_of(wanted, length=12.0):
    feature = part().feature_of(TOP)
    return reduced_block(sampler(length), np.arange(feature.start, feature.stop), wanted)


def statistics(block, fields):
    feature = part().feature_of(TOP)
    x = feature.points[:, 0] - feature.points[:, 0].mean()
    return {
        "mean": fields.mean(axis=1), "tilt": fields @ x / (x @ x), "rms": np.sqrt((fields**2).mean(axis=1)),
        "corner": fields[:, 0], "middle": fields[:, int(np.argmin(np.abs(x)))],
        **{f"width {c}": np.array([band.width(np.ascontiguousarray(field)) for field in fields])
           for c, band in enumerate(block.requirements)},
    }  # fmt: skip


@cache
def reference(kind, shares, length=12.0):
    block = block_of(bands(kind, *shares, length=length), length)
    fields = raw(length)[:, block.rows]
    return fields[[block.holds(field) for field in fields]]


def assert_same(block, fields, plain, error_level):
    from scipy.stats import ks_2samp

    mine, theirs = statistics(block, fields), statistics(block, plain)
    for name, values in mine.items():
        found = ks_2samp(values, theirs[name])
        assert found.pvalue > error_level / len(mine), f"{name}: p = {found.pvalue:.2g}"


CASES = [
    (("form",), (0.5,)), (("form",), (0.1,)), (("form",), (0.02,)), (("orientation",), (0.1,)),
    (("position",), (0.3,)), (("position",), (0.03,)), (("form", "position"), (0.2, 0.3)),
    (("form", "orientation", "position"), (0.4, 0.3, 0.5)),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "shares"), CASES)
def test_exact_hmc(kind, shares):
    plain = reference(kind, shares)
    block = block_of(bands(kind, *shares))
    route = chain_route(block, "hmc")
    fields = np.array([run_chain(route, stream_of(np.random.SeedSequence((5, i))))[0] for i in range(COUNT)])
    assert all(block.holds(field) for field in fields)
    assert_same(block, fields, plain, 1e-4)
    assert route.report.rhat < 1.05
    assert route.report.independent_per_step > 0.3


@pytest.mark.parametrize(("method", "case"), [("slice", 1), ("slice", 6), ("gibbs", 1), ("gibbs", 6)])
def test_slice_and_gibbs(method, case):
    kind, shares = CASES[case]
    length = 12.0 if method == "slice" else 40.0
    plain = reference(kind, shares, length)
    block = block_of(bands(kind, *shares, length=length), length)
    route = chain_route(block, method)
    count = COUNT if method == "slice" else 150
    fields = np.array([run_chain(route, stream_of(np.random.SeedSequence((6, i))))[0] for i in range(count)])
    assert_same(block, fields, plain, 1e-4)
    assert route.report.rhat < 1.1


@pytest.mark.parametrize(("kind", "shares"), [CASES[0], CASES[1], CASES[6]])
def test_screened_rejection(kind, shares):
    plain = reference(kind, shares)
    block = block_of(bands(kind, *shares))
    searches = [search_of(block, stream_of(np.random.SeedSequence((7, i)))) for i in range(COUNT)]
    search_on(searches, block, 5000)
    assert_same(block, np.array([search.found for search in searches]), plain, 1e-4)
    share = len(plain) / RAW
    tried = sum(search.tried for search in searches)
    assert COUNT / tried == pytest.approx(share, rel=5 * (1 / COUNT + 1 / len(plain)) ** 0.5)
    assert sum(int(search.refused.sum()) for search in searches) == tried - COUNT
    assert acceptance_of(block) == pytest.approx(share, abs=5 * (share * (1 - share) / 1024) ** 0.5)


def test_a_search_does_not_depend_on_those_beside_it():
    block = block_of(bands(("form",), 0.1))
    states = [stream_of(np.random.SeedSequence((8, i))) for i in range(9)]
    together = [search_of(block, state) for state in states]
    search_on(together, block, 500)
    alone = search_of(block, states[4])
    for _ in range(50):  # in pieces, too
        search_on([alone], block, 10)
    assert alone.next == together[4].next
    assert (alone.found == together[4].found).all()


def test_the_comparison_has_power():
    """Fields scaled into the zone follow another law, and these statistics see it."""
    block = block_of(bands(("form",), 0.1))
    fields = raw()[:COUNT, block.rows]
    limit = block.requirements[0].limit
    scaled = np.array([field * min(1.0, limit / block.requirements[0].width(field)) for field in fields])
    with pytest.raises(AssertionError, match="width"):
        assert_same(block, scaled, reference(("form",), (0.1,)), 1e-4)


def test_trajectories_keep_inside_and_reverse():
    block = block_of(bands(("form", "position"), 0.02, 0.02))
    rng = np.random.default_rng(2)
    z, here = rng.standard_normal(block.latent), np.zeros(block.factor.shape[1])
    share = np.inf
    while share > 1.0:
        z *= 0.7
        heights_of(z, block.factor, here)
        share = widest(here, block.bands, np.zeros(len(here)))
    reflections = 0
    for _ in range(60):
        velocity, start = rng.standard_normal(block.latent), z.copy()
        energy = z @ z + velocity @ velocity
        count, _ = trajectory(z, velocity, block.factor, block.bands, np.pi / 2)
        reflections += count
        assert z @ z + velocity @ velocity == pytest.approx(energy, rel=1e-10)
        heights_of(z, block.factor, here)
        assert widest(here, block.bands, np.zeros(len(here))) <= 1 + 1e-6
        if count < 4:  # further on, rounding has grown
            back, flipped = z.copy(), -velocity
            trajectory(back, flipped, block.factor, block.bands, np.pi / 2)
            assert back == pytest.approx(start, abs=1e-5)
    assert reflections > 60


def test_one_coordinate_is_a_truncated_normal():
    """A sweep over one number draws from the normal law between two bounds, here exactly known."""
    block = block_of(bands(("position",), 0.5))
    one = np.ascontiguousarray(block.factor[:1])
    limit = block.requirements[0].limit
    bound = 0.5 * limit / np.abs(one).max()
    uniforms = np.random.default_rng(3).random((2000, 1))
    drawn = np.zeros(2000)
    z = np.zeros(1)
    for i, uniform in enumerate(uniforms):
        coordinate_sweep(z, uniform, one, block.bands)
        drawn[i] = z[0]
    inside = norm.cdf(bound) - norm.cdf(-bound)
    assert np.abs(drawn).max() <= bound * (1 + 1e-9)
    assert kstest(drawn, lambda v: (norm.cdf(v) - norm.cdf(-bound)) / inside).pvalue > 1e-4


def test_a_mean_inside_the_zone_and_one_outside():
    spec = Specification(flatness(TOP, 0.02))
    model = GaussianField(0.01, 12.0)
    near = prepare_conforming(
        part(), model + Paraboloid(0.01).on(TOP), spec, conform=conditioned(sampler="hmc")
    )
    made = near.draw(np.random.SeedSequence(1))
    assert made.values["flatness-1"] <= 0.02
    far = prepare_conforming(
        part(), model + Paraboloid(0.05).on(TOP), spec, conform=conditioned(sampler="hmc")
    )
    with pytest.raises(ConformityError, match=r"the mean of the model alone needs 0\.0\d+ mm"):
        far.draw(np.random.SeedSequence(1))


def test_far_beyond_rejection_by_the_front_door():
    spec = Specification(flatness(TOP, 0.004))
    lot = simulate_ensemble(part(), GaussianField(0.01, 12.0), size=3, spec=spec, rng=4)
    options = lot.provenance.options
    assert options["samplers"] == ["hmc"]
    (chain,) = options["chains"]
    assert chain["method"] == "hmc"
    assert chain["tolerances"] == ["flatness-1"]
    assert chain["rhat"] < 1.1
    again = simulate_ensemble(part(), GaussianField(0.01, 12.0), size=2, spec=spec, rng=4)
    assert (again.deviations == lot.deviations[:2]).all()


def test_the_proof_of_a_flatness_agrees_with_the_evaluator():
    """Where the bound holds the evaluated value is below it, slides of the weld included."""
    spec = Specification(flatness(TOP, 0.04))
    ready = prepare_conforming(part(), GaussianField(0.01, 12.0), spec)
    item, nominal = ready.requirements[0], part()
    proven = 0
    for i, field in enumerate(GaussianField(0.01, 12.0).sample(nominal, size=40, rng=9)):
        displacement = weld(nominal, field)
        value = value_of(item, welded_part(nominal, field), ready.spec)
        for share in (1 - 1e-5, 1 + 1e-3, 1.5):
            asked = replace(item, limit=share * value)
            enough = is_flat_enough(asked, nominal, displacement)
            proven += enough
            assert not (enough and share < 1), i
    assert proven > 60  # 40 at 1.5, most at 1.001


def test_values_do_not_change_the_parts():
    spec = Specification(flatness(TOP, 0.03), flatness(0, 0.03))
    ready = prepare_conforming(part(), GaussianField(0.01, 12.0), spec)
    seeds = [np.random.SeedSequence((11, i)) for i in range(5)]
    with_values, without = list(ready.draw_all(seeds)), list(ready.draw_all(seeds, values=False))
    for one, other in zip(with_values, without, strict=True):
        assert (one.deviation == other.deviation).all()
        assert max(one.values.values()) <= 0.03


def test_a_simulation_is_stopped_by_its_progress():
    class Stopped(Exception):
        pass

    def progress(done, total):
        if done == 2:
            raise Stopped

    spec = Specification(flatness(TOP, 0.03))
    with pytest.raises(Stopped):
        simulate_ensemble(part(), GaussianField(0.01, 12.0), size=1000, spec=spec, rng=1, progress=progress)


def test_plain_rejection_gives_up_and_says_why():
    spec = Specification(flatness(TOP, 0.004))
    with pytest.raises(ConformityError, match=r"flatness-1 .* binds: .*sampler='auto'"):
        simulate_ensemble(
            part(), GaussianField(0.01, 12.0), size=1, spec=spec, conform="conditioned by rejection", rng=1
        )


def test_samplers_that_do_not_serve():
    with pytest.raises(SpecificationError, match="sampler must be one of auto, rejection"):
        conditioned(sampler="metropolis")
    with pytest.raises(SpecificationError, match="conditioned"):
        prepare_conforming(
            part(), GaussianField(0.01, 12.0), Specification(flatness(TOP, 1)), conform="none by hmc"
        )
    with pytest.raises(DeviationError, match="limit must be positive"):
        Band(1, np.arange(3), 0.0)
    assert str(conditioned(sampler="gibbs")) == "conditioned by gibbs"
