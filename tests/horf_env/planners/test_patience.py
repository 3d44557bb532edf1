"""When a motion counts as stuck."""

from horf_env.planners.patience import Patience

MOVING = 1.0  # m/s


def test_is_exhausted_after_so_many_steps_without_progress():
    patience = Patience(3)
    assert [patience.exhausted(1.0, MOVING) for _ in range(4)] == [False, False, False, True]


def test_progress_renews_it():
    patience = Patience(3)
    assert not any(patience.exhausted(1.0 - 0.05 * k, MOVING) for k in range(20))


def test_crawling_is_no_progress():
    patience = Patience(3)
    assert any(patience.exhausted(1.0 - 0.001 * k, MOVING) for k in range(20))


def test_a_way_that_is_unknown_is_no_progress():
    patience = Patience(2)
    assert [patience.exhausted(float("inf"), MOVING) for _ in range(2)] == [False, True]


def test_standing_still_exhausts_it_sooner():
    patience = Patience(1000)
    assert [patience.exhausted(1.0, speed=0.01) for _ in range(20)].index(True) == 19
    moved = Patience(1000)
    assert not any(moved.exhausted(1.0, speed=MOVING if k % 10 == 0 else 0.0) for k in range(100))
