"""Table and JSON of `benchmarks/safety.py`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from circumstances import circumstances, write_json
from horf_cli.statistics import share

from horf_env.task import STEP

Row = dict[str, str]

_OUTCOMES = ("success", "collision", "timeout")


def figures(rows: list[Row]) -> dict[str, Any]:
    """What a run comes to."""
    n, outcomes = len(rows), [row["outcome"] for row in rows]
    rates = {name: share(outcomes.count(name), n) for name in _OUTCOMES}
    return {
        "episodes": n,
        "ticks": _sum(rows, "steps"),
        **{name: [rate.rate, rate.low, rate.high] for name, rate in rates.items()},
        "errors": sum(outcome.startswith("error") for outcome in outcomes),
        "not_finite": sum(row["finite"] != "True" for row in rows),
        "solver_fallbacks": _sum(rows, "fallback"),
        "solver_failures": _sum(rows, "braking"),
        "slack_ticks": _sum(rows, "slack_steps"),
        "mean_seconds": STEP * _sum(rows, "steps") / n,
        "mean_base_speed": _speed(rows, "base_path"),
        "mean_ee_speed": _speed(rows, "ee_path"),
        "table": {name: str(rate) for name, rate in rates.items()},
    }


def _sum(rows: list[Row], column: str) -> int:
    return sum(int(row[column]) for row in rows)


def _speed(rows: list[Row], column: str) -> float:
    """Way by time over all episodes that have both [m/s]."""
    ways, steps = np.array([[float(row[column]), float(row["steps"])] for row in rows]).T
    ended = np.isfinite(ways)
    return float(ways[ended].sum() / (STEP * steps[ended].sum()))


def by_scene(rows: list[Row]) -> dict[str, Any]:
    """The same for each scene."""
    scenes = dict.fromkeys(row["scene"] for row in rows)
    return {scene: figures([row for row in rows if row["scene"] == scene]) for scene in scenes}


def summarise(runs: Mapping[str, list[Row]], path: Path) -> None:
    """Print the table of the runs that have rows, and write the JSON."""
    result = {
        name: figures(rows) | {"scenes": by_scene(rows)} for name, rows in runs.items() if rows
    }
    head = ("run", "n", "ticks", *_OUTCOMES, "errors, NaN", "solver fallback, failed")
    print("| " + " | ".join((*head, "s / episode", "base m/s", "EE m/s")) + " |")
    print("|---" * (len(head) + 3) + "|")
    for name, run in result.items():
        cells = [name, run["episodes"], run["ticks"], *(run["table"][o] for o in _OUTCOMES)]
        cells += [f"{run['errors']}, {run['not_finite']}"]
        cells += [f"{run['solver_fallbacks']}, {run['solver_failures']}"]
        cells += [f"{run['mean_seconds']:.1f}"]
        cells += [f"{run['mean_base_speed']:.3f}", f"{run['mean_ee_speed']:.3f}"]
        print("| " + " | ".join(str(cell) for cell in cells) + " |")
    write_json({**circumstances(), "runs": result}, path)
