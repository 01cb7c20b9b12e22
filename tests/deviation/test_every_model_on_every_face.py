"""Every model of the registry on every kind of face, on one face and on the whole skin."""

from __future__ import annotations

import cadquery as cq
import numpy as np
import pytest
from surfaces import ball, covariance_at, funnel, plane, ring, rounded_slab, tube, wave

import cadskin
from cadskin import deviation as dv
from cadskin.errors import DeviationError
from cadskin.shape import Sphere as IdealSphere

FACES = {
    "plane": lambda: plane((60.0, 40.0), h=3.0),
    "cylinder": lambda: tube(12.0, 40.0, h=3.0),
    "cone": lambda: funnel(0.4, 20.0, 50.0, h=3.0),
    "sphere": lambda: ball(18.0, 400),
    "torus": lambda: ring(20.0, 8.0, h=3.0),
    "freeform": lambda: wave((60.0, 40.0), h=3.0),
}


def moved(part):
    return 0.02 * np.sin(part.surface.points[:, [1, 2, 0]] / 7.0)


def around(part):
    """A sphere that every normal meets from inside."""
    points = part.surface.points
    return IdealSphere(points.mean(axis=0), 2.0 * part.surface.diagonal)


# One model of each class of the registry, for a part.
MODELS = {
    "noise": lambda part: dv.WhiteNoise(0.01),
    "field": lambda part: dv.GaussianField(0.01, 12.0),
    "gibbs": lambda part: dv.Gibbs(0.01, 12.0, sweeps=20),
    "karhunen_loeve": lambda part: dv.KarhunenLoeve(0.01, 15.0, count=5),
    "modes": lambda part: cadskin.Modes([0.01, 0.01], first=1),
    "vibration": lambda part: dv.VibrationModes([0.01], first=1),
    "basis": lambda part: dv.BasisForm("legendre", {"1,2": 0.01}),
    "paraboloid": lambda part: dv.Paraboloid(0.02, (2.0, 1.0), 0.3, origin=(1.0, 2.0, 3.0)),
    "saddle": lambda part: dv.Saddle(0.02, direction=(1.0, 2.0, 0.5)),
    "cone": lambda part: dv.Cone(0.02),
    "sphere": lambda part: dv.Sphere(-0.02),
    "cylinder": lambda part: dv.Cylinder(0.02, rotation=0.4),
    "ellipsoid": lambda part: dv.Ellipsoid(0.02, ratio=2.0),
    "quadric": lambda part: dv.Quadric(1e-4, -2e-4),
    "clamped_bow": lambda part: dv.ClampedBow(0.02),
    "layers": lambda part: dv.LayerSteps(0.5, (0.3, 0.2, 1.0)),
    "shift": lambda part: dv.Shift((0.01, 0.02, 0.03)),
    "tilt": lambda part: dv.Tilt(1e-3, (1, 1, 0), centre=(0.0, 0.0, 1.0)),
    "torsor": lambda part: dv.Torsor((0, 0, 0.01), (1e-3, 0, 0), centre=(0.0, 0.0, 1.0)),
    "size": lambda part: dv.SizeOffset(0.01),
    "taper": lambda part: dv.Taper(0.02),
    "bend": lambda part: dv.Bend(0.02, direction=(1.0, 1.0, 1.0)),
    "twist": lambda part: dv.Twist(1e-3, (1.0, 0.3, 1.0), centre=(5.0, 0.0, 0.0)),
    "thermal": lambda part: dv.Thermal(50.0, gradient=(0.1, 0.0, 0.0), centre=(0.0, 0.0, 1.0)),
    "waviness": lambda part: dv.Waviness(0.02, 12.0, angle=0.3),
    "lobing": lambda part: dv.Lobing(0.02, lobes=3),
    "spectrum": lambda part: dv.FromSpectrum.self_affine(0.01, 0.7, longest=40, shortest=8, count=20),
    "fractal": lambda part: dv.Fractal(0.01, 0.6, longest=30, shortest=14),
    "function": lambda part: dv.FromFunction(lambda p, n: 1e-3 * p[:, 0] + 0.01 * n[:, 2]),
    "array": lambda part: dv.FromArray(moved(part)[part.samples.vertex_ids, 0]),
    "fe": lambda part: dv.FromFE(moved(part)),
    "scan": lambda part: dv.FromScan(part.surface.points + moved(part), reach=2.0),
    "towards": lambda part: dv.Towards(around(part), share=1e-3),
    "randomised": lambda part: dv.Randomised(dv.Paraboloid(0.02), "norm", (1.0, 0.2)),
    "sum": lambda part: dv.Paraboloid(0.02) + dv.WhiteNoise(0.001),
    "scaled": lambda part: 0.5 * dv.Saddle(0.02),
    "on": lambda part: dv.SizeOffset(0.01).on(list(part.features)),
}
# Displacements that depend on the extent of the selected features together, by their definition.
OF_THE_SELECTION = {"bend", "twist"}


pytestmark = pytest.mark.filterwarnings("ignore:Gibbs.*have not met:cadskin.CadskinWarning")


@pytest.fixture(scope="module")
def faces():
    return {name: make() for name, make in FACES.items()}


