"""Skin models inside a profile zone: the law of a deviation model, given that every deviation lies in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cadskin._progress import report
from cadskin._random import seed_sequence
from cadskin.deviation import DeviationModel, WhiteNoise
from cadskin.errors import ConformityError, DeviationError, SpecificationError
from cadskin.shape.patches import smooth_patches
from cadskin.skin.faults import check_skin
from cadskin.skin.model import SkinModel
from cadskin.skin.provenance import provenance_of
from cadskin.skin.simulate import child_seed
from cadskin.skin.weld import prepare_weld

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Progress, RNGLike
    from cadskin.shape import NominalModel

__all__ = ["simulate_in_profile_zone"]

_BLOCK = 8  # fields drawn at once after the first; the result does not depend on it


def simulate_in_profile_zone(
    nominal: NominalModel,
    model: DeviationModel,
    tolerance: float,
    *,
    rng: RNGLike = None,
    max_tries: int = 1000,
    whole: bool = False,
    check: bool = True,
    progress: Progress | None = None,
) -> SkinModel:
    """Make one skin model whose deviations all lie in [-tolerance / 2, +tolerance / 2].

    The result follows the exact law of the model *given* that it lies in the zone: fields are drawn until
    each smooth patch (features joined by tangent edges) has seen one that fits, and the patch keeps the first
    of them. For models whose fields are independent between patches, as those of `GaussianField` and
    `WhiteNoise` are, that is rejection of whole fields, only faster. White noise is independent between
    points, so there each point is such a patch. Nothing is clipped or rescaled. Where the weld cannot follow
    every feature (four or more at a corner), what it realises must lie in the zone too, or the patches that
    meet there are drawn anew.

    Parameters
    ----------
    nominal : NominalModel
    model : DeviationModel
        With a standard deviation of an eighth of the tolerance the zone ends at four sigma and almost every
        field fits; at a sixth (three sigma) long correlation lengths still pass.
    tolerance : float
        Width of the profile zone [mm], half of it on each side of the nominal surface (ISO 1101, profile of a
        surface, without a datum: the zone is fixed to the nominal part).
    rng : int, SeedSequence, BitGenerator, Generator or None
        Try t of sample 0 uses the child stream (0, t) of the seed.
    max_tries : int
        Number of fields to draw at most.
    whole : bool
        Reject the field of the whole part at once: needed for models whose patches depend on each other.
    check : bool
        Look for inverted and intersecting triangles.
    progress : callable, optional
        Called with (patches done, patches).

    Returns
    -------
    SkinModel
        Its provenance holds the zone, the law and the number of tries.

    Raises
    ------
    ConformityError
        No field fitted on some patch in ``max_tries`` tries; the message names the feature.
    SpecificationError
        ``tolerance`` is not positive and finite.
    DeviationError
        ``model`` is no deviation model, or ``max_tries`` is not positive.
    GeometryError
        The skin model intersects itself.
    """
    if not (np.isfinite(tolerance) and tolerance > 0):
        raise SpecificationError(f"a tolerance must be positive and finite, got {tolerance} mm")
    if not isinstance(model, DeviationModel):
        raise DeviationError(f"the model must be a DeviationModel, got {type(model).__name__}")
    if max_tries < 1:
        raise DeviationError(f"max_tries must be at least 1, got {max_tries}")
    seed = seed_sequence(rng)
    blocks = _independent_blocks(nominal, model, whole=whole)
    deviation, tries = _rejected(
        nominal, model, 0.5 * tolerance, blocks, child_seed(seed, 0), max_tries, progress
    )
    law = "part" if whole else "point" if isinstance(model, WhiteNoise) else "smooth patch"
    provenance = provenance_of(
        nominal,
        str(model),
        seed,
        profile_zone=float(tolerance),
        law=f"rejection per {law}",
        tries=tries,
        index=0,
    )
    skin = SkinModel(nominal, deviation, provenance)
    if check:
        check_skin(nominal, deviation, skin.displacement)
    return skin


def _independent_blocks(nominal: NominalModel, model: DeviationModel, *, whole: bool) -> Ints:
    """Block of each sample (n_c,): samples in different blocks are independent under the model."""
    if whole:
        return np.zeros(nominal.n_samples, dtype=np.int64)
    patches = smooth_patches(nominal)
    if isinstance(model, WhiteNoise):
        return patches.node_of_sample
    return patches.patch_of_node[patches.node_of_sample]


def _rejected(
    nominal: NominalModel,
    model: DeviationModel,
    half_width: float,
    blocks: Ints,
    seed: np.random.SeedSequence,
    max_tries: int,
    progress: Progress | None,
) -> tuple[Floats, int]:
    """Return the deviation (n_c,) of the first fitting field of each block, and the number of tries."""
    sampler = model.prepare(nominal)
    clusters = _clusters(nominal, blocks)
    n_blocks = len(clusters)
    waiting = np.ones(n_blocks, dtype=bool)
    smallest_peak = np.full(n_blocks, np.inf)
    deviation = np.zeros(nominal.n_samples)
    done = 0
    report(progress, 0, n_blocks)
    while done < max_tries and waiting.any():
        numbers = range(done, min(done + (_BLOCK if done else 1), max_tries))
        for field in sampler.draw([child_seed(seed, t) for t in numbers]):
            done += 1
            peak = np.zeros(n_blocks)
            np.maximum.at(peak, blocks, np.abs(field))
            smallest_peak = np.minimum(smallest_peak, peak)
            taken = waiting & (peak <= half_width)
            chosen = taken[blocks]
            deviation[chosen] = field[chosen]
            waiting &= ~taken
            if not waiting.any():
                outside = _realised_outside(nominal, deviation, half_width)
                waiting = np.isin(clusters, clusters[blocks[outside]])
            if not waiting.any():
                break
        report(progress, int(n_blocks - waiting.sum()), n_blocks)
    if waiting.any():
        raise ConformityError(_message(nominal, model, half_width, blocks, waiting, smallest_peak, done))
    return deviation, done


def _realised_outside(nominal: NominalModel, deviation: Floats, half_width: float) -> Ints:
    """Find samples whose realised deviation leaves the zone, where the weld cannot follow all features."""
    operator = prepare_weld(nominal)
    realised = operator.realised(operator.displacement(deviation))
    return np.flatnonzero(np.abs(realised) > half_width * (1 + 1e-9))


def _clusters(nominal: NominalModel, blocks: Ints) -> Ints:
    """Cluster of each block: blocks that meet where the weld cannot follow them all are accepted together."""
    constraints = prepare_weld(nominal).constraints
    rows = np.flatnonzero(constraints.shared | constraints.overdetermined)
    n_blocks = int(blocks.max(initial=-1)) + 1
    vertices = nominal.samples.vertex_ids[rows]
    size = n_blocks + nominal.surface.n_points
    meet = coo_array((np.ones(len(rows)), (blocks[rows], n_blocks + vertices)), shape=(size, size))
    return np.asarray(connected_components(meet, directed=False)[1][:n_blocks], dtype=np.int64)


def _message(
    nominal: NominalModel,
    model: DeviationModel,
    half_width: float,
    blocks: Ints,
    waiting: np.ndarray,
    smallest_peak: Floats,
    tries: int,
) -> str:
    worst = int(np.argmax(np.where(waiting, smallest_peak, -np.inf)))
    row = int(np.flatnonzero(blocks == worst)[0])
    names = [feature.name for feature in nominal.features if waiting[blocks[feature.rows]].any()]
    first = next(feature.name for feature in nominal.features if feature.start <= row < feature.stop)
    return (
        f"none of {tries} fields of {model} lies within ±{half_width:.4g} mm on {len(names)} of "
        f"{len(nominal.features)} features; on {first} the best one reaches {smallest_peak[worst]:.4g} mm: "
        f"take a sigma of at most {half_width / 4:.4g} mm (an eighth of the tolerance), a longer correlation "
        f"length, a wider tolerance, or more tries"
    )
