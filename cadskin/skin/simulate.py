"""Draw skin model shapes: a nominal model, a deviation model and a seed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._arrays import frozen
from cadskin._progress import report
from cadskin._random import seed_sequence
from cadskin.deviation import DeviationModel
from cadskin.deviation.samplers import BLOCK
from cadskin.errors import DeviationError
from cadskin.skin.faults import check_skin
from cadskin.skin.model import SkinEnsemble, SkinModel
from cadskin.skin.provenance import provenance_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import ArrayLike

    from cadskin._typing import Floats, Progress, RNGLike
    from cadskin.conform.policy import Policies
    from cadskin.shape import NominalModel
    from cadskin.spec import Specification

__all__ = ["child_seed", "simulate", "simulate_ensemble"]


def simulate(
    nominal: NominalModel,
    model: DeviationModel | ArrayLike,
    *,
    spec: Specification | None = None,
    conform: Policies = "conditioned",
    rng: RNGLike = None,
    check: bool = True,
    progress: Progress | None = None,
) -> SkinModel:
    """Make one skin model shape, on request one that meets its tolerances.

    Parameters
    ----------
    nominal : NominalModel
    model : DeviationModel or (n_c,) array_like of float
        A deviation model, or the deviations themselves [mm].
    spec : Specification, optional
        Tolerances that the part shall meet: it follows the law of the model given that they are met, and is
        verified on its welded mesh; see `cadskin.conform.simulate_conforming`.
    conform : str, Conformity, or mapping of tolerance id to either
        How they are met: ``conditioned``, ``cadskin.conform.target(0.02)``, ``scale``, ``reject``, ``none``.
    rng : int, SeedSequence, BitGenerator, Generator or None
        The skin model is sample 0 of the ensemble of this seed.
    check : bool
        Look for inverted and intersecting triangles.
    progress : callable, optional
        Called with (done, total).

    Returns
    -------
    SkinModel

    Raises
    ------
    GeometryError
        The skin model intersects itself; the message says where. Or an array of the wrong length.
    DeviationError
        ``model`` is neither a deviation model nor numbers.
    ConformityError
        No part that meets ``spec`` was found; the message names the tolerance that binds.

    Examples
    --------
    >>> import cadquery as cq, cadskin as cs
    >>> part = cs.nominal(cq.Workplane().box(6, 4, 2), edge_length=1.0)
    >>> skin = cs.simulate(part, cs.WhiteNoise(sigma=0.01), rng=7)
    >>> skin.closed, len(skin.deviation) == part.n_samples
    (True, True)
    """
    return simulate_ensemble(
        nominal, model, size=1, spec=spec, conform=conform, rng=rng, check=check, progress=progress
    )[0]


def simulate_ensemble(
    nominal: NominalModel,
    model: DeviationModel | ArrayLike,
    *,
    size: int,
    spec: Specification | None = None,
    conform: Policies = "conditioned",
    rng: RNGLike = None,
    check: bool = True,
    progress: Progress | None = None,
) -> SkinEnsemble:
    """Make a population of skin model shapes.

    Sample i depends on the seed and on i alone, not on ``size``.

    Parameters
    ----------
    nominal : NominalModel
    model : DeviationModel or (n_c,) array_like of float
        An array gives ``size`` equal skin models.
    size : int
        Number of skin models.
    spec, conform, rng, check, progress
        As for `simulate`.

    Raises
    ------
    GeometryError
        A skin model intersects itself; the message says which one and where.
    DeviationError
        ``model`` is neither a deviation model nor numbers, or ``size`` is negative.
    ConformityError
        No part that meets ``spec`` was found.
    """
    if spec is not None:
        from cadskin.conform import simulate_conforming  # delegates upwards (DESIGN.md, decision 13)

        return simulate_conforming(
            nominal,
            model,  # type: ignore[arg-type]  # anything but a model is refused there
            spec,
            size=size,
            rng=rng,
            conform=conform,
            check=check,
            progress=progress,
        )
    if size < 0:
        raise DeviationError(f"size must be zero or more, got {size}")
    report(progress, 0, size)
    seed = seed_sequence(rng)
    deviations = np.zeros((size, nominal.n_samples))
    for start, stop in _drawn(nominal, model, seed, deviations):
        for i in range(start, stop) if check else ():
            check_skin(nominal, deviations[i], label=f"sample {i}" if size > 1 else "the skin model")
            report(progress, i + 1, size)
        if not check:
            report(progress, stop, size)
    deviations.flags.writeable = False
    random = isinstance(model, DeviationModel)
    text = str(model) if random else "array"
    provenance = provenance_of(nominal, text, seed if random else None, check=check)
    return SkinEnsemble(nominal, deviations, provenance)


def _drawn(
    nominal: NominalModel, model: Any, seed: np.random.SeedSequence, out: Floats
) -> Iterator[tuple[int, int]]:
    """Write the deviations (size, n_c) block by block; yield the first and the last sample of each."""
    size = len(out)
    if isinstance(model, DeviationModel):
        sampler = model.prepare(nominal)
        for start in range(0, size, BLOCK):
            stop = min(start + BLOCK, size)
            sampler.fill([child_seed(seed, i) for i in range(start, stop)], out[start:stop])
            yield start, stop
        return
    try:
        values = np.asarray(model, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise DeviationError(
            f"the model must be a DeviationModel or {nominal.n_samples} numbers, got {type(model).__name__}"
        ) from error
    field = frozen(values, shape=(nominal.n_samples,), name="deviation")
    for i in range(size):
        out[i] = field
        yield i, i + 1


def child_seed(seed: np.random.SeedSequence, index: int) -> np.random.SeedSequence:
    """Return child ``index`` of a seed sequence, without spawning (see `cadskin._random.child`)."""
    return np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, index), pool_size=seed.pool_size)
