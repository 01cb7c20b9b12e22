"""Every deviation model is classified by what it couples, and the class is true."""

import numpy as np
import pytest
from support.parts import box

from cadskin.conform.blocks import (
    BY_SAMPLE,
    COMPOSED,
    PATCHWISE,
    TOGETHER,
    coupled_features,
    gaussian_mean,
    independent_blocks,
)
from cadskin.deviation import (
    DeviationModel,
    Fractal,
    FromArray,
    FromSpectrum,
    GaussianField,
    KarhunenLoeve,
    Modes,
    Paraboloid,
    Randomised,
    Shift,
    SizeOffset,
    Taper,
    Tilt,
    VibrationModes,
    Waviness,
    WhiteNoise,
    model_class,
    model_names,
)
from cadskin.skin.simulate import child_seed

FIELD = GaussianField(0.01, 3.0)


@pytest.fixture(scope="module")
def part():
    return box()


def test_every_model_is_in_exactly_one_class():
    tables = (PATCHWISE, BY_SAMPLE, TOGETHER, COMPOSED)
    for name in model_names():
        model = model_class(name)
        if not model.__module__.startswith("cadskin."):
            continue
        found = [k for k, table in enumerate(tables) if issubclass(model, table)]
        assert len(found) == 1, f"{name}: put {model.__name__} into one table of cadskin.conform.blocks"


@pytest.mark.parametrize(
    ("model", "count"),
    [
        (FIELD, 6),
        (FIELD + Paraboloid(0.01), 6),
        (2 * WhiteNoise(0.01), 6),
        (Shift((0.0, 0.0, 0.01)), 1),
        (Randomised(Paraboloid(0.01), "norm", (1, 0.2)), 1),
        (FIELD + Tilt(0.001).on([0, 1]), 5),
        (FIELD + Randomised(SizeOffset(0.01), "norm", (0, 1)).on(2), 6),
        (FromArray(np.zeros((2, 138))), 1),
    ],
)
def test_blocks(part, model, count):
    assert len(independent_blocks(part, model)) == count
    assert len(independent_blocks(part, model, whole=True)) == 1


def test_unknown_class_couples_what_it_is_on(part):
    class Strange(DeviationModel):
        name = "strange"

        def prepare(self, nominal, features=None):
            return FIELD.prepare(nominal, features)

    assert len(coupled_features(Strange(), part)[0]) == 6
    assert [f.id for f in coupled_features(Strange().on([1, 2]), part)[0]] == [1, 2]
    assert coupled_features(Strange().on(1), part) == ()


@pytest.mark.parametrize(
    "model",
    [
        FIELD, WhiteNoise(0.01), KarhunenLoeve(0.01, 5.0), Modes([0.01, 0.02], random=True),
        VibrationModes([0.01], random=True), Fractal(0.01, 0.7, 6, 3), FromSpectrum([0.1, 0.2], [1e-3, 1e-3]),
    ],
    ids=lambda model: model.name,
)  # fmt: skip
def test_patchwise_models_are_independent_between_faces(part, model):
    seed = np.random.SeedSequence(1)
    fields = model.prepare(part).draw([child_seed(seed, i) for i in range(2000)])
    middle = [int(f.rows.start) for f in part.features]
    correlation = np.corrcoef(fields[:, middle].T)
    np.fill_diagonal(correlation, 0.0)
    assert abs(correlation).max() < 4.5 / np.sqrt(2000)  # 15 pairs, level 1e-4
    mean = gaussian_mean(model, part)
    assert abs(fields.mean(axis=0) - mean).max() < 6 * fields.std(axis=0).max() / np.sqrt(2000)


@pytest.mark.parametrize("model", [Paraboloid(0.01), Taper(0.01), SizeOffset(0.01), Waviness(0.01, 2.0)])
def test_systematic_models_do_not_depend_on_what_else_is_selected(part, model):
    whole = model.prepare(part).values
    for feature in part.features:
        np.testing.assert_allclose(model.prepare(part, [feature]).values[feature.rows], whole[feature.rows])
    np.testing.assert_allclose(gaussian_mean(model, part), whole)