@pytest.fixture(scope="module")
def turned_part():
    """A solid of revolution with all kinds of faces: planes, cylinder, torus, cone, spline, ball."""
    profile = (
        cq.Workplane("XZ")
        .moveTo(0, 0)
        .lineTo(20, 0)
        .lineTo(20, 12)
        .radiusArc((16, 16), -4)
        .lineTo(13, 24)
        .spline([(10, 30), (12, 36)], includeCurrent=True)
        .lineTo(8, 38)
        .radiusArc((0, 46), -8)
        .close()
    )
    return cadskin.nominal(profile.revolve(360, (0, 0, 0), (0, 1, 0)), edge_length=3.0)


def test_every_class_of_the_registry_is_tried():
    assert set(MODELS) == {
        name for name in dv.model_names() if dv.model_class(name).__module__.startswith("cadskin")
    }


@pytest.mark.parametrize("kind", FACES)
@pytest.mark.parametrize("name", MODELS)
def test_on_each_kind_of_face(name, kind, faces):
    part = faces[kind]
    (feature,) = part.features
    assert feature.kind == {"freeform": "bspline"}.get(kind, kind)
    model = MODELS[name](part)
    values = model.sample(part, size=2, rng=5)
    assert values.shape == (2, part.n_samples)
    assert np.isfinite(values).all()
    assert np.abs(values).max() > 1e-5
    assert np.abs(values).max() < 1.0
    assert np.array_equal(values, model.sample(part, size=2, rng=5))
    one = dv.SumModel(getattr(model, "terms", (model,))).sample(part, size=2, rng=5)
    assert np.allclose((model + dv.SizeOffset(0.5)).sample(part, size=2, rng=5), one + 0.5, atol=1e-12)
    assert np.allclose((-2.0 * model).sample(part, size=2, rng=5), -2.0 * values, atol=1e-12)


@pytest.mark.parametrize("name", MODELS)
def test_whole_skin_and_one_face_of_a_cad_part(name, turned_part):
    """Zero elsewhere, and on the face the same as on the whole skin: by numbers, or by the law."""
    part = turned_part
    assert {f.kind for f in part.features} >= {"plane", "cylinder", "torus", "cone", "sphere"}
    assert len({f.kind for f in part.features}) == 6
    whole = MODELS[name](part)
    for feature in part.features:
        restricted = whole.on(feature)
        values = restricted.sample(part, size=2, rng=5)
        assert values.shape == (2, part.n_samples)
        assert np.isfinite(values).all()
        outside = np.ones(part.n_samples, bool)
        outside[feature.rows] = False
        assert (values[:, outside] == 0).all()
        if name not in OF_THE_SELECTION:
            same_on_the_face(whole, restricted, part, feature)


def same_on_the_face(whole, restricted, part, feature):
    samplers = [model.prepare(part) for model in (whole, restricted)]
    inner = rows_inside(part, feature)[:30]
    values = [sampler.sample(size=1, rng=3)[:, inner] for sampler in samplers]
    if np.ptp([sampler.sample(size=2, rng=7)[:, inner] for sampler in samplers[:1]], axis=1).max() == 0:
        assert np.allclose(*values, atol=1e-12)  # no chance in it
    elif min(sampler.latent for sampler in samplers) > 0:
        laws = [covariance_at(sampler, inner) for sampler in samplers]
        assert np.allclose(*laws, atol=1e-3 * laws[0].max())


def rows_inside(part, feature):
    """Samples whose point belongs to no other feature."""
    number = np.bincount(part.samples.vertex_ids, minlength=part.surface.n_points)
    rows = np.arange(feature.start, feature.stop)
    return rows[number[part.samples.vertex_ids[rows]] == 1]


@pytest.mark.parametrize("name", sorted(set(MODELS) - {"scan", "gibbs"}))
def test_on_faces_that_meet_tangentially(name):
    """One value per point of a smooth patch, on the whole skin."""
    part = rounded_slab(30.0, 24.0, 4.0, h=2.0)
    values = MODELS[name](part).sample(part, rng=1)[0]
    assert np.isfinite(values).all()
    vertex = part.samples.vertex_ids
    low, high = np.full(part.surface.n_points, np.inf), np.full(part.surface.n_points, -np.inf)
    np.minimum.at(low, vertex, values)
    np.maximum.at(high, vertex, values)
    assert (high - low).max() < 1e-9


@pytest.mark.parametrize(
    ("basis", "kinds"),
    [
        ("chebyshev", set(FACES)),
        ("dct", set(FACES)),
        ("zernike", set(FACES)),
        ("fourier_legendre", {"cylinder", "cone", "torus"}),
        ("fourier_chebyshev", {"cylinder", "cone", "torus"}),
        ("spherical", {"sphere"}),
    ],
)
def test_bases_say_which_faces_they_are_made_for(basis, kinds, faces):
    model = dv.BasisForm(basis, {"2,0": 0.01})
    for kind, part in faces.items():
        if kind in kinds:
            values = model.sample(part)[0]
            assert np.isfinite(values).all()
            assert np.ptp(values) > 0.01
        else:
            with pytest.raises(DeviationError, match=r"BasisForm: \w+ is no (sphere|cylinder)"):
                model.sample(part)
