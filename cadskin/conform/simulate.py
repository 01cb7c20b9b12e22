"""Simulate parts that meet their specification."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._progress import report
from cadskin._random import seed_sequence
from cadskin.conform.blocks import gaussian_mean, independent_blocks
from cadskin.conform.bound import bound_part
from cadskin.conform.chain import Chain, Setup, Tally
from cadskin.conform.clusters import clusters_of
from cadskin.conform.confirmation import is_flat_enough
from cadskin.conform.policy import policies_of
from cadskin.conform.record import conformity_record
from cadskin.conform.rejection import draw_cluster
from cadskin.conform.requirements import requirements_of
from cadskin.conform.routes import BlockRoutes
from cadskin.conform.screening import search_of, search_on
from cadskin.conform.streams import FIRST_SAMPLES, SEARCHED_SAMPLES, BlockSamplers, first_fields
from cadskin.conform.targets import on_target
from cadskin.deviation import DeviationModel
from cadskin.deviation._philox import stream_of
from cadskin.errors import ConformityError, DeviationError, GeometryError
from cadskin.skin.faults import check_skin
from cadskin.skin.model import SkinEnsemble
from cadskin.skin.provenance import provenance_of
from cadskin.skin.simulate import child_seed

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cadskin._typing import Floats, Progress, RNGLike, Vectors
    from cadskin.conform.bound import BoundPart
    from cadskin.conform.clusters import Cluster
    from cadskin.conform.policy import Policies
    from cadskin.conform.requirements import Requirement, Unsupported
    from cadskin.conform.routes import BlockRoute
    from cadskin.conform.screening import Search
    from cadskin.shape import NominalModel
    from cadskin.spec import Specification

__all__ = ["ConformingSampler", "Made", "prepare_conforming", "simulate_conforming"]

_ROUNDS = 20  # of drawing again what the welded mesh does not confirm, or what is no solid
_AGAIN = 2**31 - 1  # stream of the parts that replace those that pass through themselves


@dataclass(frozen=True, eq=False)
class Made:
    """One conforming part.

    Parameters
    ----------
    deviation : (n_c,) float
        [mm].
    displacement : (n, 3) float
        Of the vertices of the welded mesh [mm].
    values : dict of str to float
        Value of every tolerance on the welded mesh [mm]; of some, where they were not asked for.
    tally : Tally
    """

    deviation: Floats
    displacement: Vectors
    values: dict[str, float]
    tally: Tally


@dataclass(frozen=True, eq=False)
class ConformingSampler:
    """A nominal model, a deviation model and a specification made ready: each further sample is cheap.

    Parameters
    ----------
    nominal : NominalModel
    model : DeviationModel
    spec : Specification
        Bound to the part, with the general tolerance on its features.
    requirements : tuple of Requirement
    unsupported : tuple of Unsupported
        Tolerances that play no part, and why.
    """

    nominal: NominalModel
    model: DeviationModel
    spec: Specification
    requirements: tuple[Requirement, ...]
    unsupported: tuple[Unsupported, ...]
    setup: Setup
    policies: dict[str, Any]

    def draw_all(self, seeds: Sequence[np.random.SeedSequence], *, values: bool = True) -> Iterator[Made]:
        """Yield the part of every seed, as `draw` does; the first fields of several are drawn together."""
        route = self.setup.only_route()
        if route is not None:
            yield from self._searched_together(seeds, route, values=values)
            return
        for start in range(0, len(seeds), FIRST_SAMPLES):
            group = seeds[start : start + FIRST_SAMPLES]
            firsts = first_fields(self.setup.samplers, group)
            for seed, first in zip(group, firsts, strict=True):
                yield self.draw(seed, first=first, values=values)

    def _searched_together(
        self, seeds: Sequence[np.random.SeedSequence], route: BlockRoute, *, values: bool
    ) -> Iterator[Made]:
        """Yield the parts of one block; their first candidates are screened together."""
        for start in range(0, len(seeds), SEARCHED_SAMPLES):
            group = seeds[start : start + SEARCHED_SAMPLES]
            searches = [search_of(route.block, stream_of(seed, 0)) for seed in group]
            search_on(searches, route.block, route.first_tries)
            for seed, search in zip(group, searches, strict=True):
                yield self.draw(seed, search=search, values=values)

    def sound(self, made: Made, seed: np.random.SeedSequence, label: str, *, values: bool = True) -> Made:
        """Return a part that does not pass through itself: the given one, or one that is drawn in its place.

        Tolerances do not exclude that two faces pass each other where a wall or a step is thinner than
        their zones; such a part cannot be made, so the law is also conditioned on its being a solid.

        Parameters
        ----------
        made : Made
        seed : SeedSequence
            Of the part.
        label : str
            What messages call it.
        values : bool
            As for `draw`.

        Raises
        ------
        GeometryError
            None of several parts is sound; the message says where they pass through themselves.
        """
        again = child_seed(seed, _AGAIN)
        for attempt in range(_ROUNDS):
            try:
                check_skin(self.nominal, made.deviation, made.displacement, label=label)
            except GeometryError:
                other = self.draw(child_seed(again, attempt), values=values)
                if attempt == _ROUNDS - 1 or np.array_equal(other.deviation, made.deviation):
                    raise
                made = other
                made.tally.samplers.add("solids only")
            else:
                break
        return made

    def draw(
        self,
        seed: np.random.SeedSequence,
        *,
        first: Floats | None = None,
        search: Search | None = None,
        values: bool = True,
    ) -> Made:
        """Return the part of a seed.

        Parameters
        ----------
        seed : SeedSequence
        first : (k, n_c) float, optional
            Of `first_fields`; it changes nothing but the speed.
        search : Search, optional
            Begun already, with those of other samples; it changes nothing but the speed.
        values : bool
            False leaves the values out that nothing depends on; it changes nothing else.

        Raises
        ------
        ConformityError
            No part that meets the tolerances was found; the message names the tolerance that binds.
        """
        made = None if self.setup.only_route() is not None else self._at_first(seed, first)
        if made is not None:
            return made
        chain = Chain(self.setup, seed, first, search)
        pending: tuple[Cluster, ...] = self.setup.clusters
        for _ in range(_ROUNDS):
            for cluster in pending:
                draw_cluster(chain, cluster)
            failed, found = self._confirmed(chain, values=values)
            pending = tuple(
                cluster
                for cluster in self.setup.clusters
                if any(item.blocks <= set(cluster.blocks) for item in failed)
            )
            if not pending:
                return Made(chain.deviation, chain.displacement(), found, chain.tally)
        worst = max(failed, key=lambda item: found[item.tolerance.id] / item.limit)
        if worst.policy.method == "target":
            raise ConformityError(
                f"{worst.label}: its target of {chain.wanted(worst):.6g} mm cannot be met together with "
                f"those of other tolerances (it is at {found[worst.tolerance.id]:.6g} mm); "
                "give targets that nest"
            )
        raise ConformityError(
            f"{worst.label}: {_ROUNDS} samples met it to first order, but not on the welded mesh "
            f"({found[worst.tolerance.id]:.6g} mm); take a smaller sigma or a finer mesh"
        )

    def _at_first(self, seed: np.random.SeedSequence, first: Floats | None) -> Made | None:
        """Return the part of the first fields where all of it conforms, as rejection would find it too.

        Its values are needed in the end; where most parts conform, nothing has to be evaluated twice.
        """
        if any(item.policy.method in ("target", "scale") for item in self.requirements):
            return None
        if self.setup.joint_tries < 1 or any(item.policy.sampler != "auto" for item in self.requirements):
            return None
        chain, values = Chain(self.setup, seed, first), dict[str, float]()
        for block in range(len(self.setup.blocks)):
            chain.put(block, chain.fields.fresh(block))
        quick = [item for item in self.requirements if item.flat is not None and item.policy.method != "none"]
        if not chain.meets_all(quick):
            return None
        with chain.welded():
            for item in self.requirements:
                value, name = chain.value(item), item.tolerance.id
                values[name] = max(value, values.get(name, -np.inf))
                if item.policy.method != "none":
                    chain.tally.note(item, value, value <= item.limit)
                    if value > item.limit:
                        return None
        chain.tally.attempts = chain.tally.accepted = self.setup.tests_per_attempt()
        chain.tally.samplers.add("rejection")
        return Made(chain.deviation, chain.displacement(), values, chain.tally)

    def _confirmed(self, chain: Chain, *, values: bool = True) -> tuple[list[Requirement], dict[str, float]]:
        """Evaluate the welded mesh; return what it does not meet, and all values that were needed."""
        targets = [item for item in self.requirements if item.policy.method == "target"]
        failed, found = [], dict[str, float]()
        with chain.welded():  # its slides change a value in the second order
            missed = on_target(chain, targets)
            for item in self.requirements:
                bounded = item.policy.method in ("conditioned", "reject", "scale")
                proven = bounded and is_flat_enough(item, self.nominal, chain.displacement())
                if not values and (proven or item.policy.method == "none"):
                    continue
                value, name = chain.value(item), item.tolerance.id
                found[name] = max(value, found.get(name, -np.inf))
                if item in missed:
                    failed.append(item)
                if bounded and not proven and value > item.limit:
                    failed.append(item)
        return failed, found


def prepare_conforming(
    nominal: NominalModel,
    model: DeviationModel,
    spec: Specification | BoundPart,
    *,
    conform: Policies = "conditioned",
    max_tries: int = 200,
    joint_tries: int = 20,
    sweeps: int = 6,
    slice_steps: int = 60,
    whole: bool = False,
) -> ConformingSampler:
    """Return the sampler of parts that meet a specification; see `simulate_conforming`.

    Parameters
    ----------
    nominal, model, spec, conform, max_tries
        As for `simulate_conforming`.
    joint_tries : int
        Attempts at all blocks that tolerances couple, before they are drawn in turn, each given the others.
    sweeps : int
        How often they are drawn in turn.
    slice_steps : int
        Steps of elliptical slice sampling where ``max_tries`` fields did not do.
    whole : bool
        The whole part is one block, whatever the model.
    """
    if not isinstance(model, DeviationModel):
        raise DeviationError(f"the model must be a DeviationModel, got {type(model).__name__}")
    if max_tries < 1 or min(joint_tries, sweeps, slice_steps) < 0:
        raise DeviationError(
            f"max_tries must be at least 1, and the other counts 0, got {max_tries}, {joint_tries}, {sweeps} "
            f"and {slice_steps}"
        )
    part = bound_part(spec, nominal)
    bound, pattern = part.spec, part.pattern
    policies = policies_of(conform, bound)
    blocks = independent_blocks(nominal, model, whole=whole)
    requirements, unsupported = requirements_of(nominal, bound, blocks, policies, like=pattern)
    samplers = BlockSamplers(nominal, model, blocks)
    mean = gaussian_mean(model, nominal)
    setup = Setup(
        nominal=nominal,
        spec=bound,
        blocks=blocks,
        clusters=clusters_of(len(blocks), requirements),
        samplers=samplers,
        routes=BlockRoutes(samplers, max_tries, gaussian=mean is not None),
        mean=mean,
        max_tries=max_tries,
        joint_tries=joint_tries,
        sweeps=sweeps,
        slice_steps=slice_steps,
        pattern=pattern,
    )
    return ConformingSampler(nominal, model, bound, requirements, unsupported, setup, policies)


def simulate_conforming(
    nominal: NominalModel,
    model: DeviationModel,
    spec: Specification | BoundPart,
    *,
    size: int = 1,
    rng: RNGLike = None,
    conform: Policies = "conditioned",
    max_tries: int = 200,
    check: bool = True,
    progress: Progress | None = None,
) -> SkinEnsemble:
    """Make a population of parts that meet their tolerances.

    By default each part follows the exact law of the model *given* that every tolerance is met, as a lot
    does that was inspected. What depends on one feature alone (form) is conditioned by rejection on that
    feature; tolerances with datums couple their features, datums first. Every part is evaluated on its
    welded mesh before it is given out. Sample i depends on the seed and on i alone.

    Parameters
    ----------
    nominal : NominalModel
    model : DeviationModel
    spec : Specification or BoundPart
        Selectors are bound to the part; a general tolerance (``default``) counts on every feature without
        one of its own.
    size : int
    rng : int, SeedSequence, BitGenerator, Generator or None
    conform : str, Conformity, or mapping of tolerance id to either
        See `cadskin.conform.Conformity`.
    max_tries : int
        Fields that a feature may cost before the sampler is changed; with elliptical slice sampling the
        work stays bounded at any acceptance. Five times as many candidates where they are screened first.
    check : bool
        Look for inverted and intersecting triangles; a part that has some is drawn anew.
    progress : callable, optional
        Called with (done, total).

    Returns
    -------
    SkinEnsemble
        ``provenance.options`` holds the policies, the samplers used, the acceptance, and the tolerances that
        are not supported.

    Raises
    ------
    ConformityError
        No part that meets the tolerances was found; the message names the tolerance that binds.
    SpecificationError
        The specification has no meaning on this part.
    GeometryError
        All skin models intersect themselves.

    Examples
    --------
    >>> import cadquery as cq, cadskin as cs
    >>> part = cs.nominal(cq.Workplane().box(20, 20, 4), edge_length=2.0)
    >>> spec = cs.Specification(cs.flatness(">Z", 0.03))
    >>> lot = simulate_conforming(part, cs.GaussianField(0.01, 8), spec, size=3, rng=7)
    >>> from cadskin.verify import verify
    >>> bool(verify(lot, spec).conforming.all())
    True
    """
    if size < 0:
        raise DeviationError(f"size must be zero or more, got {size}")
    ready = prepare_conforming(nominal, model, spec, conform=conform, max_tries=max_tries)
    seed = seed_sequence(rng)
    deviations = np.zeros((size, nominal.n_samples))
    tallies = []
    report(progress, 0, size)
    seeds = [child_seed(seed, i) for i in range(size)]
    for i, drawn in enumerate(ready.draw_all(seeds, values=False)):
        label = f"sample {i}" if size > 1 else "the skin model"
        made = ready.sound(drawn, seeds[i], label, values=False) if check else drawn
        deviations[i] = made.deviation
        tallies.append(made.tally)
        report(progress, i + 1, size)
    deviations.flags.writeable = False
    provenance = provenance_of(nominal, str(model), seed, check=check, **conformity_record(ready, tallies))
    return SkinEnsemble(nominal, deviations, provenance)
