"""What a verification says: its table, its verdict, its exit code."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from cadskin.cli._console import note, print_table, progress_bar

if TYPE_CHECKING:
    from cadskin.shape import DiscreteShape, NominalModel
    from cadskin.spec import Specification
    from cadskin.verify import Verification

__all__ = ["exit_code", "print_verification", "say_verdict", "verified"]


def verified(
    made: DiscreteShape, tolerances: Specification, nominal: NominalModel, **options: Any
) -> Verification:
    """Return the table of one made part, sizes included; ``options`` as for `cadskin.verify.verify`."""
    from cadskin.verify import verify

    with progress_bar("verifying") as progress:
        found = verify(made, tolerances, nominal=nominal, sizes=True, progress=progress, **options)
    return cast("Verification", found)  # one part has one table


def print_verification(title: str, table: Verification) -> None:
    """Write the table of one part to standard output, and its verdict."""
    columns = ("tolerance", "characteristic", "value", "limit", "verdict", "certified")
    print_table(title, columns, table.rows(), right=("value", "limit"))
    say_verdict(table.conforming)


def say_verdict(conforming: bool) -> None:
    """Write whether all conforms."""
    note("conforming" if conforming else "not conforming")


def exit_code(conforming: bool) -> int:
    """Return the exit code of a command that verifies: 1 where something does not conform."""
    return 0 if conforming else 1
