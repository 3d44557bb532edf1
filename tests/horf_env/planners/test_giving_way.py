"""A base that is held gives way for a while, one that moves does not."""

import numpy as np

from horf_env.planners.giving_way import GivingWay

STILL, DRIVING, TURNING = np.zeros(2), np.array([0.4, 0.0]), np.array([0.0, 0.5])


def steps_of(speed, velocities):
    giving_way = GivingWay()
    return [giving_way.update(speed, velocity) for velocity in velocities]


def test_gives_way_after_ten_steps_without_motion():
    answers = steps_of(0.5, [STILL] * 10 + [DRIVING] * 30)
    assert answers == [0.0] * 9 + [-1.0] * 16 + [0.0] * 15


def test_goes_ahead_where_it_cannot_go_back():
    answers = steps_of(0.5, [STILL] * 20 + [DRIVING] * 20)
    assert answers == [0.0] * 9 + [-1.0] * 10 + [1.0] * 16 + [0.0] * 5


def test_does_something_else_where_it_can_neither_go_back_nor_ahead():
    answers = steps_of(0.5, [STILL] * 40)
    assert answers == [0.0] * 9 + [-1.0] * 10 + [1.0] * 10 + [0.0] * 10 + [-1.0]


def test_does_not_while_it_drives():
    assert not any(steps_of(0.5, [STILL] * 9 + [DRIVING] + [STILL] * 9))


def test_a_turn_on_the_spot_is_a_motion():
    assert not any(steps_of(0.0, [TURNING] * 40))


def test_a_turn_is_none_where_the_base_is_to_drive():
    assert any(steps_of(0.5, [TURNING] * 40))


def test_a_blocked_turn_on_the_spot_gives_way():
    assert any(steps_of(0.0, [STILL] * 10))
