"""Statistics of comparisons: rates, paired tests, robust means and their intervals.

Everything here takes numbers and gives numbers; it knows no trial and no run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest, trim_mean

from horf_env.types import FloatArray

_CONFIDENCE = 0.95
_TAILS = (50.0 * (1.0 - _CONFIDENCE), 50.0 * (1.0 + _CONFIDENCE))  # percentiles
_TRIMMED = 0.25  # at each end: what is left is the interquartile mean
_RESAMPLES = 2000  # of a bootstrap; the end of a 95 % interval then varies by 2 % of its width


@dataclass(frozen=True)
class Share:
    """Part of the trials, with the Wilson interval of the rate behind it.

    Attributes:
        rate: In [0, 1].
        low: Lower end of the 95 % interval.
        high: Upper end.
    """

    rate: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{100 * self.rate:.0f} % [{100 * self.low:.0f}, {100 * self.high:.0f}]"


def share(k: int, n: int) -> Share:
    """Rate k of n with its Wilson interval.

    Args:
        k: Trials that count.
        n: All trials, at least 1.
    """
    interval = binomtest(k, n).proportion_ci(_CONFIDENCE, method="wilson")
    return Share(k / n, float(interval.low), float(interval.high))


def mcnemar(a: Sequence[bool], b: Sequence[bool]) -> float:
    """Exact two-sided McNemar test of paired successes.

    Args:
        a: Successes of one method.
        b: Successes of another in the same trials, in the same order.

    Returns:
        p-value of the hypothesis that both succeed equally often; 1 if no pair differs.

    Raises:
        ValueError: If the numbers of trials differ.
    """
    pairs = list(zip(a, b, strict=True))
    only_a, only_b = sum(x and not y for x, y in pairs), sum(y and not x for x, y in pairs)
    if only_a + only_b == 0:
        return 1.0
    return float(binomtest(only_a, only_a + only_b).pvalue)


def holm(p_values: Sequence[float]) -> list[float]:
    """p-values of a family of tests, adjusted by Holm's step-down method, in the same order."""
    order, adjusted, largest = np.argsort(p_values), [0.0] * len(p_values), 0.0
    for rank, k in enumerate(order):
        largest = max(largest, min(1.0, (len(p_values) - rank) * p_values[k]))
        adjusted[k] = largest
    return adjusted


def mean(runs: FloatArray) -> FloatArray:
    """Mean over runs and tasks.

    Args:
        runs: Shape (..., n_runs, n_tasks).

    Returns:
        Shape (...).
    """
    return np.asarray(runs.mean(axis=(-2, -1)))


def interquartile_mean(runs: FloatArray) -> FloatArray:
    """Mean of the middle half of all runs of all tasks (IQM); shapes as for `mean`."""
    flat = runs.reshape(*runs.shape[:-2], -1)
    return np.asarray(trim_mean(flat, _TRIMMED, axis=-1))


def bootstrap_interval(
    runs: FloatArray, statistic: Callable[[FloatArray], FloatArray], rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """95 % percentile interval of a statistic, from a stratified bootstrap.

    Runs are drawn again with replacement inside of each task (Agarwal et al. 2021). All numbers of
    a run, such as the points of its curve, are drawn together.

    Args:
        runs: Shape (n_points, n_runs, n_tasks).
        statistic: As `mean`.
        rng: Draws the runs.

    Returns:
        Lower and upper ends, shape (n_points,) each.
    """
    _, n_runs, n_tasks = runs.shape
    drawn = rng.integers(n_runs, size=(_RESAMPLES, n_runs, n_tasks))
    values = statistic(runs[:, drawn, np.arange(n_tasks)])
    low, high = np.percentile(values, _TAILS, axis=-1)
    return np.asarray(low), np.asarray(high)


def probability_of_improvement(a: FloatArray, b: FloatArray) -> float:
    """How likely a random run of a is better than one of b; ties count half; mean over tasks.

    Args:
        a: Shape (n_runs_a, n_tasks), larger is better.
        b: Shape (n_runs_b, n_tasks).
    """
    difference = a[:, None] - b[None, :]
    return float((0.5 * (1.0 + np.sign(difference))).mean())


def improvement_interval(
    a: FloatArray, b: FloatArray, rng: np.random.Generator
) -> tuple[float, float]:
    """95 % stratified bootstrap interval of `probability_of_improvement`.

    Args:
        a: Shape (n_runs_a, n_tasks).
        b: Shape (n_runs_b, n_tasks).
        rng: Draws the runs.
    """

    def drawn(runs: FloatArray) -> FloatArray:
        return np.take_along_axis(runs, rng.integers(len(runs), size=runs.shape), axis=0)

    values = [probability_of_improvement(drawn(a), drawn(b)) for _ in range(_RESAMPLES)]
    low, high = np.percentile(values, _TAILS)
    return float(low), float(high)
