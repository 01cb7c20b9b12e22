"""70 Learn from ten parts, then tell a whole face of the eleventh from six probed points.

The process bows the top of a plate and adds a smooth random form. Ten parts are "measured" on that face; mean
and principal modes are learned (Z(4) to Z(9) of Zhang et al. 2013). Of an eleventh part six points are probed
with 1 um uncertainty, and the model says the rest of the face, with a 95 % band.
`main` returns the remaining error over the error of the mean skin model alone.
"""

from __future__ import annotations

import cadquery as cq
import numpy as np

import cadskin as cs

PROBE = 0.001  # mm


def learn() -> tuple[cs.StatisticalShapeModel, np.ndarray]:
    part = cs.nominal(cq.Workplane().box(60, 40, 8), edge_length=3.0)
    process = (cs.Paraboloid(0.03) + cs.GaussianField(sigma=0.01, length=30)).on(">Z")
    made = cs.simulate_ensemble(part, process, size=11, rng=7)
    model = cs.StatisticalShapeModel.fit(made[:10], features=">Z", modes=5)
    return model, made[10].deviation[model.rows]


def main() -> float:
    model, eleventh = learn()
    rng = np.random.default_rng(1)
    probed = rng.choice(len(eleventh), 6, replace=False)
    found = model.posterior(probed, eleventh[probed] + PROBE * rng.standard_normal(6), noise=PROBE)
    return float(np.std(eleventh - found.mean) / np.std(eleventh - model.mean))


if __name__ == "__main__":
    model, _ = learn()
    print(model)
    print("sqrt of the variances, um:", (1000 * model.sigmas).round(2))
    print(f"six points leave {100 * main():.0f} % of the error of the mean alone")
    print("wrote", model.skin_model(model.instance({1: -2})).picture("b1_at_minus_two_sigma.png"))
