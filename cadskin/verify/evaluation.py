"""The result of an evaluation: value, verdict, zone, active points and how they were found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from cadskin.shape.association import Association, Minimax

__all__ = ["Evaluation", "active_of", "plain"]


@dataclass(frozen=True, eq=False)
class Evaluation:
    """The evaluated value of one characteristic.

    Parameters
    ----------
    characteristic : str
        ``flatness``, ``position``, ...
    value : float
        The evaluated value [mm]; a diameter where the zone is round.
    quantity : str
        Which value it is, for example ``FLTt (MZPL)``.
    certified : bool
        Whether every association behind it is proved optimal to rounding (see `Certificate`).
    n_points : int
        Points of the toleranced feature: the value is that of the points, not of the surface between them.
    limit : float, optional
        The tolerance [mm].
    zone : Mapping
        Geometry of the tolerance zone, plain data.
    active : tuple of int
        Points that carry the value.
    operations : tuple of str
        The chain of ISO 17450 operations that was applied.
    details : Mapping
        Further quantities by name; None where one does not exist.
    notes : tuple of str
    verdict : bool, optional
        Set where the decision is not ``value <= limit`` (a material requirement).
    """

    characteristic: str
    value: float
    quantity: str
    certified: bool
    n_points: int
    limit: float | None = None
    zone: Mapping[str, Any] = field(default_factory=dict)
    active: tuple[int, ...] = ()
    operations: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    verdict: bool | None = None

    def __post_init__(self) -> None:
        """Freeze the mappings."""
        object.__setattr__(self, "zone", MappingProxyType(dict(self.zone)))
        object.__setattr__(self, "details", MappingProxyType(dict(self.details)))

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuilt, (self.to_dict(),)

    @property
    def ok(self) -> bool | None:
        """Whether the part conforms: the verdict, or the value within the limit; None without either."""
        if self.verdict is not None:
            return self.verdict
        return None if self.limit is None else bool(self.value <= self.limit)

    def with_limit(self, limit: float | None) -> Evaluation:
        """Return a copy with a tolerance [mm]."""
        return replace(self, limit=limit)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {
            "characteristic": self.characteristic,
            "value": self.value,
            "quantity": self.quantity,
            "limit": self.limit,
            "ok": self.ok,
            "certified": self.certified,
            "n_points": self.n_points,
            "zone": plain(dict(self.zone)),
            "active": list(self.active),
            "operations": list(self.operations),
            "details": plain(dict(self.details)),
            "notes": list(self.notes),
            "verdict": self.verdict,
        }


def _rebuilt(data: dict[str, Any]) -> Evaluation:
    kept = {key: value for key, value in data.items() if key != "ok"}
    for name in ("active", "operations", "notes"):
        kept[name] = tuple(kept[name])
    return Evaluation(**kept)


def plain(value: Any) -> Any:
    """Return numpy numbers and arrays as Python numbers and lists."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return value


def active_of(found: Association | Minimax) -> tuple[int, ...]:
    """Return the active points as plain integers."""
    return tuple(int(i) for i in found.active)
