"""A part with its specification on its faces: bound once, then passed on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cadskin.conform.requirements import datum_features, nominal_part
from cadskin.errors import SpecificationError
from cadskin.spec.binding import bound_to
from cadskin.verify.general import with_general
from cadskin.verify.part_size import has_size_limits

if TYPE_CHECKING:
    from cadskin.shape import NominalModel
    from cadskin.spec import Specification, Tolerance
    from cadskin.verify.extraction import MadePart

__all__ = ["BoundPart", "bound_part"]


@dataclass(frozen=True, eq=False)
class BoundPart:
    """A nominal model and its specification, bound and checked by `bound_part`.

    Functions that take a specification take it too, and then neither bind nor check again.

    Parameters
    ----------
    nominal : NominalModel
    spec : Specification
        On the faces of the part, its general tolerances on each feature without another.
    pattern : MadePart
        The nominal part as if it had been made; made parts after it share what it knows.
    """

    nominal: NominalModel
    spec: Specification
    pattern: MadePart


def bound_part(spec: Specification | BoundPart, nominal: NominalModel) -> BoundPart:
    """Return a part with its specification; itself where that has been done.

    Raises
    ------
    SpecificationError
        It holds no tolerance, one whose datum is the toleranced feature itself, or it is bound to another
        part.

    Examples
    --------
    >>> import cadquery as cq, cadskin as cs
    >>> part = cs.nominal(cq.Workplane().box(4, 4, 2), edge_length=2.0)
    >>> bound = bound_part(cs.Specification(default=cs.surface_profile(None, 0.1)), part)
    >>> len(bound.spec), bound_part(bound, part) is bound
    (6, True)
    """
    if isinstance(spec, BoundPart):
        if spec.nominal is not nominal:
            raise SpecificationError("the specification is bound to another nominal model, bind it to this")
        return spec
    sizes = any(has_size_limits(dimension) for dimension in spec.dimensions)
    if not len(spec) and spec.default is None and not spec.unresolved and not sizes:
        raise SpecificationError("the specification holds no tolerance; simulate without spec, or give one")
    bound = bound_to(spec, nominal)
    pattern = nominal_part(nominal)
    for tolerance in bound:
        _refuse_own_datum(tolerance, pattern, bound)
    return BoundPart(nominal, with_general(bound, nominal), pattern)


def _refuse_own_datum(tolerance: Tolerance, pattern: MadePart, spec: Specification) -> None:
    if len(tolerance.datums) != 1 or not tolerance.feature.faces:
        return
    datums = {feature.id for feature in datum_features(pattern, tolerance, spec)}
    own = {pattern.nominal.feature_of(face).id for face in tolerance.feature.faces}
    if own <= datums:
        raise SpecificationError(
            f"{tolerance.id} ({tolerance.type} on {tolerance.feature.text()}): its datum "
            f"{tolerance.datums.text()} is the toleranced feature itself; a feature cannot be located or "
            "oriented against itself"
        )
