"""How a tolerance is met: by the conditional law, on a value, by scaling, by rejecting parts, or not."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, get_args

from cadskin.errors import SpecificationError

if TYPE_CHECKING:
    import numpy as np

    from cadskin.spec import Specification

__all__ = [
    "Conformity",
    "Method",
    "Policies",
    "SamplerName",
    "conditioned",
    "policies_of",
    "read_policy",
    "sampler_of",
    "target",
]

Method: TypeAlias = Literal["conditioned", "target", "scale", "reject", "none"]
SamplerName: TypeAlias = Literal["auto", "rejection", "hmc", "slice", "gibbs"]
ZoneName: TypeAlias = Literal["minimum", "pca"]
Policies: TypeAlias = "str | Conformity | Mapping[str, str | Conformity]"


@dataclass(frozen=True)
class Conformity:
    """The policy of a tolerance.

    Parameters
    ----------
    method : {"conditioned", "target", "scale", "reject", "none"}
        ``conditioned``: the exact law of the model given that the tolerance is met (the inspected lot).
        ``target``: the characteristic takes a chosen value. ``scale``: a feature that is outside is scaled
        into its zone, which is another law. ``reject``: as ``conditioned``, by rejecting whole parts.
        ``none``: the raw law; the tolerance may be violated.
    value : float, or callable, or None
        Of ``target``: the value [mm], or a function of a `numpy.random.Generator` that draws it.
    sampler : {"auto", "rejection", "hmc", "slice", "gibbs"}
        Of ``conditioned``: how what depends on one block alone is drawn. ``auto`` rejects where at least one
        of a hundred raw fields fits and runs a Markov chain where fewer do; see `cadskin.conform.routes`.
    zone : {"minimum", "pca"}
        Of a flatness: the minimum zone of ISO 1101, or the paper's across the third principal axis, which is
        never narrower (`cadskin.conform.pca_zone`). Other characteristics keep the zone of the standard.

    Raises
    ------
    SpecificationError
        Unknown method, sampler or zone, or a target without a positive value.
    """

    method: Method = "conditioned"
    value: float | Callable[[np.random.Generator], float] | None = None
    sampler: SamplerName = "auto"
    zone: ZoneName = "minimum"

    def __post_init__(self) -> None:
        """Check method and value."""
        if self.method not in get_args(Method):
            raise SpecificationError(f"conformity {self.method!r} is none of {', '.join(get_args(Method))}")
        if self.sampler not in get_args(SamplerName):
            raise SpecificationError(
                f"sampler must be one of {', '.join(get_args(SamplerName))}, got {self.sampler!r}"
            )
        if self.zone not in get_args(ZoneName):
            raise SpecificationError(f"zone must be minimum or pca, got {self.zone!r}")
        if self.sampler != "auto" and self.method != "conditioned":
            raise SpecificationError(f"a sampler goes with 'conditioned' only, not with {self.method!r}")
        if (self.method == "target") != (self.value is not None):
            raise SpecificationError("a target needs a value, and only a target: target(0.02)")
        if isinstance(self.value, int | float) and not (isfinite(self.value) and self.value > 0):
            raise SpecificationError(f"the target of a tolerance must be positive, got {self.value} mm")

    def draw(self, rng: np.random.Generator) -> float:
        """Return the value of one part [mm].

        Raises
        ------
        SpecificationError
            The function drew no positive number.
        """
        if self.value is None:
            raise SpecificationError(f"conformity {self.method!r} has no target value")
        drawn = float(self.value(rng)) if callable(self.value) else float(self.value)
        if not (isfinite(drawn) and drawn > 0):
            raise SpecificationError(f"the target of a tolerance must be positive, its function drew {drawn}")
        return drawn

    def __str__(self) -> str:
        return f"{self._name()} in the pca zone" if self.zone == "pca" else self._name()

    def _name(self) -> str:
        if self.method != "target":
            return self.method if self.sampler == "auto" else f"{self.method} by {self.sampler}"
        if callable(self.value):
            return f"target {getattr(self.value, '__name__', 'distribution')}"
        return f"target {self.value:g}"


def conditioned(*, sampler: SamplerName = "auto") -> Conformity:
    """Return the policy of the exact conditioned law, drawn by a chosen sampler.

    Examples
    --------
    >>> str(conditioned(sampler="hmc"))
    'conditioned by hmc'
    """
    return Conformity("conditioned", sampler=sampler)


def sampler_of(items: Iterable[Any]) -> SamplerName:
    """Return the sampler that the policies of requirements ask for; the first that is not ``auto``."""
    asked: list[SamplerName] = [item.policy.sampler for item in items if item.policy.sampler != "auto"]
    return asked[0] if asked else "auto"


def target(value: float | Callable[[np.random.Generator], float]) -> Conformity:
    """Return the policy that a characteristic takes a value [mm], or one drawn by a function of a generator.

    Examples
    --------
    >>> str(target(0.02))
    'target 0.02'
    """
    return Conformity("target", value)


def policies_of(conform: Policies, spec: Specification) -> dict[str, Conformity]:
    """Return the policy of every tolerance and of every size by its id.

    A tolerance that has a policy of its own (``policy = "scale"`` in a spec file) keeps it, unless the
    mapping names the tolerance. Sizes are conditioned, or rejected, or left; a target or a scaling of all
    tolerances leaves them conditioned.

    Parameters
    ----------
    conform : str, Conformity, or mapping of tolerance id to either
        The key ``"*"`` of a mapping is for all other tolerances, ``conditioned`` without it.
    spec : Specification

    Raises
    ------
    SpecificationError
        An unknown method or an id that no tolerance has.

    Examples
    --------
    >>> from cadskin.spec import Specification, flatness
    >>> policies_of({"flatness-1": "none"}, Specification(flatness(">Z", 0.02)))["flatness-1"].method
    'none'
    """
    given = conform if isinstance(conform, Mapping) else {"*": conform}
    sizes = {item.id for item in spec.dimensions}
    known = {tolerance.id for tolerance in spec} | sizes
    wrong = [key for key in given if key != "*" and key not in known]
    if wrong:
        raise SpecificationError(
            f"no tolerance has the id {wrong[0]!r}; there are {', '.join(sorted(known)) or 'none'}"
        )
    rest = _as_policy(given.get("*", "conditioned"))
    policies = {name: _as_policy(given[name]) for name in given if name != "*"}
    for name in sizes & policies.keys():
        if policies[name].method in ("target", "scale"):
            raise SpecificationError(
                f"the size {name} can be conditioned, reject or none, not {policies[name]}"
            )
    for tolerance in spec:
        own = rest if tolerance.policy is None else read_policy(tolerance.policy)
        policies.setdefault(tolerance.id, own)
    of_sizes = Conformity() if rest.method in ("target", "scale") else rest
    return dict.fromkeys(sizes, of_sizes) | policies


def read_policy(text: str) -> Conformity:
    """Return the policy that a text stands for: ``scale``, ``none``, ``target 0.02``.

    Raises
    ------
    SpecificationError
        None of them.

    Examples
    --------
    >>> read_policy("target 0.02").value
    0.02
    """
    method, _, value = text.strip().partition(" ")
    if method != "target":
        return _as_policy(text.strip())
    try:
        return target(float(value))
    except ValueError as error:
        if isinstance(error, SpecificationError):
            raise
        raise SpecificationError(
            f"a target is a number of mm, such as 'target 0.02', got {text!r}"
        ) from error


def _as_policy(given: Any) -> Conformity:
    if isinstance(given, Conformity):
        return given
    if isinstance(given, str):
        if given == "target":
            raise SpecificationError("a target needs a value: conform=target(0.02)")
        method, _, sampler = given.partition(" by ")
        if sampler:
            return Conformity(method, sampler=sampler)  # type: ignore[arg-type]
        return Conformity(given)  # type: ignore[arg-type]
    raise SpecificationError(f"conform takes a name, a Conformity or a mapping of them, not {given!r}")
