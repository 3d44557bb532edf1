"""The numbers of a report: final table, probability of improvement."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from horf_env.types import FloatArray

from .run_results import OUTCOMES, Group
from .statistics import (
    bootstrap_interval,
    improvement_interval,
    interquartile_mean,
    mean,
    probability_of_improvement,
)

_SEED = 0  # of the bootstrap: the same report from the same runs
_SECONDS = 3600.0  # of an hour


@dataclass(frozen=True)
class FinalRow:
    """A group at the end of its runs, as text.

    Attributes:
        label: The group.
        runs: Runs with an evaluation at the end, of all.
        success: Mean success rate over runs with its interval [%].
        outcomes: Episodes by outcome.
        mean_return: Mean over runs.
        iqm_return: IQM over runs, with its interval.
        speed: Steps a second, evaluations included.
        hours: Mean wall time of a run [h].
        q_bias: Mean normalised bias of Q over runs.
    """

    label: str
    runs: str
    success: str
    outcomes: str
    mean_return: str
    iqm_return: str
    speed: str
    hours: str
    q_bias: str


@dataclass(frozen=True)
class Improvement:
    """How likely a run of one group has a larger final return than one of another.

    Attributes:
        better: One group.
        worse: The other.
        probability: In [0, 1]; 0.5 for no difference.
        low: Lower end of the 95 % interval.
        high: Upper end.
    """

    better: str
    worse: str
    probability: float
    low: float
    high: float


def interval(
    values: FloatArray, statistic: Callable[[FloatArray], FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A statistic over runs with its 95 % bootstrap interval.

    Args:
        values: Shape (n_runs,), or (n_points, n_runs, 1).
        statistic: As `statistics.mean`.

    Returns:
        Value and ends of the interval, shape () or (n_points,).
    """
    runs = values[None, :, None] if values.ndim == 1 else values
    low, high = bootstrap_interval(runs, statistic, np.random.default_rng(_SEED))
    middle = statistic(runs)
    return (middle[0], low[0], high[0]) if values.ndim == 1 else (middle, low, high)


def final_rows(groups: Sequence[Group]) -> list[FinalRow]:
    """The final table."""
    return [_row(group) for group in groups]


def pairs(groups: Sequence[Group]) -> list[Improvement]:
    """Probability of improvement of each pair of groups that have ended, by final return."""
    ended = [
        (g.label, np.array([[run.final_return] for run in g.ended])) for g in groups if g.ended
    ]
    rng = np.random.default_rng(_SEED)
    return [
        Improvement(
            better, worse, probability_of_improvement(a, b), *improvement_interval(a, b, rng)
        )
        for (better, a), (worse, b) in combinations(ended, 2)
    ]


def _row(group: Group) -> FinalRow:
    ended = group.ended
    success = np.array([100.0 * run.final_success for run in ended])
    returns = np.array([run.final_return for run in ended])
    counts = [sum(run.outcomes()[name] for run in ended) for name in OUTCOMES]
    hours = float(np.mean([run.hours for run in group.runs]))
    seconds = _SECONDS * sum(run.hours for run in group.runs)
    biases = [run.bias for run in group.runs if run.bias is not None]
    return FinalRow(
        label=group.label,
        runs=f"{len(ended)} of {len(group.runs)}",
        success=_with_interval(success, mean, 0),
        outcomes=" / ".join(map(str, counts)) if ended else "-",
        mean_return=f"{returns.mean():.1f}" if ended else "-",
        iqm_return=_with_interval(returns, interquartile_mean, 1),
        speed=f"{sum(run.steps for run in group.runs) / seconds:.1f}" if seconds else "-",
        hours=f"{hours:.2f}",
        q_bias=f"{np.mean(biases):+.2f}" if biases else "-",
    )


def _with_interval(
    values: FloatArray, statistic: Callable[[FloatArray], FloatArray], digits: int
) -> str:
    if not len(values):
        return "-"
    middle, low, high = interval(values, statistic)
    return f"{middle:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"
