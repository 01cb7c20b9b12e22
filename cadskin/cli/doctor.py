"""``cadskin doctor``: what is installed, what is broken, and the line that repairs it."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from cadskin.cli._console import print_json, print_table, status


def command(
    report: Annotated[bool, typer.Option("--report", help="Plain text to paste into a bug report.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Machine-readable output.")] = False,
    imports: Annotated[
        bool, typer.Option(help="Also import the heavy packages, each in a process of its own.")
    ] = True,
) -> None:
    """Examine the installation; exit code 1 when something is broken."""
    from cadskin import doctor

    with status("examining the installation"):
        findings = doctor.examine(imports=imports)
    wrong = doctor.broken(findings)
    if json:
        print_json({"broken": len(wrong), "findings": [asdict(finding) for finding in findings]})
    elif report:
        typer.echo(doctor.report(findings))
    else:
        rows = [(finding.state, finding.subject, finding.detail) for finding in findings]
        print_table("installation", ("state", "what", "detail"), rows)
        for finding in wrong:
            typer.echo(f"broken: {finding.subject}: {finding.detail}")
            typer.echo(f"  repair: {finding.repair}")
        if not wrong:
            typer.echo("nothing is broken")
    if wrong:
        raise typer.Exit(1)
