"""Tables of results for the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.markup import escape
from rich.table import Table

from .episodes import Trial
from .statistics import Summary

_OUTCOME_STYLE = {"success": "green", "collision": "red", "timeout": "yellow"}


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


def summary_table(summaries: Sequence[Summary]) -> Table:
    """One row a scene and method; rates with their 95 % intervals, means over successes."""
    table = Table(title="rates with 95 % Wilson intervals, means over successes")
    table.add_column("scene")
    table.add_column("method")
    for header in ("n", "success", "collision", "timeout"):
        table.add_column(header, justify="right")
    for header in ("base / m", "EE / m", "time / s", "AV / m/s", "clearance / m"):
        table.add_column(header, justify="right")
    for summary in summaries:
        table.add_row(
            summary.scene,
            summary.method,
            str(summary.trials),
            *(escape(str(share)) for share in (summary.success, summary.collision)),
            escape(str(summary.timeout)),
            _number(summary.path_length_base, 2),
            _number(summary.path_length_ee, 2),
            _number(summary.execution_time, 2),
            _number(summary.mean_ee_speed, 2),
            _number(summary.min_distance, 3),
        )
    return table


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
