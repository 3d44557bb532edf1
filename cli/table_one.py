"""The layout of the paper's Table 1, filled with measured trials and the paper's own figures."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources

from .episodes import Trial
from .statistics import holm, mcnemar
from .summaries import Summary, summarise_trials

PAPER_MARK = "†"

Trials = Mapping[tuple[str, str], Sequence[Trial]]
"""Trials of each scene and method, at least one each."""


@dataclass(frozen=True)
class Row:
    """One metric in one scene.

    Attributes:
        label: The metric with its unit.
        cells: Text a column.
    """

    label: str
    cells: list[str]


@dataclass(frozen=True)
class Block:
    """All metrics of a scene."""

    scene: str
    rows: list[Row]


@dataclass(frozen=True)
class TableOne:
    """The table as text, without any markup.

    Attributes:
        columns: Methods; those with a mark are the paper's own figures.
        blocks: The scenes.
        notes: What has to be known to read it.
    """

    columns: list[str]
    blocks: list[Block]
    notes: list[str]


@dataclass(frozen=True)
class _Metric:
    label: str
    field: str
    text: Callable[[Summary], str]
    paper_format: str = ".3f"


def _number(field: str, digits: int) -> Callable[[Summary], str]:
    def text(summary: Summary) -> str:
        value = getattr(summary, field)
        return "-" if value is None else f"{value:.{digits}f}"

    return text


_METRICS = (
    # The five of the paper, in its order.
    _Metric("TL of MM (m)", "path_length_base", _number("path_length_base", 2)),
    _Metric("TL of EE (m)", "path_length_ee", _number("path_length_ee", 2)),
    _Metric("AV (m/s)", "mean_ee_speed", _number("mean_ee_speed", 2)),
    _Metric("Total Runtime (s)", "total_time", _number("total_time", 2)),
    _Metric("Success Rate (%)", "success", lambda s: _percent(s), "g"),
    # And what it does not tell.
    _Metric("execution (s)", "", _number("execution_time", 2)),
    _Metric("planning (s)", "", _number("planning_time", 3)),
    _Metric("planning a tick, p50 / p99 (ms)", "", lambda s: _planning(s)),
    _Metric("collision / stuck / timeout (%)", "", lambda s: _failures(s)),
    _Metric("SPL", "", _number("spl", 3)),
    _Metric("clearance, 5th percentile (m)", "", _number("clearance_p5", 3)),
    _Metric("EE jerk, RMS (m/s³)", "", _number("jerk_ee", 1)),
    _Metric("ticks without a QP solution", "", lambda s: str(s.unsolved)),
    _Metric("trials", "", lambda s: str(s.trials)),
)


def _percent(summary: Summary) -> str:
    rate = summary.success
    return f"{100 * rate.rate:.1f} [{100 * rate.low:.1f}, {100 * rate.high:.1f}]"


def _planning(summary: Summary) -> str:
    return f"{summary.planning_p50:.2f} / {summary.planning_p99:.2f}"


def _failures(summary: Summary) -> str:
    kinds = (summary.collision, summary.stuck, summary.timeout)
    return " / ".join(f"{100 * kind.rate:.0f}" for kind in kinds)


@dataclass(frozen=True)
class PairedTest:
    """Successes of a method against those of the first method in the same trials.

    Attributes:
        scene: The scene.
        method: The method.
        baseline: The first method.
        pairs: Trials that both have.
        p_value: Of the exact McNemar test.
        p_adjusted: The same, after Holm's correction over all tests of the table.
    """

    scene: str
    method: str
    baseline: str
    pairs: int
    p_value: float
    p_adjusted: float


def table_one(trials: Trials, notes: Sequence[str] = ()) -> TableOne:
    """Fill the table.

    Args:
        trials: What was measured; scenes and methods keep their order.
        notes: More of them.
    """
    scenes, methods = _keys(trials)
    summaries = {key: summarise_trials(group) for key, group in trials.items()}
    tests = {(test.scene, test.method): test for test in paired_tests(trials)}
    printed = [m for m in methods if any(m in paper_table().get(scene, {}) for scene in scenes)]
    blocks = [
        Block(
            scene,
            [
                *(_row(metric, scene, methods, printed, summaries) for metric in _METRICS),
                *_test_row(tests, scene, methods, printed),
            ],
        )
        for scene in scenes
    ]
    columns = [*methods, *(f"{method} {PAPER_MARK}" for method in printed)]
    return TableOne(columns, blocks, [*_notes(tests, printed), *notes])


def paired_tests(trials: Trials) -> list[PairedTest]:
    """Every other method against the first one, scene by scene."""
    scenes, methods = _keys(trials)
    found = [
        (scene, method, *_pairs(trials[scene, methods[0]], trials[scene, method]))
        for scene in scenes
        for method in methods[1:]
        if (scene, method) in trials and (scene, methods[0]) in trials
    ]
    p_values = [mcnemar(a, b) for *_, a, b in found]
    return [
        PairedTest(scene, method, methods[0], len(a), p, adjusted)
        for (scene, method, a, _), p, adjusted in zip(found, p_values, holm(p_values), strict=True)
    ]


@cache
def paper_table() -> dict[str, dict[str, dict[str, float]]]:
    """The paper's own figures: scene, method, metric."""
    return tomllib.loads(resources.files(__package__).joinpath("paper_table.toml").read_text())


def _keys(trials: Trials) -> tuple[list[str], list[str]]:
    return list(dict.fromkeys(s for s, _ in trials)), list(dict.fromkeys(m for _, m in trials))


def _pairs(a: Sequence[Trial], b: Sequence[Trial]) -> tuple[list[bool], list[bool]]:
    """Successes in the trials that both have, matched by their seeds."""
    of_a, of_b = ({trial.seed: trial.success for trial in group} for group in (a, b))
    common = sorted(set(of_a) & set(of_b))
    return [of_a[seed] for seed in common], [of_b[seed] for seed in common]


def _row(
    metric: _Metric,
    scene: str,
    methods: Sequence[str],
    printed: Sequence[str],
    summaries: Mapping[tuple[str, str], Summary],
) -> Row:
    measured = [
        metric.text(summaries[scene, method]) if (scene, method) in summaries else "-"
        for method in methods
    ]
    paper = paper_table().get(scene, {})
    values = [paper.get(method, {}).get(metric.field) for method in printed]
    return Row(
        metric.label,
        [*measured, *("" if v is None else format(v, metric.paper_format) for v in values)],
    )


def _test_row(
    tests: Mapping[tuple[str, str], PairedTest],
    scene: str,
    methods: Sequence[str],
    printed: Sequence[str],
) -> list[Row]:
    """p-values of a scene; no row if nothing was compared."""
    if not tests:
        return []
    cells = [
        f"{tests[scene, method].p_adjusted:.3g}" if (scene, method) in tests else "-"
        for method in methods
    ]
    return [Row(f"p, success as {methods[0]}", [*cells, *("" for _ in printed)])]


def _notes(tests: Mapping[tuple[str, str], PairedTest], printed: Sequence[str]) -> list[str]:
    notes = [
        "Means are over successes, rates over all trials; brackets: 95 % Wilson intervals.",
        "Planning is wall time of decision and action layer on this machine, without perception.",
    ]
    if tests:
        notes.append("p: exact McNemar test of paired trials, Holm's correction over the table.")
    if printed:
        notes.append(
            f"{PAPER_MARK} printed in the paper: measured by its authors in other scenes, whose "
            "geometry is not published; not comparable with the columns beside."
        )
    return notes
