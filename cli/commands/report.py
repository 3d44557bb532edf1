"""`horf report`: the report of runs that exist."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..exit_codes import CliError
from ..options import OUTPUT, Json


def report(
    paths: Annotated[
        list[Path], typer.Argument(help="Run folders, or folders of runs such as runs/room.")
    ],
    out: Annotated[
        Path, typer.Option(help="Folder for the report; replaced.", rich_help_panel=OUTPUT)
    ] = Path("report"),
    as_json: Json = False,
) -> None:
    """Write report.html and report.md about runs, finished or not."""
    from ..console import print_json, results
    from ..report import write_report

    files = [str(file) for file in write_report(_runs(paths), out)]
    if as_json:
        print_json({"files": files})
    else:
        results().print("\n".join(files), markup=False)


def _runs(paths: list[Path]) -> list[Path]:
    """Run folders at and below paths, each once."""
    found: dict[Path, None] = {}
    for path in paths:
        below = sorted(manifest.parent for manifest in path.rglob("manifest.json"))
        if not below:
            raise CliError(f"{path}: no run in there (no manifest.json)")
        found.update(dict.fromkeys(below))
    return list(found)
