"""Models on meshes and laws that cannot serve: each says what is wrong, where, and what to do."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay
from surfaces import model_of, plane, tube

from cadskin.deviation import (
    Fractal,
    GaussianField,
    Gibbs,
    KarhunenLoeve,
    Modes,
    Paraboloid,
    VibrationModes,
    WhiteNoise,
)
from cadskin.errors import CadskinError, CadskinWarning, DeviationError
from cadskin.shape import Plane

SE, WHITTLE = GaussianField(0.01, 12.0), GaussianField(0.01, 12.0, "whittle", metric="surface")
PATCHWISE = [
    SE,
    GaussianField(0.01, 12.0, "matern32"),
    WHITTLE,
    KarhunenLoeve(0.01, 12.0, count=3),
    Modes([0.01], first=1),
    VibrationModes([0.01], first=3),
    Fractal(0.01, 0.7, 16.0, 8.0),
    Gibbs(0.01, 2.0, sweeps=500),
]
ON_TRIANGLES = [
    WHITTLE,
    Modes([0.01], first=1),
    VibrationModes([0.01], first=3),
    Gibbs(0.01, 2.0, sweeps=500),
]


def name_of(model):
    return f"{model.name}-{getattr(model, 'kernel', '')}"


def square(h=2.0):
    x, y = (axis.ravel() for axis in np.meshgrid(h * np.arange(12), h * np.arange(9)))
    points = np.column_stack([x, y, 0 * x])
    return points, Delaunay(points[:, :2]).simplices


def part_of(*pieces):
    normals = [np.tile([0.0, 0.0, 1.0], (len(points), 1)) for points, _ in pieces]
    ideal = Plane([0, 0, 0], [0, 0, 1])
    return model_of(
        [(*piece, n, ideal, f"f{k}") for k, (piece, n) in enumerate(zip(pieces, normals, strict=True))]
    )


@pytest.mark.parametrize("model", PATCHWISE, ids=name_of)
def test_a_disconnected_feature_is_told(model):
    """Two pads in one feature: nothing couples them, and the user hears it."""
    points, triangles = square()
    two = part_of(
        (np.vstack([points, points + np.array([100, 0, 0])]), np.vstack([triangles, triangles + len(points)]))
    )
    with pytest.warns(CadskinWarning, match="f0 is not connected, it has 2 pieces.*independent on each"):
        values = model.sample(two, rng=1)
    assert np.isfinite(values).all()


@pytest.mark.parametrize("corner", [0, 2], ids=["repeated vertex", "three in a row"])
@pytest.mark.parametrize("model", ON_TRIANGLES, ids=name_of)
def test_degenerate_triangles_are_refused(model, corner):
    points, triangles = square()
    part = part_of((points, np.vstack([triangles, [[0, 1, corner]]])))
    with pytest.raises(
        CadskinError, match=r"without area at \(0, 0, 0\) mm|is degenerate.*mesh the part again"
    ):
        model.sample(part)


@pytest.mark.parametrize("model", [SE, Paraboloid(0.02), WhiteNoise(0.01)], ids=name_of)
def test_models_without_triangles_do_not_mind(model):
    points, triangles = square()
    good = model.sample(part_of((points, triangles)), rng=1)
    assert np.array_equal(model.sample(part_of((points, np.vstack([triangles, [[0, 1, 2]]]))), rng=1), good)


@pytest.mark.parametrize("model", [*ON_TRIANGLES, KarhunenLoeve(0.01, 12.0, count=3)], ids=name_of)
@pytest.mark.filterwarnings("ignore:.*fewer than four vertices")
def test_faces_without_area_are_refused(model):
    line = np.array([[0.0, 0, 5], [10, 0, 5], [20, 0, 5]])
    part = part_of(square(), (line, np.array([[0, 1, 2]])))
    with pytest.raises(CadskinError, match=r"without area|has no area|is degenerate"):
        model.sample(part)
    assert np.isfinite(model.on("f0").sample(part)).all()


@pytest.mark.parametrize(
    "model",
    [SE, GaussianField(0.01, 12, "exponential"), WHITTLE, Fractal(0.01, 0.7, 40.0, 20.0)],
    ids=name_of,
)
def test_too_few_vertices_per_length_are_told_with_the_bias(model):
    coarse = plane((60.0, 40.0), h=20.0)
    with pytest.warns(
        CadskinWarning, match=r"fewer than four vertices.*of the variance is left; use edge_length="
    ):
        model.sample(coarse)


def test_a_length_beyond_the_part_is_told():
    with pytest.warns(CadskinWarning, match="length is more than 100 times the part.*acts as a shift"):
        values = GaussianField(0.01, 1e4).sample(plane((60.0, 40.0), h=8.0), rng=1)
    assert np.ptp(values) < 1e-4


@pytest.mark.parametrize(("lower", "upper"), [(0.01, 0.01), (0.02, -0.02), (np.inf, None)])
def test_limits_that_exclude_everything(lower, upper):
    with pytest.raises(DeviationError, match=r"Gibbs: at sample 0 the lower limit .* nothing is left"):
        Gibbs(0.01, 4.0, lower=lower, upper=upper).sample(plane((30.0, 20.0), h=3.0))


def test_chains_that_have_not_met_are_told():
    with pytest.warns(CadskinWarning, match=r"chains from far apart starts have not met \(split R-hat"):
        Gibbs(0.01, 12.0, sweeps=20).prepare(plane((30.0, 20.0), h=3.0))


def test_a_covariance_that_is_not_positive_definite_names_the_way_out():
    with pytest.raises(
        DeviationError, match=r"squared_exponential.*geodesic.*not positive definite.*metric="
    ):
        GaussianField(0.01, 30.0, metric="geodesic").sample(tube(20.0, 40.0, 4.0))
