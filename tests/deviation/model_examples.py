"""One model of each class of the registry, with as many parameters away from their defaults as it has."""

from __future__ import annotations

import numpy as np

from cadskin import deviation as dv
from cadskin.shape import Sphere as IdealSphere

FRAME = {"centre": (1.0, 2.0), "rotation": 0.3, "origin": (0.5, 0.25, 0.125), "direction": (1.0, 0.5, 0.25)}
VECTOR = (0.01, 0.02, 0.03)
NOISE = dv.WhiteNoise(0.01)

EXAMPLES = {
    "noise": NOISE,
    "field": dv.GaussianField(0.01, 12.0, "matern32", anisotropy=2.0, direction=(1.0, 0.5, 0.25)),
    "gibbs": dv.Gibbs(0.01, 12.0, sweeps=20, lower=-0.02, upper=0.03, start=1.0),
    "karhunen_loeve": dv.KarhunenLoeve(0.01, 15.0, energy=0.75, count=5),
    "modes": dv.Modes([0.01, 0.02], first=1, random=True, edges="fixed"),
    "vibration": dv.VibrationModes([0.01, 0.02], first=1, edges="supported", thickness=2.0, poisson=0.25),
    "basis": dv.BasisForm("legendre", {"1,2": 0.01, "3,0": -0.02}),
    "paraboloid": dv.Paraboloid(0.02, ratio=0.5, **FRAME),
    "saddle": dv.Saddle(0.02, **FRAME),
    "cone": dv.Cone(0.02, **FRAME),
    "sphere": dv.Sphere(-0.02, **FRAME),
    "cylinder": dv.Cylinder(0.02, **FRAME),
    "ellipsoid": dv.Ellipsoid(0.02, ratio=2.0, **FRAME),
    "quadric": dv.Quadric(
        1e-4, -2e-4, 0.3, (1.0, 2.0), -0.5, origin=(0.5, 0.25, 0.125), direction=(1.0, 0.5, 0.25)
    ),
    "clamped_bow": dv.ClampedBow(0.02, **FRAME),
    "layers": dv.LayerSteps(0.5, (0.25, 0.5, 1.0)),
    "shift": dv.Shift(VECTOR),
    "tilt": dv.Tilt(1e-3, (1.0, 1.0, 0.5), centre=VECTOR),
    "torsor": dv.Torsor(VECTOR, (1e-3, 2e-3, 0.0), centre=VECTOR),
    "size": dv.SizeOffset(0.01),
    "taper": dv.Taper(0.02),
    "bend": dv.Bend(0.02, (1.0, 0.5, 0.25), (1.0, 1.0, 0.5)),
    "twist": dv.Twist(1e-3, (1.0, 0.25, 1.0), centre=VECTOR),
    "thermal": dv.Thermal(50.0, 2e-5, (0.1, 0.2, 0.3), centre=VECTOR),
    "waviness": dv.Waviness(0.02, 7.0, 0.3, 0.5),
    "lobing": dv.Lobing(0.02, lobes=5),
    "spectrum": dv.FromSpectrum([0.1, 0.2, 0.4], [1e-5, 2e-5, 1e-5], 0.3),
    "fractal": dv.Fractal(0.01, 0.7, longest=40.0, shortest=5.0),
    "array": dv.FromArray(np.array([[0.01, 0.02], [0.03, 0.04]])),
    "fe": dv.FromFE(np.array([VECTOR, VECTOR])),
    "scan": dv.FromScan(np.arange(36.0).reshape(12, 3), 0.5, neighbours=9),
    "function": dv.FromFunction(lambda points, normals: 0 * points[:, 0]),
    "towards": dv.Towards(IdealSphere([1.0, 2.0, 3.0], 5.0), 0.5),
    "randomised": dv.Randomised(dv.Paraboloid(0.02), "norm", (1.0, 0.25)),
    "sum": dv.SumModel((NOISE, dv.Paraboloid(0.02))),
    "scaled": dv.ScaledModel(0.5, NOISE),
    "on": dv.RestrictedModel(NOISE, ">Z", {"area": (1.0, 2.5)}),
}
