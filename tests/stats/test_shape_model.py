"""The statistical shape model against numpy's SVD, closed forms and its own algebra."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cadskin as cs
from cadskin.errors import CadskinWarning, ReadError, StatisticsError
from cadskin.stats import StatisticalShapeModel, load_shape_model, sample_areas
from cadskin.stats.fitting import weighted_eigen
from cadskin.stats.robust import part_weights


def correlated(n, d, rng, sigmas=(0.06, 0.03, 0.015, 0.008), noise=0.0):
    """Parts of a known law: smooth orthonormal modes on a line of d samples of equal weight."""
    x = (np.arange(d) + 0.5) / d
    modes = np.sqrt(2) * np.cos(np.pi * np.outer(np.arange(1, len(sigmas) + 1), x))
    mean = 0.5 * x**2
    scores = rng.standard_normal((n, len(sigmas)))
    return mean + (scores * sigmas) @ modes + noise * rng.standard_normal((n, d)), mean, modes


def svd_oracle(fields, weights, ddof=1):
    centred = (fields - fields.mean(axis=0)) * np.sqrt(weights)
    _, singular, right = np.linalg.svd(centred, full_matrices=False)
    return singular**2 / (len(fields) - ddof), right / np.sqrt(weights)


@pytest.mark.parametrize("ddof", [0, 1])
@pytest.mark.parametrize(("n", "d"), [(10, 700), (40, 25), (6, 30_000)])
def test_modes_are_those_of_the_thin_svd(n, d, ddof):
    rng = np.random.default_rng(3)
    fields = rng.standard_normal((n, d)) * rng.uniform(0.5, 2, d) + 3.0
    weights = rng.uniform(0.2, 1.0, d)
    weights /= weights.sum()
    model = StatisticalShapeModel.fit(fields, weights=7 * weights, ddof=ddof)
    variances, modes = svd_oracle(fields, weights, ddof)
    k = min(n - 1, d)
    assert model.n_modes == k
    np.testing.assert_allclose(model.variances, variances[:k], rtol=1e-9)
    np.testing.assert_allclose(model.mean, fields.mean(axis=0), rtol=0, atol=1e-12)
    overlap = np.abs((model.modes * weights) @ modes[:k].T)
    np.testing.assert_allclose(overlap, np.eye(k), atol=2e-7)
    assert model.total_variance == pytest.approx(variances.sum(), rel=1e-10)


def test_covariance_is_z5_on_a_small_population():
    fields = np.random.default_rng(0).standard_normal((5, 3))
    model = StatisticalShapeModel.fit(fields, ddof=0)
    covariance = (model.modes.T * model.variances) @ model.modes
    np.testing.assert_allclose(covariance, np.cov(fields, rowvar=False, ddof=0), atol=1e-12)


def test_single_precision_is_summed_in_double():
    rng = np.random.default_rng(5)
    fields = (correlated(60, 40_000, rng, noise=0.01)[0] + 0.5).astype(
        np.float32
    )  # mean far above the spread
    single = StatisticalShapeModel.fit(fields, modes=20)
    double = StatisticalShapeModel.fit(fields.astype(np.float64), modes=20)
    np.testing.assert_allclose(single.variances, double.variances, rtol=1e-5)
    np.testing.assert_allclose(single.mean, double.mean, atol=1e-7)
    overlap = ((single.modes * single.weights) @ double.modes.T)[:4, :4]
    np.testing.assert_allclose(overlap, np.eye(4), atol=1e-4)


def test_memmap_is_read_by_chunks(tmp_path, monkeypatch):
    from cadskin.stats import _gram

    fields = correlated(8, 3000, np.random.default_rng(1))[0]
    stored = np.memmap(tmp_path / "fields.bin", dtype=np.float64, mode="w+", shape=fields.shape)
    stored[:] = fields
    whole = StatisticalShapeModel.fit(fields, modes=4)
    widths = []
    read = _gram.Columns.read

    def watched(self, start, stop, room=None):
        widths.append(stop - start)
        return read(self, start, stop, room)

    monkeypatch.setattr(_gram, "_CHUNK_VALUES", 8 * 100)
    monkeypatch.setattr(_gram, "_LEAST_WIDTH", 100)
    monkeypatch.setattr(_gram.Columns, "read", watched)
    chunked = StatisticalShapeModel.fit(stored, modes=4)
    assert max(widths) <= 100
    np.testing.assert_allclose(chunked.variances, whole.variances, rtol=1e-11)
    np.testing.assert_allclose(chunked.modes, whole.modes, atol=1e-8)


@settings(max_examples=30, deadline=None)
@given(st.integers(3, 9), st.integers(4, 60), st.integers(0, 2**31), st.sampled_from(["arithmetic", "tukey"]))
def test_coefficients_invert_instance(n, d, seed, center):
    rng = np.random.default_rng(seed)
    fields = rng.standard_normal((n, d))
    model = StatisticalShapeModel.fit(fields, weights=rng.uniform(0.1, 1, d), center=center)
    c = rng.standard_normal(model.n_modes)
    np.testing.assert_allclose(model.coefficients(model.instance(c)), c, atol=1e-6)
    rebuilt = np.array([model.project(field) for field in fields])
    kept = model.part_weights > 0
    np.testing.assert_allclose(rebuilt[kept], fields[kept], atol=1e-6)
    scores = np.array([model.coefficients(field) for field in fields])
    np.testing.assert_allclose(scores, model.scores, atol=1e-6)


def test_modes_are_numbered_from_one_and_signs_follow_the_rule():
    rng = np.random.default_rng(2)
    fields = correlated(12, 200, rng)[0]
    for given_fields in (fields, fields[::-1], -fields):
        model = StatisticalShapeModel.fit(given_fields)
        means = model.modes @ model.weights
        for mode, mean in zip(model.modes, means, strict=True):
            assert (mean >= 0.1) or (abs(mean) < 0.1 and mode[np.argmax(np.abs(mode))] > 0)
    np.testing.assert_allclose(
        model.instance({1: -2}), model.mean - 2 * np.sqrt(model.variances[0]) * model.modes[0]
    )
    np.testing.assert_array_equal(model.instance({}), model.mean)
    np.testing.assert_array_equal(model.instance([0, 1.0]), model.instance({2: 1.0}))
    for wrong in ({0: 1}, {12: 1}, {1.5: 1}, np.zeros(12)):
        with pytest.raises(StatisticsError):
            model.instance(wrong)


def test_truncation_keeps_the_fewest_modes_that_reach_the_share():
    values = np.diag([8.0, 6.0, 4.0, 2.0])
    model = StatisticalShapeModel.fit(np.vstack([values, -values]), weights=np.ones(4))
    shares = np.cumsum(model.variances) / model.total_variance
    np.testing.assert_allclose(shares, np.cumsum([64, 36, 16, 4]) / 120, rtol=1e-12)
    for share, count in ((0.5, 1), (64 / 120, 1), (0.54, 2), (0.9, 3), (1.0, 4)):
        assert model.truncate(share=share).n_modes == count
        assert StatisticalShapeModel.fit(np.vstack([values, -values]), share=share).n_modes == count
    assert model.truncate(modes=0).instance({}) == pytest.approx(model.mean)
    assert model.truncate(modes=1).noise > model.truncate(modes=3).noise
    with pytest.raises(StatisticsError, match="5 were asked"):
        model.truncate(modes=5)
    with pytest.raises(StatisticsError, match="either"):
        model.truncate()


@pytest.mark.parametrize("law", ["gaussian", "student", "kde"])
def test_samples_have_the_law_of_the_model(law):
    fields = correlated(30, 50, np.random.default_rng(4), noise=0.004)[0]
    model = StatisticalShapeModel.fit(fields).truncate(modes=3)
    drawn = model.sample(size=4000, rng=11, law=law)
    widened = {"gaussian": 1.0, "kde": 29 / 30, "student": (1 + 1 / 30) * 29 / 27}[law]
    expected = widened * model.variances
    got = np.array([model.coefficients(x) * model.sigmas for x in drawn])
    noise = model.noise**2 / 50  # white noise seen through a mode of the area mean
    np.testing.assert_allclose(got.var(axis=0), expected + noise, rtol=0.15)  # 4 sigma of 4000 (t: 6 %)
    assert np.abs(drawn.mean(axis=0) - model.mean).max() < 5 * drawn.std(axis=0).max() / np.sqrt(4000)
    residual = drawn - np.array([model.project(x) for x in drawn])
    assert residual.std() == pytest.approx(model.noise * np.sqrt(47 / 50), rel=0.02)
    np.testing.assert_array_equal(model.sample(size=2, rng=11, law=law), drawn[:2])
    smooth = model.sample(size=1, rng=11, law=law, noise=False)[0]
    np.testing.assert_allclose(model.project(smooth), smooth, atol=1e-12)


def test_noise_from_leave_one_out_finds_the_white_noise():
    rng = np.random.default_rng(8)
    fields = correlated(40, 400, rng, sigmas=(0.06, 0.03), noise=0.005)[0]
    model = StatisticalShapeModel.fit(fields).truncate(modes=2)
    assert model.noise == pytest.approx(0.005, rel=0.08)


def test_robust_centres_weight_parts_and_show_it():
    rng = np.random.default_rng(6)
    fields, mean, _ = correlated(10, 300, rng)
    fields[3] += 0.8 * np.cos(np.linspace(0, 3, 300))
    errors = {}
    for center in ("arithmetic", "geometric_median", "tukey"):
        model = StatisticalShapeModel.fit(fields, center=center)
        errors[center] = float(np.sqrt(np.mean((model.mean - mean) ** 2)))
        assert np.argmin(model.part_weights) == 3 or center == "arithmetic"
        np.testing.assert_allclose(
            model.mean, model.part_weights @ fields / model.part_weights.sum(), atol=1e-12
        )
        share = model.part_weights / model.part_weights.sum()
        np.testing.assert_allclose(share @ model.scores, 0, atol=1e-6)
    assert model.part_weights[3] == 0.0
    assert model.effective_parts < 10
    assert errors["tukey"] < 0.7 * errors["arithmetic"]
    assert errors["geometric_median"] < errors["arithmetic"]


def test_weighted_covariance_is_that_of_the_remaining_parts():
    """A part of weight 0 is as if it were not there."""
    fields = correlated(9, 100, np.random.default_rng(9))[0]
    from cadskin.stats.fitting import weighted_eigen

    gram = (fields @ fields.T) / 100
    q = np.ones(9)
    q[4] = 0.0
    full, _ = weighted_eigen(gram, q)
    rest = np.delete(fields, 4, axis=0)
    expected, _ = svd_oracle(rest, np.full(100, 0.01))
    np.testing.assert_allclose(full[:7], expected[:7], rtol=1e-9, atol=1e-15)


def test_part_model_of_an_ensemble_and_of_a_feature(array_box):
    ensemble = cs.skin.simulate_ensemble(array_box, cs.GaussianField(0.02, 40), size=6, rng=1, check=False)
    whole = cs.StatisticalShapeModel.fit(ensemble)
    top = array_box.feature(">Z")
    face = cs.StatisticalShapeModel.fit(ensemble, features=">Z")
    np.testing.assert_array_equal(face.rows, np.arange(top.start, top.stop))
    np.testing.assert_allclose(face.mean, whole.mean[top.rows], atol=1e-14)
    areas = sample_areas(array_box)
    assert areas.sum() == pytest.approx(array_box.surface.area, rel=1e-12)
    np.testing.assert_allclose(face.weights, areas[top.rows] / areas[top.rows].sum(), rtol=1e-12)
    skin = face.skin_model(face.instance({1: 2}))
    assert skin.closed
    np.testing.assert_array_equal(skin.deviation[top.rows], face.instance({1: 2}))
    assert np.count_nonzero(np.delete(skin.deviation, face.rows)) == 0
    assert len(whole.ensemble(whole.sample(size=3, rng=0))) == 3
    np.testing.assert_allclose(face.coefficients(ensemble[2]), face.scores[2], atol=1e-9)
    from_skins = cs.StatisticalShapeModel.fit([ensemble[0], ensemble[3], ensemble[4]])
    assert from_skins.nominal is array_box


def test_save_and_load(tmp_path, array_box, array_shaft):
    ensemble = cs.skin.simulate_ensemble(array_box, cs.GaussianField(0.02, 40), size=5, rng=1, check=False)
    model = StatisticalShapeModel.fit(ensemble, features=">Z", center="tukey")
    path = model.save(tmp_path / "model.npz")
    assert [p.name for p in tmp_path.iterdir()] == ["model.npz"]
    back = load_shape_model(path, nominal=array_box)
    for key in ("mean", "modes", "variances", "weights", "part_weights", "scores", "gram", "rows"):
        np.testing.assert_array_equal(getattr(back, key), getattr(model, key))
    assert (back.noise, back.center, back.ddof) == (model.noise, "tukey", 1)
    np.testing.assert_array_equal(back.sample(rng=3), model.sample(rng=3))
    assert load_shape_model(path).nominal is None
    with pytest.raises(StatisticsError, match="another nominal model"):
        load_shape_model(path, nominal=array_shaft)
    with pytest.raises(StatisticsError, match="nominal"):
        load_shape_model(path).skin_model(model.mean)
    (tmp_path / "bad.npz").write_bytes(b"nothing")
    with pytest.raises(ReadError, match="not a statistical shape model"):
        load_shape_model(tmp_path / "bad.npz")


BAD = [
    (np.ones((1, 5)), "one part"),
    (np.ones((4, 5)), "all 4 parts are equal"),
    ([np.ones(4), np.ones(5)], "shape \\(4,\\) and \\(5,\\)"),
    ([], "no part"),
    (np.ones(5), "one row per part"),
    (np.zeros((3, 0)), "empty"),
]


@pytest.mark.parametrize(("parts", "message"), BAD)
def test_bad_populations_are_refused(parts, message):
    with pytest.raises(StatisticsError, match=message):
        StatisticalShapeModel.fit(parts)


def test_twins_are_told():
    fields = correlated(5, 40, np.random.default_rng(0))[0]
    fields[4] = fields[1]
    with pytest.warns(CadskinWarning, match="parts 4 and 1|parts 1 and 4"):
        StatisticalShapeModel.fit(fields)


def test_progress_can_stop_the_fit():
    with pytest.raises(cs.CadskinError, match="stopped"):
        StatisticalShapeModel.fit(np.eye(4), progress=lambda done, total: False)


def test_unknown_names_are_refused():
    with pytest.raises(StatisticsError, match="center"):
        part_weights(np.eye(3), "best")
    with pytest.raises(StatisticsError, match="law"):
        StatisticalShapeModel.fit(np.eye(4)).sample(law="uniform")
    with pytest.raises(StatisticsError, match="ddof"):
        StatisticalShapeModel.fit(np.eye(4), ddof=2)
    with pytest.raises(StatisticsError, match="weights"):
        StatisticalShapeModel.fit(np.eye(4), weights=[1, 1, 1, 0])


def test_few_modes_of_many_parts_are_the_exact_ones():
    """The iterative eigen-solver finds double eigenvalues too."""
    rng = np.random.default_rng(5)
    vectors = np.linalg.qr(rng.standard_normal((400, 400)))[0]
    vectors[:, 0] = 1.0 / 20.0  # the Gram matrix of centred fields has the constant vector in its kernel
    vectors = np.linalg.qr(vectors)[0]
    values = np.r_[0.0, 9.0, 9.0, 4.0, 4.0, 4.0, 1.0, np.linspace(0.5, 0.1, 393)]
    gram = (vectors * values) @ vectors.T
    found, basis = weighted_eigen(gram, np.ones(400), largest=8)
    np.testing.assert_allclose(found * 399, [9, 9, 4, 4, 4, 1, 0.5, values[8]], rtol=1e-12)
    np.testing.assert_allclose(basis.T @ basis, np.eye(8), atol=1e-12)
    np.testing.assert_allclose(gram @ basis, basis * found * 399, atol=1e-10)
