"""The drawing process of the cross-shaped part: its dimensions, what varies from part to part, and the mesh.

The part is a cross of two hat profiles that share their bottom plane. The bottom's outer face is z = 0, its
outward normal -z; the walls rise to the flanges at z = depth. Arms point along x and y. Lengths in mm, stress
in MPa.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm, qmc

PUNCH_HALF_LENGTH = 50.0  # from the middle of the cross to the inner side of a wall
ARM_HALF_WIDTH = 25.0


@dataclass(frozen=True)
class DrawingProcess:
    """What the paper varies (thickness to flange width) and the strength of the sheet.

    ``strength`` and the two constants after it are Swift's law: stress = K (e0 + plastic strain)^n.
    """

    thickness: float = 1.0
    depth: float = 18.0
    punch_radius: float = 4.0
    die_radius: float = 5.0
    flange_width: float = 12.0
    strength: float = 600.0
    initial_strain: float = 0.004
    hardening: float = 0.18
    young: float = 210e3
    poisson: float = 0.3
    pad_pressure: float = 2.0
    binder_gap: float = 1.05  # over the thickness
    clearance: float = 1.10  # between punch and die, over the thickness

    @property
    def blank_half_length(self) -> float:
        """Developed length of half an arm along the middle of the sheet [mm]."""
        punch, die = self.punch_radius + self.thickness / 2, self.die_radius + self.thickness / 2
        bends = (punch + die) * math.pi / 2
        wall = self.depth - punch - die
        return PUNCH_HALF_LENGTH - self.punch_radius + bends + wall + self.flange_width

    def flow_stress(self, strain: np.ndarray) -> np.ndarray:
        """Return Swift's flow stress at plastic strains [MPa]."""
        return np.asarray(self.strength * (self.initial_strain + strain) ** self.hardening)


VARIED = {  # standard deviations of what varies: tolerances of sheet and tools at about +-3 of these
    "thickness": 0.02,
    "depth": 0.15,
    "punch_radius": 0.20,
    "die_radius": 0.20,
    "flange_width": 0.30,
    "strength": 18.0,
}


@dataclass(frozen=True)
class FeMesh:
    """Sizes of the elements of the blank [mm]: through the thickness, along the bends, elsewhere."""

    layers: int = 2
    bend_length: float = 1.5
    flat_length: float = 3.0
    arm_length: float = 6.25
    arc_segments: int = 18
    largest_increment: float = 0.01  # of the depth; with 0.02 contact diverged


# Along the arms each is finer than the one before by 1.5.
COARSE = FeMesh(bend_length=2.25, flat_length=4.5)
MEDIUM = FeMesh()
FINE = FeMesh(bend_length=1.0, flat_length=2.0)
QUICK = FeMesh(bend_length=2.0, flat_length=5.5, arm_length=12.5, arc_segments=12)
MESHES = {"quick": QUICK, "coarse": COARSE, "medium": MEDIUM, "fine": FINE}
TRAINING_MESH = "quick"  # of the set that the study analyses

# A shallow part on few elements, drawn again by the tests: does the solver still give what it gave?
CHECK = FeMesh(
    layers=1, bend_length=2.25, flat_length=9, arm_length=12.5, arc_segments=8, largest_increment=0.016
)
CHECK_PROCESS = DrawingProcess(depth=12.0, flange_width=6.0)


def latin_hypercube(size: int = 10, *, rng: int = 11) -> list[DrawingProcess]:
    """Draw process parameters: independent normal variables on a Latin hypercube, as in the paper's ref. 32.

    Examples
    --------
    >>> from case_study.process import latin_hypercube
    >>> len({round(p.thickness, 6) for p in latin_hypercube(10)})
    10
    """
    nominal = DrawingProcess()
    scores = norm.ppf(qmc.LatinHypercube(len(VARIED), seed=rng).random(size))
    return [
        DrawingProcess(
            **{
                name: float(getattr(nominal, name) + VARIED[name] * z)
                for name, z in zip(VARIED, row, strict=True)
            }
        )
        for row in scores
    ]
