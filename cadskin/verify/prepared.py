"""A verification prepared for many made parts: what depends on the nominal part is done once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cadskin._progress import report
from cadskin.errors import CadskinError, GeometryError, SpecificationError
from cadskin.skin import SkinModel
from cadskin.spec import Specification, Tolerance
from cadskin.spec.binding import bound_to
from cadskin.verify.extraction import MadePart
from cadskin.verify.general import with_general
from cadskin.verify.part_geometry import Memory, PartGeometry
from cadskin.verify.part_size import evaluate_size, has_size_limits
from cadskin.verify.results import Verification
from cadskin.verify.sampling import sampling_shortfall
from cadskin.verify.tolerances import evaluate

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Progress
    from cadskin.shape import DiscreteShape, NominalModel
    from cadskin.verify.datums import Standard
    from cadskin.verify.evaluation import Evaluation

__all__ = ["PreparedVerification", "prepare"]


@dataclass(frozen=True, eq=False)
class PreparedVerification:
    """A specification made ready for many parts of one nominal model; see `prepare`.

    Parameters
    ----------
    nominal : NominalModel
    spec : Specification
        Bound to the part, general tolerances on each feature without another.
    standard : str
    sections : int
    geometry : PartGeometry
        What follows from the nominal model.
    memory : Memory
        The last associations: a datum feature that did not move from one part to the next is not associated
        again.
    """

    nominal: NominalModel
    spec: Specification
    standard: Standard
    sections: int
    geometry: PartGeometry
    memory: Memory

    def part(self, actual: SkinModel | DiscreteShape | MadePart | Points) -> MadePart:
        """Return a made part: of a skin model, of a mesh with face labels, or of vertices (n, 3) [mm].

        Raises
        ------
        GeometryError
            Vertices of another number than those of the nominal mesh.
        """
        from cadskin.shape import DiscreteShape

        if isinstance(actual, MadePart):
            return replace(actual, shared=self.geometry, memory=self.memory)
        if isinstance(actual, SkinModel):
            actual = actual.surface
        if not isinstance(actual, DiscreteShape):
            if len(actual) != self.nominal.surface.n_points:
                raise GeometryError(
                    f"{len(actual)} vertices for a nominal mesh of {self.nominal.surface.n_points}; give a "
                    "mesh with face labels instead"
                )
            actual = self.nominal.surface.with_points(actual)
        return MadePart(actual, self.nominal, self.geometry, self.memory)

    def evaluate(
        self,
        actual: SkinModel | DiscreteShape | MadePart | Points,
        *,
        sizes: bool = False,
        sampling: bool = False,
        progress: Progress | None = None,
    ) -> Verification:
        """Evaluate every tolerance on one made part.

        Parameters
        ----------
        actual : SkinModel, DiscreteShape, MadePart or (n, 3) float
            See `part`.
        sizes : bool
            Also the sizes with limits.
        sampling : bool
            Also ``details["sampling_shortfall"]``, where it can be estimated (nine evaluations, not one).
        progress : callable, optional
        """
        part = self.part(actual)
        evaluations, unresolved = [], [(item.entity, item.reason) for item in self.spec.unresolved]
        for index, tolerance in enumerate(self.spec):
            try:
                found = self._evaluated(tolerance, part)
                found = self._estimated(found, tolerance, part) if sampling else found
                evaluations.append((tolerance.id, found))
            except CadskinError as error:
                unresolved.append((tolerance.id, str(error)))
            report(progress, index + 1, len(self.spec))
        for dimension in filter(has_size_limits, self.spec.dimensions) if sizes else ():
            try:
                evaluations.append((dimension.id, evaluate_size(dimension, part, sections=self.sections)))
            except CadskinError as error:
                unresolved.append((dimension.id, str(error)))
        return Verification(tuple(evaluations), tuple(unresolved), self.standard)

    def _estimated(self, found: Evaluation, tolerance: Tolerance, part: MadePart) -> Evaluation:
        try:
            missing = self.sampling_shortfall(tolerance, part)
        except CadskinError as error:
            return replace(found, notes=(*found.notes, f"no estimate of the sampling: {error}"))
        return replace(found, details={**found.details, "sampling_shortfall": missing})

    def evaluate_tolerance(
        self, tolerance: Tolerance | str, actual: SkinModel | DiscreteShape | MadePart | Points
    ) -> Evaluation:
        """Evaluate one tolerance on one made part.

        Parameters
        ----------
        tolerance : Tolerance or str
            One of the specification or its id, or another on faces of the part (a member of a pattern).
        actual : SkinModel, DiscreteShape, MadePart or (n, 3) float
            See `part`.

        Raises
        ------
        SpecificationError
            It is not supported.
        AssociationError
            A datum or a feature cannot be associated on this part.
        """
        wanted = self.spec[tolerance] if isinstance(tolerance, str) else tolerance
        return self._evaluated(wanted, self.part(actual))

    def sampling_shortfall(
        self, tolerance: Tolerance | str, actual: SkinModel | DiscreteShape | MadePart | Points
    ) -> float:
        """Estimate what the surface between the points has on top of the value of the points [mm].

        The toleranced features are thinned to a quarter of their points, eight times, and what that loses is
        carried on to no spacing at all (`cadskin.verify.sampling.sampling_shortfall`). Datums keep theirs.

        Raises
        ------
        SpecificationError
            A value of lines, sections or derived features, which do not depend on the points in this way.
        GeometryError
            Fewer than 64 points.
        """
        wanted = self.spec[tolerance] if isinstance(tolerance, str) else tolerance
        part = self.part(actual)
        if not _of_points(wanted):
            raise SpecificationError(
                f"tolerance {wanted.id} ({wanted.type}): the sampling is estimated for values of the points "
                "of a surface, not of lines, sections or derived features"
            )
        faces = wanted.feature.faces
        features = frozenset(feature.id for feature in part.features(faces))

        def value(rows: Floats) -> float:
            some = (features, rows[:, 0].astype(np.int64))
            return self._evaluated(wanted, replace(part, thinned=some)).value

        rows = part.vertex_ids(faces)[:, None].astype(np.float64)
        return sampling_shortfall(rows, value)[1]

    def _evaluated(self, tolerance: Tolerance, part: MadePart) -> Evaluation:
        return evaluate(tolerance, part, self.spec, standard=self.standard, sections=self.sections)


def _of_points(tolerance: Tolerance) -> bool:
    """Tell whether a value is one of the points of a surface."""
    lines = ("straightness", "roundness", "line_profile", "circular_runout")
    derived = tolerance.feature.derived != "none" or tolerance.zone.shape != "width"
    return not derived and tolerance.type not in lines and tolerance.zone.per_area is None


def prepare(
    nominal: NominalModel,
    spec: Specification,
    *,
    standard: Standard = "ISO 5459:2011",
    sections: int = 15,
) -> PreparedVerification:
    """Prepare the verification of many made parts of one nominal model.

    Values are those of `verify`, bit by bit, and come several times sooner: nominal datums, vertices, edges,
    pairs of opposite points and closest-point functions are worked out once, and datums that several
    tolerances share, once per part.

    Parameters
    ----------
    nominal : NominalModel
    spec : Specification
        Bound to the faces of the part; else it is bound here. Its general tolerances are put on features.
    standard : {"ISO 5459:2011", "ASME Y14.5.1-2019"}
        Of the datum associations.
    sections : int
        Sections, surface lines or circles of a feature.

    Examples
    --------
    >>> import cadquery as cq, cadskin as cs
    >>> from cadskin.verify import prepare
    >>> part = cs.nominal(cq.Workplane().box(30, 20, 8), edge_length=4.0)
    >>> parallel = cs.parallelism(">Z", 0.1, datums="A")
    >>> prepared = prepare(part, cs.Specification(parallel, datums={"A": "<Z"}))
    >>> field = cs.WhiteNoise(0.01).sample(part, size=3, rng=1)
    >>> [prepared.evaluate(cs.SkinModel(part, one)).conforming for one in field]
    [True, True, True]
    """
    bound = with_general(bound_to(spec, nominal), nominal)
    return PreparedVerification(nominal, bound, standard, sections, PartGeometry(nominal), Memory())
