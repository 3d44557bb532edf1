"""When a motion counts as stuck."""

from horf_env.planners.patience import Patience


def test_is_exhausted_after_so_many_steps_without_progress():
    patience = Patience(3)
    assert [patience.exhausted(1.0) for _ in range(4)] == [False, False, False, True]


def test_progress_renews_it():
    patience = Patience(3)
    assert not any(patience.exhausted(1.0 - 0.05 * k) for k in range(20))


def test_crawling_is_no_progress():
    patience = Patience(3)
    assert any(patience.exhausted(1.0 - 0.001 * k) for k in range(20))


def test_a_way_that_is_unknown_is_no_progress():
    patience = Patience(2)
    assert [patience.exhausted(float("inf")) for _ in range(2)] == [False, True]
