"""03 A STEP file becomes a part within its tolerance, a mesh and a picture.

Every face of the bracket gets a surface profile tolerance of 0.1 mm, that is 0.05 mm to either side, and a
correlated field that follows the law of the Gaussian field, given that it lies in that zone. `main` returns
the greatest deviation over half the tolerance: above 0, at most 1.

``python 03_step_to_skin.py picture.png`` draws the picture of the README.
"""

from __future__ import annotations

import sys
from pathlib import Path

import cadskin as cs

BRACKET = Path(__file__).resolve().parent / "parts" / "bracket.step"
TOLERANCE = 0.1  # mm


def make(edge_length: float) -> cs.SkinModel:
    part = cs.nominal(BRACKET, edge_length=edge_length)
    model = cs.GaussianField(sigma=TOLERANCE / 8, length=12)
    return cs.simulate_in_profile_zone(part, model, TOLERANCE, rng=7)


def main() -> float:
    skin = make(edge_length=1.5)
    assert skin.closed
    return float(abs(skin.deviation).max() / (TOLERANCE / 2))


if __name__ == "__main__":
    picture = Path(sys.argv[1] if len(sys.argv) > 1 else "bracket_skin.png")
    skin = make(edge_length=0.8)
    print(f"{skin.surface.n_triangles} triangles, {skin.surface.volume:.1f} mm³")
    print("wrote", skin.picture(picture))
    if len(sys.argv) == 1:
        print("wrote", skin.save("bracket_skin.stl"))
