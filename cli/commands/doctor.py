"""`horf doctor`: is everything here that the package needs?"""

from __future__ import annotations

from dataclasses import asdict

import typer

from ..exit_codes import RUNTIME_ERROR
from ..options import Json


def doctor(as_json: Json = False) -> None:
    """Check the installation: packages, programs, one depth image, one QP."""
    from rich.table import Table

    from ..checks import all_checks
    from ..console import notes, print_json, results
    from ..provenance import machine

    with notes().status("checking"):
        checks = list(all_checks())
    if as_json:
        print_json({"machine": machine(), "checks": [asdict(check) for check in checks]})
    else:
        console = results()
        console.print(", ".join(f"{key}: {value}" for key, value in machine().items()))
        table = Table("check", "", "found", "cure")
        for check in checks:
            mark = "[green]ok[/]" if check.ok else "[red]FAILED[/]"
            table.add_row(check.name, mark, check.detail, check.cure)
        console.print(table)
    if not all(check.ok for check in checks):
        raise typer.Exit(RUNTIME_ERROR)
