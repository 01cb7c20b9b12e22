"""What a deviation model is: one number per feature sample, composed by ``+``, ``*`` and ``.on(...)``."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cadskin.deviation._parameters import positive
from cadskin.deviation._plain import plain, same, text
from cadskin.deviation._shares import with_tolerance

if TYPE_CHECKING:
    from cadskin._typing import Floats, RNGLike
    from cadskin.deviation.samplers import Sampler
    from cadskin.shape import Feature, FeatureRef, NominalModel

__all__ = ["MM", "RAD", "DeviationModel"]

MM = {"unit": "mm"}  # metadata of a dataclass field: the unit in the text form
RAD = {"unit": "rad"}


class DeviationModel(ABC):
    """One formula for the deviation of a surface along its nominal normal [mm], + = material added.

    Subclasses are frozen dataclasses; they override `prepare`. ``a + b`` is the sum with independent random
    streams, ``2 * a`` scales, ``a.on(">Z")`` is zero outside of the selected features.

    Attributes
    ----------
    name : str
        Name in specification files and in the registry.
    """

    name: ClassVar[str] = ""

    @abstractmethod
    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Return the sampler for ``nominal``: all set-up work is done here, once.

        Parameters
        ----------
        nominal : NominalModel
        features : sequence of Feature, optional
            The features that matter; values on the others are not used. None for all.
        """

    def sample(self, nominal: NominalModel, *, size: int = 1, rng: RNGLike = None) -> Floats:
        """Return random deviation fields.

        Parameters
        ----------
        nominal : NominalModel
        size : int
            Number of fields.
        rng : int, SeedSequence, BitGenerator, Generator or None
            Field i depends on the child stream i of the seed only: the first fields of a larger ``size`` are
            the same.

        Returns
        -------
        (size, n_c) float
            Deviation along the nominal normal at each feature sample [mm].
        """
        return self.prepare(nominal).sample(size=size, rng=rng)

    def on(self, ref: FeatureRef | None = None, /, **filters: Any) -> DeviationModel:
        """Return this model on the features selected by `NominalModel.select`, zero elsewhere.

        Parameters
        ----------
        ref, **filters
            As for `NominalModel.select`; a selection that matches nothing raises `SelectionError` when the
            model meets a part.
        """
        from cadskin.deviation.algebra import RestrictedModel

        return RestrictedModel(self, ref, dict(filters))

    def resolved(self, *, tolerance: float) -> DeviationModel:
        """Return a copy in which shares of a tolerance have become numbers.

        ``sigma`` and ``amplitude`` can be given as ``"from tolerance"`` (an eighth and a half of the zone)
        or as ``"0.2 of tolerance"``.

        Parameters
        ----------
        tolerance : float
            Width of the tolerance zone [mm], > 0.

        Examples
        --------
        >>> from cadskin.deviation import GaussianField
        >>> GaussianField("from tolerance", length=12).resolved(tolerance=0.2)
        GaussianField(sigma=0.025 mm, length=12 mm)
        """
        return with_tolerance(self, positive(tolerance, "tolerance", "mm", self))

    def parameters(self) -> dict[str, Any]:
        """Return the parameters that differ from their defaults, for the specification file."""
        found = {}
        for item in fields(self):  # type: ignore[arg-type]
            value = getattr(self, item.name)
            default = item.default_factory() if callable(item.default_factory) else item.default
            if not same(value, default):
                found[item.name] = plain(value)
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return ``{name: parameters}``; `from_dict` makes the same model again."""
        return {self.name: self.parameters()}

    def __add__(self, other: DeviationModel) -> DeviationModel:
        if not isinstance(other, DeviationModel):
            return NotImplemented
        from cadskin.deviation.algebra import added

        return added(self, other)

    def __mul__(self, factor: float) -> DeviationModel:
        if not isinstance(factor, (int, float, np.number)):
            return NotImplemented
        from cadskin.deviation.algebra import ScaledModel

        return ScaledModel(float(factor), self)

    __rmul__ = __mul__

    def __neg__(self) -> DeviationModel:
        return self * -1.0

    def __sub__(self, other: DeviationModel) -> DeviationModel:
        if not isinstance(other, DeviationModel):
            return NotImplemented
        return self + (-other)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(same(getattr(self, f.name), getattr(other, f.name)) for f in fields(self))  # type: ignore[arg-type]

    def __hash__(self) -> int:
        return hash((type(self), str(self)))

    def __str__(self) -> str:
        units = {f.name: f.metadata.get("unit", "") for f in fields(self)}  # type: ignore[arg-type]
        inside = ", ".join(f"{key}={text(getattr(self, key), units[key])}" for key in self.parameters())
        return f"{type(self).__name__}({inside})"

    __repr__ = __str__
