import numpy as np
import pytest
from horf_cli.statistics import (
    bootstrap_interval,
    holm,
    improvement_interval,
    interquartile_mean,
    mcnemar,
    mean,
    probability_of_improvement,
    share,
)
from scipy.stats import binom, mannwhitneyu


def test_wilson_interval_of_95_of_100():
    # 95 % Wilson score interval, worked out by hand: (0.8883, 0.9785).
    found = share(95, 100)
    assert (found.low, found.high) == pytest.approx((0.8883, 0.9785), abs=1e-4)
    assert str(found) == "95 % [89, 98]"


def test_no_success_in_five_is_not_a_proof_of_zero():
    assert share(0, 5).high == pytest.approx(1.96**2 / (5 + 1.96**2), abs=1e-3)


def test_mcnemar_looks_at_the_pairs_that_differ_only():
    a = [True] * 9 + [False] * 1 + [True] * 40
    b = [False] * 9 + [True] * 1 + [True] * 40
    # Two-sided binomial test of 1 in 10, worked out by its definition.
    assert mcnemar(a, b) == pytest.approx(2 * binom.cdf(1, 10, 0.5))
    assert mcnemar(a[10:], b[10:]) == 1.0
    with pytest.raises(ValueError, match="zip"):
        mcnemar(a, b[1:])


def test_holm_steps_down_and_keeps_the_order():
    # Sorted: 0.01 x 4, 0.02 x 3, 0.03 x 2, 0.5 x 1; none below the one before it.
    assert holm([0.03, 0.01, 0.5, 0.02]) == pytest.approx([0.06, 0.04, 0.5, 0.06])
    assert holm([0.4, 0.9]) == pytest.approx([0.8, 0.9])
    assert holm([]) == []


@pytest.fixture
def runs():
    """Points of the curves of 8 runs of 3 tasks, shape (5, 8, 3)."""
    return np.random.default_rng(0).normal(size=(5, 8, 3)) + np.arange(3)


def test_interquartile_mean_is_that_of_the_middle_half(runs):
    middle = np.sort(runs[2].ravel())[6:18]
    assert interquartile_mean(runs)[2] == pytest.approx(middle.mean())
    outlier = runs.copy()
    outlier[2].flat[runs[2].argmax()] = 1e9
    assert interquartile_mean(outlier)[2] == interquartile_mean(runs)[2]


def test_bootstrap_interval_of_a_mean_is_that_of_the_normal_distribution():
    values = np.random.default_rng(1).normal(size=(1, 400, 1))
    low, high = bootstrap_interval(values, mean, np.random.default_rng(2))
    half = 1.96 * values.std() / 20
    expected = (values.mean() - half, values.mean() + half)
    assert (low[0], high[0]) == pytest.approx(expected, abs=0.1 * half)


def test_bootstrap_draws_inside_of_tasks_and_keeps_runs_whole():
    # Tasks differ, runs of a task do not: whatever is drawn, the mean is the same.
    same = np.broadcast_to([1.0, 5.0], (3, 6, 2))
    low, high = bootstrap_interval(same, mean, np.random.default_rng(0))
    np.testing.assert_allclose([low, high], 3.0)
    # The second point of every run is the first plus 1: so are the ends of the intervals.
    curve = np.random.default_rng(0).normal(size=(1, 6, 2))
    low, high = bootstrap_interval(np.vstack([curve, curve + 1.0]), mean, np.random.default_rng(0))
    np.testing.assert_allclose([low[1] - low[0], high[1] - high[0]], 1.0)


def test_probability_of_improvement_is_that_of_mann_and_whitney(runs):
    a, b = runs[0, :, :1], runs[1, :5, :1]
    expected = mannwhitneyu(a[:, 0], b[:, 0]).statistic / a.size / b.size
    assert probability_of_improvement(a, b) == pytest.approx(expected)
    assert probability_of_improvement(a, a) == 0.5
    low, high = improvement_interval(a, b, np.random.default_rng(0))
    assert low < expected < high


def test_agrees_with_rliable(runs):
    metrics = pytest.importorskip("rliable.metrics", reason="rliable is archived: its own pins")
    library = pytest.importorskip("rliable.library")
    np.testing.assert_allclose(
        interquartile_mean(runs), [metrics.aggregate_iqm(point) for point in runs]
    )
    assert probability_of_improvement(runs[0], runs[1]) == pytest.approx(
        metrics.probability_of_improvement(runs[0], runs[1])
    )
    _, theirs = library.get_interval_estimates(
        {"a": runs[0]}, lambda scores: np.array([metrics.aggregate_iqm(scores)]), reps=2000
    )
    ours = bootstrap_interval(runs[:1], interquartile_mean, np.random.default_rng(0))
    np.testing.assert_allclose(np.ravel(ours), np.ravel(theirs["a"]), atol=0.05)
