"""Amplitudes from a tolerance; one value where features meet tangentially."""

from __future__ import annotations

import numpy as np
import pytest
from surfaces import plane, rounded_slab

from cadskin.conform.blocks import gaussian_mean
from cadskin.deviation import (
    Bend,
    Fractal,
    FromFunction,
    GaussianField,
    Gibbs,
    KarhunenLoeve,
    Lobing,
    Paraboloid,
    Quadric,
    Randomised,
    Taper,
    Waviness,
    WhiteNoise,
)
from cadskin.errors import DeviationError
from cadskin.shape.patches import smooth_patches

SHARED = [
    GaussianField("from tolerance", 12),
    WhiteNoise("from tolerance"),
    KarhunenLoeve("from tolerance", 20),
    Fractal("from tolerance", 0.7, longest=20, shortest=10),
    Gibbs("from tolerance", 8),
    Paraboloid("from tolerance"),
    Waviness("from tolerance", 10),
    Lobing("from tolerance"),
    Taper("from tolerance"),
    Bend("from tolerance"),
]


@pytest.mark.parametrize("model", SHARED, ids=lambda model: model.name)
def test_default_share(model):
    key = "sigma" if hasattr(model, "sigma") else "amplitude"
    resolved = model.resolved(tolerance=0.4)
    assert getattr(resolved, key) == pytest.approx({"sigma": 0.05, "amplitude": 0.2}[key], rel=1e-15)
    with pytest.raises(DeviationError, match=r"share of a tolerance.*resolved\(tolerance=0.1\)"):
        model.sample(plane(h=4.0))


def test_stated_shares_inside_of_composed_models():
    model = (Paraboloid("0.25 of tolerance").on(">Z") + 2 * WhiteNoise("from tolerance")).on(kind="plane")
    again = Randomised(model, "norm", (1.0, 0.1)).resolved(tolerance=0.8)
    expected = (Paraboloid(0.2).on(">Z") + 2 * WhiteNoise(0.1)).on(kind="plane")
    assert again == Randomised(expected, "norm", (1.0, 0.1))
    assert expected.resolved(tolerance=3.0) == expected


@pytest.mark.parametrize("text", ["tolerance", "-0.1 of tolerance", "x of tolerance", "0 of tolerance"])
def test_nonsense_shares(text):
    with pytest.raises(DeviationError, match="WhiteNoise"):
        WhiteNoise(text)
    with pytest.raises(DeviationError, match="Paraboloid"):
        Paraboloid(text)


def test_tolerance_must_be_positive():
    with pytest.raises(DeviationError, match="tolerance must be greater than 0"):
        WhiteNoise("from tolerance").resolved(tolerance=0.0)


def heights(points, normals):
    return points[:, 1] + points[:, 0].mean()


@pytest.mark.parametrize(
    "model",
    [
        Paraboloid(0.05),
        Quadric(1e-3, 2e-3),
        Waviness(0.02, 7.0),
        Taper(0.05),
        FromFunction(heights),
    ],
    ids=lambda model: model.name,
)
def test_forms_have_one_value_per_node(model):
    slab = rounded_slab()
    nodes = smooth_patches(slab).node_of_sample
    field = model.sample(slab)[0]
    by_node = np.zeros(nodes.max() + 1)
    by_node[nodes] = field
    assert np.array_equal(by_node[nodes], field)
    alone = sum(
        model.on(name).sample(slab)[0] for name in ("top", "left", "bottom", "right")
    )  # each with its own value
    counts = np.bincount(nodes)
    assert (counts == 2).sum() > 20
    assert np.array_equal(alone[counts[nodes] == 1], field[counts[nodes] == 1])
    assert not np.allclose(alone, field)
    mean = np.bincount(nodes, weights=alone) / counts
    assert np.allclose(field, mean[nodes], atol=1e-15)


def test_the_mean_of_a_restricted_form_is_the_form():
    """Conformity conditions on the mean field: it must be what the sampler gives, also at tangent edges."""
    slab = rounded_slab()
    model = Paraboloid(0.05).on("top") + WhiteNoise(1e-12)
    assert np.allclose(gaussian_mean(model, slab), model.sample(slab)[0], atol=1e-10)
    nested = Paraboloid(0.05).on(["top", "left"]).on("top") + WhiteNoise(1e-12)
    assert np.allclose(gaussian_mean(nested, slab), nested.sample(slab)[0], atol=1e-10)
