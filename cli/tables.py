"""Tables of results for the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from .episodes import Trial

_OUTCOME_STYLE = {"success": "green", "collision": "red", "stuck": "yellow", "timeout": "yellow"}


def trial_table(trials: Sequence[Trial], *, title: str) -> Table:
    """One row a trial."""
    table = Table(title=title, title_justify="left")
    table.add_column("scene")
    table.add_column("outcome")
    for header in ("base / m", "EE / m", "time / s", "clearance / m"):
        table.add_column(header, justify="right")
    for trial in trials:
        style = _OUTCOME_STYLE.get(trial.outcome, "")
        table.add_row(
            trial.scene,
            f"[{style}]{trial.outcome}[/]" if style else trial.outcome,
            f"{trial.path_length_base:.2f}",
            f"{trial.path_length_ee:.2f}",
            f"{trial.execution_time:.2f}",
            f"{trial.min_distance:.3f}",
        )
    return table
