import pytest
from horf_cli.episodes import Trial
from horf_cli.statistics import share, summarise_trials


def trial(failure="", length=1.0):
    return Trial(
        method="m",
        scene="s",
        instance=0,
        success=not failure,
        failure=failure,
        steps=10,
        episode_return=0.0,
        execution_time=0.5,
        path_length_base=length,
        path_length_ee=2 * length,
        mean_ee_speed=4 * length,
        min_distance=0.05,
    )


def test_wilson_interval_of_95_of_100():
    # 95 % Wilson score interval, worked out by hand: (0.8883, 0.9785).
    found = share(95, 100)
    assert (found.low, found.high) == pytest.approx((0.8883, 0.9785), abs=1e-4)
    assert str(found) == "95 % [89, 98]"


def test_no_success_in_five_is_not_a_proof_of_zero():
    assert share(0, 5).high == pytest.approx(1.96**2 / (5 + 1.96**2), abs=1e-3)


def test_rates_count_all_trials_and_means_successes_only():
    found = summarise_trials([trial(), trial(length=3.0), trial("collision"), trial("timeout", 99)])
    assert (found.success.rate, found.collision.rate, found.timeout.rate) == (0.5, 0.25, 0.25)
    assert found.path_length_base == 2.0
    assert found.path_length_ee == 4.0
    assert found.trials == 4


def test_no_success_no_means():
    found = summarise_trials([trial("collision")])
    assert found.execution_time is None
