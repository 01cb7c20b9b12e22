"""Skin models of the bottom plane: Gibbs sampling inside a flatness of 0.3 mm, ellipsoid, and noise.

Figures 1, 2, 9 and 10 of the paper.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import cadskin as cs
from cadskin.conform import simulate_conforming, target
from cadskin.shape.association import associate

FLATNESS = 0.3  # mm, of the paper's drawing
GIBBS_SIGMA, GIBBS_LENGTH, SWEEPS = 0.06, 3.0, 1000  # mm, mm; the paper gives the sweeps only
# With a correlation length of 4 mm and more, 1000 sweeps are too few on this mesh (R-hat above 1.1).
ELLIPSOID_HEIGHT = 0.2  # mm from peak to valley; the paper gives none
NOISE_SIGMA = 0.01  # mm


@dataclass(frozen=True, eq=False)
class Zone:
    """Flatness of one skin model [mm]: along the paper's PCA direction, and by the minimum zone."""

    pca: float
    minimum: float


def gibbs_model() -> cs.Gibbs:
    """Return the Gaussian Markov random field of figure 1."""
    return cs.Gibbs(GIBBS_SIGMA, GIBBS_LENGTH, sweeps=SWEEPS, order="chromatic")


def gibbs_skins(bottom: cs.NominalModel, size: int = 3) -> cs.SkinEnsemble:
    """Return skin models whose minimum-zone flatness is 0.3 mm."""
    spec = cs.Specification(cs.flatness("<Z", FLATNESS))
    return simulate_conforming(bottom, gibbs_model(), spec=spec, size=size, conform=target(FLATNESS), rng=7)


def ellipsoid_skin(bottom: cs.NominalModel) -> cs.SkinModel:
    """Return the systematic deviation of figure 9."""
    return cs.simulate(bottom, cs.Ellipsoid(ELLIPSOID_HEIGHT, ratio=0.5))


def ellipsoid_and_noise(bottom: cs.NominalModel) -> cs.SkinModel:
    """Return figure 10: the ellipsoid and one-dimensional Gaussian noise."""
    return cs.simulate(bottom, cs.Ellipsoid(ELLIPSOID_HEIGHT, ratio=0.5) + cs.WhiteNoise(NOISE_SIGMA), rng=10)


def zones(points: np.ndarray) -> Zone:
    """Return the flatness of points (n, 3) by the PCA zone, Z(2) and Z(3), and by the minimum zone."""
    centred = points - points.mean(axis=0)
    normal = np.linalg.eigh(centred.T @ centred)[1][:, 0]
    return Zone(float(np.ptp(centred @ normal)), flatness(points))


def flatness(points: np.ndarray) -> float:
    """Return the minimum-zone flatness [mm] (ISO 1101)."""
    return float(associate(points, "plane", criterion="minimum zone").value)
