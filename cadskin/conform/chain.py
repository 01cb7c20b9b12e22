"""One conforming part in the making: the current deviations, and the moves that change them."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from cadskin.conform.requirements import Requirement, made_part, moved_part, value_of
from cadskin.conform.screening import Search, search_of, search_on
from cadskin.conform.streams import BlockFields, BlockSamplers
from cadskin.errors import ConformityError
from cadskin.skin.weld import weld

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cadskin._typing import Floats, Vectors
    from cadskin.conform.blocks import Blocks
    from cadskin.conform.clusters import Cluster
    from cadskin.conform.routes import BlockRoute, BlockRoutes
    from cadskin.shape import NominalModel
    from cadskin.spec import Specification
    from cadskin.verify.extraction import MadePart

__all__ = ["Chain", "Setup", "Tally"]

_SHRINKS = 60  # halvings of an angle or of a field before it is given up


@dataclass(frozen=True, eq=False)
class Setup:
    """What all samples share.

    Parameters
    ----------
    nominal : NominalModel
    spec : Specification
        Bound to the part.
    blocks : Blocks
    clusters : tuple of Cluster
    samplers : BlockSamplers
    routes : BlockRoutes
    mean : (n_c,) float or None
        Of a Gaussian model [mm]; None where the model is not known to be Gaussian.
    max_tries : int
        Fields of a block before the sampler is changed.
    joint_tries : int
        Attempts at a whole cluster before its blocks are drawn in turn.
    sweeps, slice_steps : int
        Length of the chains; slice sampling makes twice as many steps for every halving of its start.
    pattern : MadePart, optional
        The nominal part, whose geometry the made parts share.
    """

    nominal: NominalModel
    spec: Specification
    blocks: Blocks
    clusters: tuple[Cluster, ...]
    samplers: BlockSamplers
    routes: BlockRoutes
    mean: Floats | None
    max_tries: int = 200
    joint_tries: int = 20
    sweeps: int = 6
    slice_steps: int = 60
    pattern: MadePart | None = None

    def tests_per_attempt(self) -> int:
        """Return how many blocks and clusters are accepted or refused when all are drawn once."""
        own = sum(bool(items) for cluster in self.clusters for items in cluster.own.values())
        return own + sum(bool(cluster.coupled) for cluster in self.clusters)

    def only_route(self) -> BlockRoute | None:
        """Return the route of a part that is one block with nothing but bands on it."""
        if len(self.clusters) != 1 or len(self.blocks) != 1 or self.clusters[0].coupled:
            return None
        own = self.clusters[0].own[0]
        return self.routes.of(0, own) if own else None


@dataclass
class Tally:
    """What a sample cost, and which tolerances refused how often.

    Attributes
    ----------
    tried, refused : dict of str to int
        Tests of each tolerance, and how many failed.
    best : dict of str to float
        Smallest value that a refused tolerance had [mm].
    attempts, accepted : int
        Attempts at clusters by rejection, and how many were kept.
    samplers : set of str
        ``rejection``, ``hmc``, ``slice``, ``gibbs``, ``blocks in turn``, ``scaled``.
    """

    tried: dict[str, int] = field(default_factory=dict)
    refused: dict[str, int] = field(default_factory=dict)
    best: dict[str, float] = field(default_factory=dict)
    attempts: int = 0
    accepted: int = 0
    samplers: set[str] = field(default_factory=set)

    def note(self, item: Requirement, value: float, kept: bool) -> None:
        """Record a test."""
        name = item.tolerance.id
        self.tried[name] = self.tried.get(name, 0) + 1
        if not kept:
            self.refused[name] = self.refused.get(name, 0) + 1
            self.best[name] = min(value, self.best.get(name, np.inf))

    def add(self, route: BlockRoute, search: Search) -> None:
        """Record the tests of a search for a block, and what it found."""
        found = int(search.found is not None)
        self.attempts += search.tried
        self.accepted += found
        left = search.tried
        for item, refused, least in zip(route.items, search.refused, search.least, strict=True):
            name = item.tolerance.id
            self.tried[name] = self.tried.get(name, 0) + left
            if refused:
                self.refused[name] = self.refused.get(name, 0) + int(refused)
                self.best[name] = min(float(least) * item.limit, self.best.get(name, np.inf))
            left -= int(refused)


class Chain:
    """The deviations of one sample while it is drawn.

    Parameters
    ----------
    setup : Setup
    seed : SeedSequence
        Of the sample: everything that happens depends on it alone.
    first : (k, n_c) float, optional
        Its first fields, where they were drawn with those of other samples; see `first_fields`.
    search : Search, optional
        For the first field of a part that is one block, where it was made with those of other samples.
    """

    def __init__(
        self,
        setup: Setup,
        seed: np.random.SeedSequence,
        first: Floats | None = None,
        search: Search | None = None,
    ) -> None:
        self.setup = setup
        self._search = search
        self.deviation = np.zeros(setup.nominal.n_samples)
        self.fields = BlockFields(setup.samplers, seed, first)
        self.tally = Tally()
        self._angles: np.random.Generator | None = None
        self._part: MadePart | None = None
        self._displacement: Vectors | None = None
        self._welded = False
        self._targets: dict[int, float] = {}

    def block(self, block: int) -> Floats:
        """Return the deviations of a block (k,) [mm]."""
        return self.deviation[self.setup.blocks.rows[block]].copy()

    def put(self, block: int, values: Floats | float) -> None:
        """Set the deviations of a block (k,) [mm]."""
        self.deviation[self.setup.blocks.rows[block]] = values
        self._part = self._displacement = None

    def part(self) -> MadePart:
        """Return the made part of the current deviations; without slides unless it is being confirmed."""
        if self._part is None:
            nominal, like = self.setup.nominal, self.setup.pattern
            if self._welded:
                self._part = moved_part(nominal, self.displacement(), like=like)
            else:
                self._part = made_part(nominal, self.deviation, like=like)
        return self._part

    def displacement(self) -> Vectors:
        """Return how the vertices of the welded mesh move (n, 3) [mm]."""
        if self._displacement is None:
            self._displacement = weld(self.setup.nominal, self.deviation)
        return self._displacement

    @contextmanager
    def welded(self) -> Iterator[None]:
        """Evaluate the welded mesh inside of the block."""
        self._welded, self._part = True, None
        try:
            yield
        finally:
            self._welded, self._part = False, None

    def value(self, item: Requirement) -> float:
        """Return the value of a requirement [mm]."""
        return value_of(item, self.part(), self.setup.spec)

    def meets(self, item: Requirement) -> bool:
        """Tell whether a requirement is met, by the quick test where there is one."""
        if item.flat is not None and item.feature is not None:
            heights = self.deviation[item.feature.rows]
            lower, upper = item.flat.bounds(heights, item.limit)
            kept, value = upper <= item.limit, lower
        else:
            value = self.value(item)
            kept = value <= item.limit
        self.tally.note(item, value, kept)
        return kept

    def meets_all(self, items: Iterable[Requirement]) -> bool:
        """Tell whether all conditioned requirements among ``items`` are met; the first failure ends it."""
        return all(self.meets(item) for item in items if item.policy.method in ("conditioned", "reject"))

    def propose(self, block: int, own: tuple[Requirement, ...]) -> bool:
        """Put a fresh field on a block, fitted where that is asked for; tell whether it meets ``own``."""
        self.put(block, self.fields.fresh(block))
        return self.fitted(own) and self.meets_all(own)

    def searched(self, block: int, route: BlockRoute) -> Search:
        """Return the search for a field of a block that fits its bands, gone as far as the route goes."""
        search, self._search = self._search, None
        if search is None:
            begin = self.fields.candidates_of(block)
            search = search_of(route.block, self.fields.stream(block), begin)
            search_on([search], route.block, route.first_tries)
        if search.found is None and route.tries > search.tried:
            search_on([search], route.block, route.tries - search.tried)
        self.fields.note_candidates(block, search.next)
        return search

    def fitted(self, items: Iterable[Requirement]) -> bool:
        """Scale the features of targeted and scaled requirements; tell whether that worked."""
        return all(self.fit(item) for item in items if item.policy.method in ("target", "scale"))

    def fit(self, item: Requirement) -> bool:
        """Scale the toleranced features until the value is the wanted one."""
        if item.policy.method == "target":
            wanted = self.wanted(item)
        else:
            if self.value(item) <= item.limit:
                return True
            wanted = item.limit * (1 - 1e-9)
            self.tally.samplers.add("scaled")
        return self.scaled_to(item, wanted)

    def scaled_to(self, item: Requirement, wanted: float) -> bool:
        """Scale the toleranced features of ``item`` until its value is ``wanted`` to 1e-12 mm."""
        values = {block: self.block(block) for block in item.own}

        def at(factor: float) -> float:
            for block, field_ in values.items():
                self.put(block, factor * field_)
            return self.value(item) - wanted

        before, here = 1.0, at(1.0)
        if abs(here) <= 1e-12:
            return True
        factor, last = wanted / max(here + wanted, 1e-300), here
        for _ in range(_SHRINKS):
            here = at(factor)
            if abs(here) <= 1e-12 or abs(factor - before) <= 1e-15 * abs(factor):
                return abs(here) <= 1e-9 * wanted
            slope = (here - last) / (factor - before)
            before, last = factor, here
            step = here / slope if slope > 0 else here * factor / (here + wanted)
            factor = min(max(factor - step, 0.1 * factor), 10 * factor)
        return False

    def wanted(self, item: Requirement) -> float:
        """Return the target value of a requirement for this sample [mm]."""
        key = id(item)
        if key not in self._targets:
            self._targets[key] = item.policy.draw(self.fields.generator(1 + len(self._targets)))
        return self._targets[key]

    def shrink(self, blocks: Iterable[int], items: tuple[Requirement, ...], *, rigid: bool = False) -> int:
        """Halve the distance of blocks from the mean until the requirements are met; return how often.

        Parameters
        ----------
        blocks : iterable of int
        items : tuple of Requirement
        rigid : bool
            Keep the rigid motion of a block, which no tolerance without datums feels: the start of the chain
            is then a typical one in these directions.

        Returns
        -------
        int
            -1 where the requirements cannot be met so, or the mean is not known.
        """
        mean = self.setup.mean
        if mean is None:
            return -1
        rests = {}
        for block in blocks:
            middle = mean[self.setup.blocks.rows[block]]
            away = self.block(block) - middle
            kept = _rigid_part(self.setup, block, away) if rigid else np.zeros(len(away))
            rests[block] = (middle + kept, away - kept)
        for times in range(_SHRINKS):
            if self.meets_all(items):
                return times
            for block, (middle, rest) in rests.items():
                self.put(block, middle + 0.5 ** (times + 1) * rest)
        return _SHRINKS if self.meets_all(items) else -1

    def slice(self, block: int, items: tuple[Requirement, ...]) -> None:
        """Move a block by one step of elliptical slice sampling within its requirements.

        References
        ----------
        .. [1] I. Murray, R. P. Adams, D. J. C. MacKay, Elliptical slice sampling, AISTATS 2010,
           arXiv:1001.0175.
        """
        mean = self.setup.mean
        if mean is None:
            raise ConformityError("elliptical slice sampling needs a Gaussian model")
        middle = mean[self.setup.blocks.rows[block]]
        here = self.block(block) - middle
        there = self.fields.fresh(block) - middle
        if self._angles is None:
            self._angles = self.fields.generator(0)
        angle = 2 * np.pi * self._angles.random()
        low, high = angle - 2 * np.pi, angle
        for _ in range(_SHRINKS):
            self.put(block, middle + np.cos(angle) * here + np.sin(angle) * there)
            if self.meets_all(items):
                return
            low, high = (angle, high) if angle < 0 else (low, angle)
            angle = low + (high - low) * self._angles.random()
        self.put(block, middle + here)


def _rigid_part(setup: Setup, block: int, away: Floats) -> Floats:
    """Return the least-squares rigid motion in the deviations of a block (k,) [mm]."""
    rows = setup.blocks.rows[block]
    samples = setup.nominal.samples
    points = setup.nominal.surface.points[samples.vertex_ids[rows]]
    points = (points - points.mean(axis=0)) / max(setup.nominal.surface.diagonal, 1e-300)
    normals = samples.normals[rows]
    motions = np.concatenate([normals, np.cross(points, normals)], axis=1)
    return np.asarray(motions @ np.linalg.lstsq(motions, away, rcond=1e-9)[0])
