"""The table in all its formats: terminal, Markdown, CSV, LaTeX."""

from __future__ import annotations

import csv
from pathlib import Path

from rich.markup import escape
from rich.table import Table

from .table_one import TableOne
from .templating import render


def terminal_table(table: TableOne) -> Table:
    """For the terminal, without the notes."""
    shown = Table()
    shown.add_column("scene")
    shown.add_column("metric")
    for column in table.columns:
        shown.add_column(column, justify="right")
    for block in table.blocks:
        for k, row in enumerate(block.rows):
            shown.add_row("" if k else block.scene, row.label, *map(escape, row.cells))
        shown.add_section()
    return shown


def write_table(table: TableOne, folder: Path) -> list[Path]:
    """Write table.md, table.csv and table.tex into a folder; older ones are replaced.

    Raises:
        OSError: If they cannot be written.
    """
    markdown, latex = folder / "table.md", folder / "table.tex"
    markdown.write_text(render("table.md.j2", table=table))
    latex.write_text(render("table.tex.j2", table=table))
    values = folder / "table.csv"
    with values.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["scene", "metric", *table.columns])
        for block in table.blocks:
            writer.writerows([block.scene, row.label, *row.cells] for row in block.rows)
    return [markdown, values, latex]
