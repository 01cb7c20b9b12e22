"""20 Gallery: systematic deviations, each with about 0.1 mm from peak to valley.

Each model lies on a freeform face, a plane and a cylinder. `main` returns the number of models that do.
"""

from __future__ import annotations

import sys

import gallery

import cadskin as cs
from cadskin.shape import Cylinder, Plane, Sphere


def models() -> dict[str, cs.DeviationModel]:
    return {
        "SizeOffset": cs.SizeOffset(0.05),
        "Shift": cs.Shift((0.0, 0.03, 0.05)),
        "Tilt": cs.Tilt(2e-3, axis=(0.0, 1.0, 0.0)),
        "Torsor": cs.Torsor((0.0, 0.0, 0.02), (1e-3, 1e-3, 0.0)),
        "Taper": cs.Taper(0.1),
        "Bend": cs.Bend(0.1, direction=(0.0, 1.0, 2.0)),
        "Twist": cs.Twist(4e-3, axis=(1.0, 0.0, 0.0)),
        "Thermal": cs.Thermal(100.0),
        "Paraboloid": cs.Paraboloid(0.1),
        "Saddle": cs.Saddle(0.1),
        "Cone": cs.Cone(0.1),
        "Sphere": cs.Sphere(-0.1),
        "Cylinder": cs.Cylinder(0.1, rotation=0.5),
        "Ellipsoid": cs.Ellipsoid(0.1),
        "Quadric": cs.Quadric(2e-4, -1e-4, angle=0.4),
        "morph": cs.morph(cs.Cone(0.1), cs.Saddle(0.1), 0.5),
        "Towards a plane, cylinder, sphere": gallery.by_kind(
            plane=cs.Towards(Plane([20, 0, 10], [3e-3, 1e-3, 1])),
            cylinder=cs.Towards(Cylinder([20, 0, 0], [3e-3, 0, 1], 10.03)),
            freeform=cs.Towards(Sphere([-20, 0, -90], 105.0), share=0.015),
        ),
        "BasisForm Legendre": cs.BasisForm("legendre", {"3,0": 0.02, "1,2": 0.01}),
        "... Zernike": cs.BasisForm("zernike", {"2,0": 0.02, "3,3": 0.015}),
        "... Fourier, Chebyshev, cosines": gallery.by_kind(
            cylinder=cs.BasisForm("fourier_legendre", {"3,0": 0.02, "1,2": 0.02}),
            plane=cs.BasisForm("chebyshev", {"2,1": 0.03}),
            freeform=cs.BasisForm("dct", {"2,1": 0.03}),
        ),
    }


def main() -> int:
    return gallery.covered(gallery.skins(gallery.part(), models()))


if __name__ == "__main__":
    made = gallery.skins(gallery.part(), models())
    gallery.draw(sys.argv[1] if len(sys.argv) > 1 else "systematic.png", made, columns=5, tile=(400, 300))
