"""One geometrical tolerance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Any, Literal, TypeAlias, get_args

from cadskin.errors import SpecificationError
from cadskin.spec.characteristics import CHARACTERISTICS, Characteristic, CharacteristicName
from cadskin.spec.datums import DatumSystem
from cadskin.spec.indicators import INDICATOR_KINDS, Indicator
from cadskin.spec.modifiers import TOLERANCE_MODIFIERS
from cadskin.spec.selection import FeatureSelection
from cadskin.spec.zone import ToleranceZone

__all__ = ["Material", "Scope", "Tolerance"]

Scope: TypeAlias = Literal["feature", "pattern", "all_around", "all_over", "between", "general"]
Material: TypeAlias = Literal["RFS", "MMR", "LMR"]


@dataclass(frozen=True)
class Tolerance:
    """A geometrical tolerance on one or several features.

    Parameters
    ----------
    id : str
        Unique in its specification: ``#27`` from a STEP file, else ``flatness-1``.
    type : str
        AP242 leaf name: ``flatness``, ``surface_profile``, ...
    value : float or None
        [mm]; None where the file gives none (that is not 0.0; 0.0 is legal at maximum material).
    feature : FeatureSelection
        Empty for a general tolerance.
    scope : str
        ``feature``, ``pattern``, ``all_around``, ``all_over``, ``between`` or ``general``.
    datums : DatumSystem
    material : {"RFS", "MMR", "LMR"}
        Regardless of feature size, maximum or least material requirement.
    modifiers : tuple of str
        Further AP242 modifiers, without those of the material.
    zone : ToleranceZone
    indicators : tuple of Indicator
        Intersection plane, orientation plane, direction feature, collection plane; one of each at most.
    parent : str or None
        Id of the upper segment of a composite frame.
    name : str
        Name in the file.
    raw_value, raw_unit : float or None, str or None
        Number and unit as written.
    standard : str or None
        ``ISO`` or ``ASME`` where it is known.
    model : Mapping or None
        Choice of a deviation model, passed on as written.
    policy : str or None
        How simulated parts meet it: ``conditioned``, ``scale``, ``reject``, ``none``, ``target 0.02``;
        passed on as written (see `cadskin.conform.Conformity`).
    notes : tuple of str
        What had to be interpreted; not compared.
    source : str or None
        ``part.stp #27`` or ``part.spec.toml:12``; not compared.
    """

    id: str
    type: CharacteristicName
    value: float | None
    feature: FeatureSelection = field(default_factory=FeatureSelection)
    scope: Scope = "feature"
    datums: DatumSystem = field(default_factory=DatumSystem)
    material: Material = "RFS"
    modifiers: tuple[str, ...] = ()
    zone: ToleranceZone = field(default_factory=ToleranceZone)
    indicators: tuple[Indicator, ...] = ()
    parent: str | None = None
    name: str = ""
    raw_value: float | None = None
    raw_unit: str | None = None
    standard: str | None = None
    model: Mapping[str, Any] | None = field(default=None, hash=False)
    policy: str | None = None
    notes: tuple[str, ...] = field(default=(), compare=False)
    source: str | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        """Check names and value."""
        if self.type not in CHARACTERISTICS:
            raise SpecificationError(f"tolerance {self.id}: {self.type!r} is no AP242 characteristic")
        for key, kinds in (("scope", get_args(Scope)), ("material", get_args(Material))):
            if getattr(self, key) not in kinds:
                raise SpecificationError(
                    f"tolerance {self.id}: {key} {getattr(self, key)!r} is none of {', '.join(kinds)}"
                )
        if self.value is not None and not (isfinite(self.value) and self.value >= 0):
            raise SpecificationError(
                f"tolerance {self.id} ({self.type}): value must be finite and not negative, got {self.value}"
            )

        if len({indicator.kind for indicator in self.indicators}) < len(self.indicators):
            raise SpecificationError(f"tolerance {self.id} ({self.type}): an indicator is given twice")
        ordered = sorted(self.indicators, key=lambda indicator: INDICATOR_KINDS.index(indicator.kind))
        object.__setattr__(self, "indicators", tuple(ordered))
        self._couple_combined_zone()

    def indicator(self, kind: str) -> Indicator | None:
        """Return the indicator of a kind (``intersection_plane``, ...), if there is one."""
        return next((item for item in self.indicators if item.kind == kind), None)

    def _couple_combined_zone(self) -> None:
        """Keep the modifier CZ or SZ and the zone's ``combined`` in step: they say the same."""
        names = {"COMMON_ZONE": True, "SEPARATE_ZONE": False}
        stated = [names[word] for word in self.modifiers if word in names]
        if stated and self.zone.combined is None:
            object.__setattr__(self, "zone", replace(self.zone, combined=stated[0]))
        elif not stated and self.zone.combined is not None:
            word = "COMMON_ZONE" if self.zone.combined else "SEPARATE_ZONE"
            object.__setattr__(self, "modifiers", (*self.modifiers, word))
        elif stated and any(flag != self.zone.combined for flag in stated):
            raise SpecificationError(
                f"tolerance {self.id} ({self.type}): its zone is both common and separate"
            )

    @property
    def characteristic(self) -> Characteristic:
        """Facts about its characteristic."""
        return CHARACTERISTICS[self.type]

    @property
    def bounds(self) -> tuple[float, float] | None:
        """Lowest and highest deviation [mm] of the surface that its zone allows; None without value."""
        return None if self.value is None else self.zone.bounds(self.value)

    def __str__(self) -> str:
        from cadskin.spec.frames import frame

        return frame(self)

    @property
    def unknown_modifiers(self) -> tuple[str, ...]:
        """Modifiers that no list of AP242 modifiers has."""
        return tuple(name for name in self.modifiers if name not in TOLERANCE_MODIFIERS)
