"""The error tree: everything that cadskin raises on purpose derives from `CadskinError`."""

from __future__ import annotations

__all__ = [
    "AssociationError",
    "CadskinError",
    "CadskinWarning",
    "Cancelled",
    "ConformityError",
    "DeviationError",
    "ExportError",
    "GeometryError",
    "KernelError",
    "MeshingError",
    "MissingDependencyError",
    "ReadError",
    "SelectionError",
    "SpecificationError",
    "StatisticsError",
]


class CadskinError(Exception):
    """Root of all errors of this package; the message says what is wrong, where, and what to do.

    Attributes
    ----------
    exit_code : int
        Exit code of the command line: 2 for a wrong request, 3 for an input that cannot be read.
    """

    exit_code: int = 2


class GeometryError(CadskinError, ValueError):
    """A shape, mesh or number that cannot be worked with (open shell, NaN, zero area)."""


class ReadError(GeometryError):
    """A file that cannot be read as what it claims to be."""

    exit_code = 3


class KernelError(ReadError):
    """The geometry kernel crashed, hung or ran out of memory on an input (contained in a child process)."""


class MeshingError(GeometryError):
    """The mesher could not make a watertight mesh within the stated limits."""


class SelectionError(CadskinError, LookupError):
    """A selector that matches no face or feature, or is not understood."""


class SpecificationError(CadskinError, ValueError):
    """A tolerance, datum or specification that contradicts itself or the part."""


class DeviationError(CadskinError, ValueError):
    """Parameters of a deviation model that have no meaning (sigma <= 0, NaN, length 0)."""


class ConformityError(CadskinError):
    """No sample inside the tolerance zones could be produced."""


class AssociationError(CadskinError, ValueError):
    """An ideal feature that cannot be fitted (too few points, degenerate cloud, none exists)."""


class StatisticsError(CadskinError, ValueError):
    """A population that cannot be analysed (too few parts, different lengths, nothing observed)."""


class ExportError(CadskinError, OSError):
    """A file that cannot be written; nothing is left behind."""

    exit_code = 3


class MissingDependencyError(CadskinError, ImportError):
    """An optional package is needed; the message holds the line that installs it."""


class Cancelled(CadskinError):
    """The caller's progress function asked to stop."""

    exit_code = 130


class CadskinWarning(UserWarning):
    """Something the user should know and that does not stop the work."""
