"""A deviation model that fits a specification: standard deviations from the tolerances."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from cadskin.conform.blocks import independent_blocks
from cadskin.conform.bound import bound_part
from cadskin.conform.policy import policies_of
from cadskin.conform.requirements import made_part, requirements_of, value_of
from cadskin.conform.sizes import mean_offsets
from cadskin.deviation import GaussianField
from cadskin.errors import CadskinWarning, SpecificationError
from cadskin.skin.simulate import child_seed
from cadskin.spec.general import general_tolerance

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin._typing import Floats
    from cadskin.conform.blocks import Blocks
    from cadskin.conform.bound import BoundPart
    from cadskin.conform.requirements import Requirement
    from cadskin.deviation import Sampler
    from cadskin.shape import NominalModel
    from cadskin.spec import Specification
    from cadskin.verify.extraction import MadePart

__all__ = ["capable_model", "correlation_length"]

_SIGMAS = 8.0  # standard deviations per tolerance: a fixed zone ends at four of them
_PILOTS = 8
_ROUNDS = 3
_BEYOND = 3.0  # mean + 3 standard deviations of a value stay within the limit
_NOT_EVALUATED = 2.0  # excess of a tolerance that pilot parts are too bad to be evaluated for
_SEED = np.random.SeedSequence(20130501)  # of the pilot parts: the model depends on part and spec alone


def correlation_length(nominal: NominalModel) -> float:
    """Return the correlation length that a part gets by default: a fifth of its longest side [mm]."""
    return float(np.ptp(nominal.surface.points, axis=0).max()) / 5.0


def capable_model(
    nominal: NominalModel,
    spec: Specification | BoundPart,
    *,
    length: float | None = None,
    kernel: str = "squared_exponential",
    scale: float = 1.0,
) -> GaussianField:
    """Return the field of a process that suits a specification.

    Every smooth patch gets an eighth of its narrowest tolerance as its standard deviation; patches without
    any get an eighth of the general tolerance for the size of the part. Some pilot parts are then evaluated,
    and where the mean of a value and three of its standard deviations exceed the limit (a datum far away
    turns a feature by much) the patches behind it are made better. The result is a plausible process, not a
    calibrated one; see `cadskin.conform.capability_scale` for that.

    Parameters
    ----------
    nominal : NominalModel
    spec : Specification or BoundPart
    length : float, optional
        Correlation length [mm]; a fifth of the longest side by default.
    kernel : str
    scale : float
        All standard deviations are multiplied by it.

    Raises
    ------
    SpecificationError
        ``scale`` is not positive.

    Examples
    --------
    >>> import cadquery as cq, cadskin as cs
    >>> part = cs.nominal(cq.Workplane().box(20, 20, 4), edge_length=1.0)
    >>> capable_model(part, cs.Specification(cs.flatness(">Z", 0.04))).length
    4.0
    """
    if not (np.isfinite(scale) and scale > 0):
        raise SpecificationError(f"the scale of a process must be positive and finite, got {scale}")
    correlation = correlation_length(nominal) if length is None else length
    unit = GaussianField(1.0, correlation, kernel)
    blocks = independent_blocks(nominal, unit)
    part = bound_part(spec, nominal)
    bound, pattern = part.spec, part.pattern
    requirements, _ = requirements_of(
        nominal, bound, blocks, policies_of({"*": "conditioned"}, bound), like=pattern
    )
    sigma = _first_guess(nominal, blocks, requirements)
    with warnings.catch_warnings():  # the model itself will say it, with its own numbers
        warnings.simplefilter("ignore", CadskinWarning)
        sampler = unit.prepare(nominal)
    middle = mean_offsets(bound, nominal)
    excess = np.zeros(len(requirements))
    stale = list(range(len(requirements)))  # a value changes only where a block behind it does
    for _ in range(_ROUNDS):
        asked = [requirements[k] for k in stale]
        excess[stale] = _excess(pattern, bound, sampler, asked, _of_samples(blocks, sigma), middle)
        before = sigma.copy()
        for item, too_large in zip(requirements, excess, strict=True):
            for block in item.blocks if too_large > 1.0 else ():
                sigma[block] = min(sigma[block], _shrunk(sigma[block], too_large))
        changed = {int(block) for block in np.flatnonzero(sigma != before)}
        stale = [k for k, item in enumerate(requirements) if item.blocks & changed]
        if not stale:
            break
    return GaussianField(scale * _of_samples(blocks, sigma), correlation, kernel)


def _shrunk(sigma: float, excess: float) -> float:
    return float(sigma / min(excess, 1e3))


def _first_guess(nominal: NominalModel, blocks: Blocks, requirements: Sequence[Requirement]) -> Floats:
    """Return the standard deviation of every block: an eighth of its narrowest tolerance [mm]."""
    longest = float(np.ptp(nominal.surface.points, axis=0).max())
    width = np.full(len(blocks), np.inf)
    for item in requirements:
        for block in item.blocks:
            width[block] = min(width[block], item.limit)
    width[np.isinf(width)] = general_tolerance(longest)
    return np.asarray(width / _SIGMAS)


def _of_samples(blocks: Blocks, sigma: Floats) -> Floats:
    values = np.zeros(sum(len(rows) for rows in blocks.rows))
    for rows, one in zip(blocks.rows, sigma, strict=True):
        values[rows] = one
    return values


def _excess(
    pattern: MadePart,
    spec: Specification,
    unit: Sampler,
    requirements: Sequence[Requirement],
    sigma: Floats,
    middle: Floats,
) -> Floats:
    """Return (mean + 3 standard deviations) / limit of every requirement over pilot parts."""
    fields = middle + sigma * unit.draw([child_seed(_SEED, i) for i in range(_PILOTS)])
    values = np.array(
        [
            [value_of(item, part, spec) for item in requirements]
            for part in (made_part(pattern.nominal, field, like=pattern) for field in fields)
        ]
    ).reshape(_PILOTS, len(requirements))
    limits = np.array([item.limit for item in requirements])
    evaluated = np.isfinite(values).all(axis=0)
    finite = np.where(evaluated, values, 0.0)
    used = (finite.mean(axis=0) + _BEYOND * finite.std(axis=0)) / limits
    return np.where(evaluated, used, _NOT_EVALUATED)
