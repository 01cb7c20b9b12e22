"""Natural vibration modes of a face taken as a thin plate or shell: a family of form defects.

References
----------
Samper, Formosa: Form defects tolerancing by natural modes analysis, J. Comput. Inf. Sci. Eng. 7 (2007),
doi:10.1115/1.2424247.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from cadskin.deviation._eigenpairs import lowest_modes
from cadskin.deviation._mode_sum import ModeSum
from cadskin.deviation._parameters import finite, positive
from cadskin.deviation._patches import PatchPoints
from cadskin.deviation._shell import plate_stiffness, shell_stiffness
from cadskin.deviation.base import MM
from cadskin.deviation.coordinates import area_frame
from cadskin.deviation.modal import upright
from cadskin.deviation.registry import register
from cadskin.errors import DeviationError
from cadskin.shape.operators import boundary_edges, lumped_mass

if TYPE_CHECKING:
    from scipy.sparse import csr_array

    from cadskin._typing import Floats, Ints

__all__ = ["VibrationModes", "plate_modes", "shell_modes"]

_UNKNOWNS = 200_000  # three per vertex of a plate, six of a shell
_NORMAL_SHARE = 1e-3  # of the kinetic energy: below it a mode moves the surface within itself and is no form
_ROTARY = 1e-8  # rotary inertia of a plate, times mass and area: that of a very thin one


@register
@dataclass(frozen=True, eq=False, repr=False)
class VibrationModes(ModeSum):
    """A sum of natural vibration modes of each smooth patch, as a thin plate (flat) or shell (curved).

    Each mode has mean square one over the area, so that an amplitude is a root mean square in mm. Free edges:
    the rigid motions come first (three on a plane: offset and two tilts; up to six on curved patches, where
    those that move the surface within itself are left out), then bending, twist, and so on.

    Parameters
    ----------
    amplitudes : sequence of float
        [mm], or shares of a tolerance; one per mode from ``first`` on.
    first : int
        Number of the first mode.
    random : bool
        True: the amplitudes are standard deviations of independent normal factors.
    edges : str
        ``free``, ``supported`` (no displacement) or ``fixed`` (clamped).
    thickness : float, optional
        Of the shell [mm]; by default a twentieth of the square root of the area. Plates do not need it.
    poisson : float
        Poisson's ratio.

    Notes
    -----
    Natural frequencies of square plates against their exact values: clamped 0.06 %, free 0.1 %, supported
    0.02 % at 40 elements per side, converging with the square of the element size. Eight modes
    of a plate of 27 000 vertices take 7 s and 0.7 GB, of a shell of 12 000 vertices 18 s and 1.4 GB; patches
    with more than 66 000 (plate) or 33 000 vertices (shell) are refused.

    Examples
    --------
    >>> VibrationModes([0.01, 0.005], first=3, random=True)
    VibrationModes(amplitudes=(0.01, 0.005) mm, first=3, random=True)
    """

    name: ClassVar[str] = "vibration"
    EDGES: ClassVar[tuple[str, ...]] = ("free", "supported", "fixed")
    thickness: float | None = field(default=None, metadata=MM)
    poisson: float = 0.3

    def __post_init__(self) -> None:
        """Check the parameters."""
        super().__post_init__()
        if self.thickness is not None:
            object.__setattr__(self, "thickness", positive(self.thickness, "thickness", "mm", self))
        object.__setattr__(self, "poisson", finite(self.poisson, "poisson", "", self))
        if not -1 < self.poisson <= 0.5:
            raise DeviationError(f"VibrationModes: poisson must be over -1 and up to 0.5: {self.poisson}")

    def modes(self, patch: PatchPoints, count: int) -> tuple[Floats, str]:
        """Find the modes of a plate or a shell."""
        return self._modes(patch, count), f"vibration modes {self.first} to {count - 1}"

    def _modes(self, patch: PatchPoints, count: int) -> Floats:
        if patch.flat:
            return plate_modes(patch, count, edges=self.edges, poisson=self.poisson)[1]
        thickness = 0.05 * np.sqrt(patch.area) if self.thickness is None else self.thickness
        return shell_modes(patch, count, edges=self.edges, thickness=thickness, poisson=self.poisson)[1]


def plate_modes(
    patch: PatchPoints, count: int, *, edges: str = "free", poisson: float = 0.3
) -> tuple[Floats, Floats]:
    """Return omega² rho h / D (count,) [1/mm⁴] and the deflections (count, n) of a flat patch.

    Raises
    ------
    DeviationError
        The mesh is too coarse for so many modes.
    """
    frame = area_frame(patch.points, patch.triangles, patch.normals[0])
    x, y = frame.axes[:2] @ (patch.points - frame.centroid).T
    mass = lumped_mass(patch.points, patch.triangles)
    rigid = np.stack([np.ones_like(x), x, y]) if edges == "free" else np.zeros((0, len(x)))
    inertia = np.repeat(mass, 3)
    inertia[np.arange(len(inertia)) % 3 > 0] *= _ROTARY * frame.area
    kept = _unknowns(patch, 3, 1, edges)
    stiffness = plate_stiffness(x, y, patch.triangles, poisson)
    values, vectors = _eigenpairs(stiffness, inertia, kept, count, len(rigid), frame.area)
    everything = np.concatenate([rigid, vectors[:, 0::3]])[:count]
    values = np.concatenate([np.zeros(len(rigid)), values])[:count]
    return values, _normalised(everything, mass)


def shell_modes(
    patch: PatchPoints, count: int, *, edges: str = "free", thickness: float, poisson: float = 0.3
) -> tuple[Floats, Floats]:
    """Return omega² rho h / D (count,) [1/mm⁴] and the normal displacements (count, n) of a curved patch.

    Raises
    ------
    DeviationError
        The mesh is too coarse for so many modes, or too many of them move the surface within itself.
    """
    mass = lumped_mass(patch.points, patch.triangles)
    inertia = np.repeat(mass, 6)
    inertia[np.arange(len(inertia)) % 6 > 2] *= thickness**2 / 12.0
    rigid = _rigid_fields(patch, mass) if edges == "free" else np.zeros((0, len(mass)))
    kept = _unknowns(patch, 6, 3, edges)
    stiffness = shell_stiffness(patch.points, patch.triangles, thickness, poisson)
    asked = max(count - len(rigid), 1)
    asked += asked // 2 + 4
    values, vectors = _eigenpairs(stiffness, inertia, kept, asked, 6 if edges == "free" else 0, patch.area)
    moved = vectors.reshape(len(vectors), -1, 6)[:, :, :3]
    normal = np.einsum("kij,ij->ki", moved, patch.normals)
    form = (normal**2 @ mass) > _NORMAL_SHARE * (vectors**2 @ inertia)
    everything = np.concatenate([rigid, normal[form]])[:count]
    if len(everything) < count:
        raise DeviationError(
            f"only {len(everything)} of {count} vibration modes move the surface along its normal; "
            "ask for fewer"
        )
    values = np.concatenate([np.zeros(len(rigid)), values[form]])[:count]
    return values, _normalised(everything, mass)


def _unknowns(patch: PatchPoints, per_vertex: int, displacements: int, edges: str) -> Ints:
    """Unknowns that the edges leave."""
    everything = np.arange(per_vertex * len(patch.points))
    if edges == "free":
        return everything
    border = np.unique(boundary_edges(patch.triangles))
    if not len(border):
        raise DeviationError(f"VibrationModes: a closed surface has no {edges} edges; use edges='free'")
    held = np.arange(displacements if edges == "supported" else per_vertex)
    return np.setdiff1d(everything, (per_vertex * border[:, None] + held).ravel())


def _eigenpairs(
    stiffness: csr_array, inertia: Floats, kept: Ints, count: int, rigid: int, area: float
) -> tuple[Floats, Floats]:
    """Lowest elastic eigenvalues (count,) and vectors (count, unknowns) with zeros where they are held."""
    if 3 * (count + rigid) > len(kept):
        raise DeviationError(f"{count} vibration modes on {len(kept)} unknowns: the mesh is too coarse")
    if len(kept) > _UNKNOWNS:
        raise DeviationError(
            f"VibrationModes: the patch has {len(kept)} unknowns, more than {_UNKNOWNS}; use a larger "
            "edge_length, or Modes (eigenfunctions of the Laplacian), which go further"
        )
    values, vectors = lowest_modes(stiffness, inertia, kept, count + rigid, shift=-1.0 / area**2)
    return values[rigid:], vectors[rigid:]


def _rigid_fields(patch: PatchPoints, mass: Floats) -> Floats:
    """Return the normal displacements (k, n) of the rigid motions that have one, orthogonal."""
    relative = patch.points - np.average(patch.points, axis=0, weights=mass)
    size = np.sqrt(mass.sum())
    fields = np.concatenate([patch.normals, np.cross(relative, patch.normals) / size], axis=1).T
    root = np.sqrt(mass)
    _, strength, rows = np.linalg.svd(fields * root, full_matrices=False)
    return np.asarray(rows[strength > 1e-3 * strength[0]] / root)


def _normalised(modes: Floats, mass: Floats) -> Floats:
    """Scale to mean square one over the area."""
    scale = np.sqrt((modes**2 @ mass) / mass.sum())
    return upright(modes / scale[:, None])
