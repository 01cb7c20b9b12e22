"""``cadskin doctor``: what is installed, what is broken, and the line that repairs it."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from cadskin.cli._console import print_json, print_table, status

if TYPE_CHECKING:
    from cadskin.doctor import Finding


def command(
    report: Annotated[bool, typer.Option("--report", help="Plain text to paste into a bug report.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Machine-readable output.")] = False,
    repair: Annotated[
        bool,
        typer.Option("--repair", help="Run the lines that repair what is broken (apt-get only for root)."),
    ] = False,
    imports: Annotated[
        bool, typer.Option(help="Also import the heavy packages, each in a process of its own.")
    ] = True,
) -> None:
    """Examine the installation; exit code 1 when something is broken."""
    from cadskin import doctor

    with status("examining the installation"):
        findings = doctor.examine(imports=imports)
    if repair and doctor.broken(findings):
        _show(findings)
        with status("repairing"):
            doctor.repair(findings)
            findings = doctor.examine(imports=imports)
    wrong = len(doctor.broken(findings))
    if json:
        print_json({"broken": wrong, "findings": [asdict(finding) for finding in findings]})
    elif report:
        typer.echo(doctor.report(findings))
    else:
        _show(findings)
    if wrong:
        raise typer.Exit(1)


def _show(findings: tuple[Finding, ...]) -> None:
    rows = [(finding.state, finding.subject, finding.detail) for finding in findings]
    print_table("installation", ("state", "what", "detail"), rows)
    wrong = [finding for finding in findings if finding.state == "broken"]
    for finding in wrong:
        typer.echo(f"broken: {finding.subject}: {finding.detail}")
        typer.echo(f"  repair: {finding.repair}")
    if not wrong:
        typer.echo("nothing is broken")
