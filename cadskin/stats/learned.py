"""A statistical shape model as a deviation model, so that `simulate` makes new parts of a population."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cadskin.deviation import DeviationModel, Sampler
from cadskin.errors import DeviationError, StatisticsError
from cadskin.stats.model import Law, StatisticalShapeModel
from cadskin.stats.sampling import draw_coefficients

if TYPE_CHECKING:
    from cadskin._typing import Floats
    from cadskin.shape import Feature, NominalModel

__all__ = ["LearnedShape"]


@dataclass(frozen=True, eq=False, repr=False)
class LearnedShape(DeviationModel):
    """New parts of a learned population, see `StatisticalShapeModel.sample`.

    Parameters
    ----------
    model : StatisticalShapeModel
    law : {"gaussian", "student", "kde"}
    noise : bool
        Add the residual noise, white from sample to sample.
    """

    name: ClassVar[str] = "learned"
    model: StatisticalShapeModel
    law: Law = "gaussian"
    noise: bool = False

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Check that the model belongs to the part."""
        del features
        own = self.model.nominal
        if own is None or self.model.rows is None or own.n_samples != nominal.n_samples:
            raise StatisticsError(
                "the statistical shape model was not learned on this nominal model; fit it on this mesh"
            )
        return _LearnedSampler(self, nominal.n_samples)

    def parameters(self) -> dict[str, Any]:
        """Refuse: a learned model is kept in its own file (`StatisticalShapeModel.save`)."""
        raise DeviationError(
            "a learned shape model is not written to a specification; save it to a .npz file"
        )

    def __str__(self) -> str:
        return f"LearnedShape({self.model!r}, law={self.law!r}, noise={self.noise})"

    __repr__ = __str__


class _LearnedSampler(Sampler):
    def __init__(self, learned: LearnedShape, n_samples: int) -> None:
        self.learned = learned
        self.n_samples = n_samples
        self.notes = learned.model.notes

    def fill(self, seeds: Sequence[np.random.SeedSequence], out: Floats) -> None:
        """Draw coefficients and noise for each seed; samples outside of the model stay nominal."""
        model = self.learned.model
        out[: len(seeds)] = 0.0
        for target, seed in zip(out, seeds, strict=False):
            generator = np.random.default_rng(seed)
            c = draw_coefficients(model, generator, self.learned.law)
            field = model.fields(c)
            if self.learned.noise:
                field = field + model.noise * generator.standard_normal(len(field))
            target[model.rows] = field
