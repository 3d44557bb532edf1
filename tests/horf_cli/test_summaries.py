import pytest
from horf_cli.summaries import summarise_trials


def test_rates_count_all_trials_and_means_successes_only(make_trial):
    trials = [make_trial(), make_trial(length=3.0), make_trial("collision"), make_trial("stuck", 9)]
    found = summarise_trials(trials)
    rates = (found.success, found.collision, found.stuck, found.timeout)
    assert [rate.rate for rate in rates] == [0.5, 0.25, 0.25, 0.0]
    assert found.path_length_base == 2.0
    assert found.path_length_ee == 4.0
    assert found.total_time == 0.75
    assert found.trials == 4
    assert found.unsolved == 4


def test_no_success_no_means(make_trial):
    found = summarise_trials([make_trial("collision")])
    assert found.execution_time is None
    assert found.spl == 0.0


def test_spl_counts_failures_and_needs_a_reference(make_trial):
    found = summarise_trials([make_trial(), make_trial(length=2.0), make_trial("timeout")])
    assert found.spl == pytest.approx((1.0 + 0.5 + 0.0) / 3)
    assert summarise_trials([make_trial(spl=None)]).spl is None


def test_planning_and_clearance_are_of_all_trials(make_trial):
    trials = [
        make_trial("timeout", planning_p50=p50, planning_p99=10 * p50, min_distance=d)
        for p50, d in ((1.0, 0.0), (2.0, 0.1), (6.0, 0.1))
    ]
    found = summarise_trials(trials)
    assert (found.planning_p50, found.planning_p99) == (2.0, 20.0)
    assert found.clearance_p5 == pytest.approx(0.01)
