"""21 Gallery: random fields, modes and random amplitudes, each with a standard deviation of about 0.03 mm.

Each model lies on a freeform face, a plane and a cylinder. `main` returns the number of models that do.
"""

from __future__ import annotations

import sys

import gallery
import scipy.stats

import cadskin as cs
from cadskin.deviation import parameter_design


def models() -> dict[str, cs.DeviationModel]:
    form = cs.Paraboloid(0.1) + cs.Waviness(0.03, wavelength=12)
    chances = {
        "terms.0.amplitude": scipy.stats.norm(0.0, 0.06),
        "terms.1.wavelength": scipy.stats.uniform(8, 12),
    }
    first, second, *_ = parameter_design(form, chances, size=8, rng=3).models
    return {
        "WhiteNoise": cs.WhiteNoise(0.02),
        "GaussianField": cs.GaussianField(0.03, length=8),
        "... rough": cs.GaussianField(0.03, length=8, kernel="exponential"),
        "... along the surface": cs.GaussianField(0.03, length=8, kernel="whittle", metric="surface"),
        "... marks": cs.GaussianField(0.03, length=5, anisotropy=5.0, direction=(1.0, 1.0, 0.0)),
        "... length varies": cs.GaussianField(0.03, lambda points: 6 + 0.1 * abs(points[:, 1])),
        "Gibbs, in limits": cs.Gibbs(0.03, length=3, sweeps=200, lower=-0.04, upper=0.04),
        "KarhunenLoeve": cs.KarhunenLoeve(0.03, length=15, count=10),
        "Modes": cs.Modes([0.02, 0.02, 0.02], first=3, random=True),
        "VibrationModes": cs.VibrationModes([0.015, 0.015, 0.015], first=6, random=True),
        "Fractal": cs.Fractal(0.03, hurst=0.5, longest=24, shortest=6),
        "FromSpectrum, Hurst 0.7": cs.FromSpectrum.self_affine(0.03, 0.7, longest=40, shortest=6, angle=0.3),
        "Randomised": cs.Randomised(cs.Paraboloid(0.1), scipy.stats.norm(1.0, 0.3)),
        "a design, part 1": first,
        "... part 2": second,
        "a sum": cs.Paraboloid(0.1) + cs.GaussianField(0.01, length=6),
    }


def main() -> int:
    return gallery.covered(gallery.skins(gallery.part(), models()))


if __name__ == "__main__":
    made = gallery.skins(gallery.part(), models())
    gallery.draw(sys.argv[1] if len(sys.argv) > 1 else "random.png", made, columns=4, tile=(400, 300))
