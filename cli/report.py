"""The report of a comparison: one HTML file that needs nothing else, and the same as Markdown."""

from __future__ import annotations

import base64
import os
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import report_figures as draw
from .provenance import machine, versions
from .report_numbers import final_rows, pairs
from .run_results import Group, RunData, group, read_run
from .templating import render

_FEW_RUNS = 5  # of a group: with fewer, intervals say little


@dataclass(frozen=True)
class ReportFigure:
    """A figure with what it shows.

    Attributes:
        name: Of its file.
        title: Heading.
        caption: What is drawn.
        svg: The picture; None if there is nothing to draw.
        missing: Why there may be none.
    """

    name: str
    title: str
    caption: str
    svg: str | None
    missing: str

    @property
    def data_uri(self) -> str:
        """The picture inside of an address; so its ids cannot clash with those of others."""
        return "data:image/svg+xml;base64," + base64.b64encode((self.svg or "").encode()).decode()


def write_report(
    paths: Sequence[Path],
    folder: Path,
    *,
    command: str | None = None,
    failed: Mapping[str, str] | None = None,
) -> list[Path]:
    """Write report.html, report.md and its figures into a folder; older ones are replaced.

    Args:
        paths: Run folders, at least one.
        folder: Where to; made if needed.
        command: What was typed to get here; None for the commands of the runs.
        failed: Runs that failed, with the reason.

    Returns:
        The two files.

    Raises:
        CliError: If a path is no run.
        OSError: If something cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    runs = [read_run(path) for path in paths]
    groups = group(runs)
    figures = _figures(groups)
    for figure in figures:
        if figure.svg is not None:
            (folder / f"{figure.name}.svg").write_text(figure.svg)
    values = {
        "question": _question(groups, runs),
        "command": command or "\n".join(_commands(runs)),
        "warnings": _warnings(groups, runs),
        "figures": figures,
        "rows": final_rows(groups),
        "pairs": pairs(groups),
        "failed": {**_failed(runs), **(failed or {})},
        "machines": _distinct([run.manifest.machine for run in runs] or [machine()]),
        "versions": _distinct([run.manifest.versions for run in runs] or [versions()]),
        "runs": [_described(run, folder) for run in runs],
    }
    files = [folder / "report.html", folder / "report.md"]
    for file in files:
        file.write_text(render(f"{file.name}.j2", **values))
    return files


def _figures(groups: Sequence[Group]) -> list[ReportFigure]:
    nothing = "no run has an evaluation at its end yet"
    return [
        ReportFigure(
            "curves",
            "Learning curves",
            "Evaluations without action noise on validation instances. Lines: statistic over runs; "
            "bands: 95 % stratified bootstrap; thin lines: single runs, where they are few.",
            draw.curves(groups),
            "no run has been evaluated while it learned",
        ),
        ReportFigure(
            "training",
            "Training episodes",
            "With exploration noise, on random training instances; means over twentieths of a run.",
            draw.training_curves(groups),
            "no training episode has ended",
        ),
        ReportFigure(
            "final", "Return at the end", "Each run once.", draw.final_returns(groups), nothing
        ),
        ReportFigure(
            "improvement",
            "Probability of improvement",
            "That a random run of one group has a larger return at the end than one of the other, "
            "with 95 % stratified bootstrap intervals.",
            draw.improvements(pairs(groups)),
            "there are not two groups with finished runs",
        ),
        ReportFigure(
            "replay_ratio",
            "Replay ratio",
            "Return at the end over gradient steps an environment step, IQM with 95 % intervals.",
            draw.replay_ratios(groups),
            "one replay ratio only; --replay-ratios gives several",
        ),
        ReportFigure(
            "q_bias",
            "Bias of Q",
            "Predicted minus Monte-Carlo soft return of the last policy, by the mean return's "
            "absolute value; above 0 is overestimation.",
            draw.q_biases(groups),
            "not measured",
        ),
    ]


def _question(groups: Sequence[Group], runs: Sequence[RunData]) -> str:
    labels = " or ".join(group.label for group in groups)
    steps = sorted({run.manifest.config.steps for run in runs})
    scenes = sorted({run.manifest.config.env.scene_name for run in runs})
    seeds = sorted({run.manifest.config.seed for run in runs})
    return (
        f"Which learns best: {labels}, after {' / '.join(f'{n:,}' for n in steps)} environment "
        f"steps in scene {', '.join(scenes)}, with seeds {', '.join(map(str, seeds))}?"
    )


def _commands(runs: Sequence[RunData]) -> list[str]:
    return list(dict.fromkeys(shlex.join(run.manifest.command) for run in runs))


def _warnings(groups: Sequence[Group], runs: Sequence[RunData]) -> list[str]:
    """What makes the numbers weak."""
    found = [text for run in runs for text in run.damaged]
    few = [group.label for group in groups if len(group.ended) < _FEW_RUNS]
    if few:
        found.append(
            f"Fewer than {_FEW_RUNS} finished runs of {', '.join(few)}: the intervals are too "
            "narrow to be trusted, and differences may be chance."
        )
    unfinished = [str(run.path) for run in runs if run.manifest.status != "finished"]
    if unfinished:
        found.append(f"Not finished: {', '.join(unfinished)}.")
    if len({run.manifest.config.steps for run in runs}) > 1:
        found.append("Runs have different numbers of steps: values at the end do not compare.")
    if len({str(run.manifest.git_revision) for run in runs}) > 1:
        found.append("Runs come from different revisions of the code.")
    return found


def _failed(runs: Sequence[RunData]) -> dict[str, str]:
    return {str(run.path): run.manifest.error for run in runs if run.manifest.status == "failed"}


def _distinct(tables: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """All values of each key."""
    keys = dict.fromkeys(key for table in tables for key in table)
    return {
        key: ", ".join(dict.fromkeys(str(table[key]) for table in tables if key in table))
        for key in keys
    }


def _described(run: RunData, folder: Path) -> dict[str, Any]:
    """A line of the list of runs; paths are relative to the report, so both can be moved."""
    manifest, path = run.manifest, Path(os.path.relpath(run.path, folder))
    return {
        "path": path.as_posix(),
        "algo": manifest.config.algo,
        "seed": manifest.config.seed,
        "ratio": "-" if run.ratio is None else f"{run.ratio:g}",
        "status": manifest.status,
        "steps": run.steps,
        "hours": f"{run.hours:.2f}",
        "resumed": len(manifest.resumed),
        "hash": manifest.config_hash,
        "revision": (manifest.git_revision or "-")[:12],
        "recordings": [
            (path / "recordings" / file.name).as_posix()
            for file in sorted((run.path / "recordings").glob("*.rrd"))
        ],
    }
