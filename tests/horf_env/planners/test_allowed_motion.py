"""What of a motion of the base the rows of the QP let through."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from horf_env.control import ControlPreset
from horf_env.control.avoidance import allowed_approach
from horf_env.planners.allowed_motion import allowed_motion
from horf_env.robot.footprint import BASE_HEIGHT, FOOTPRINT, GUARDED_HEIGHT

BRAKING = 0.5
FRONT, SIDE = FOOTPRINT[1], FOOTPRINT[3]
HERE = np.eye(4)


def at(x, y, z=0.2):
    return np.array([[x, y, z]])


def allowed(points, speed, turn, pose=HERE):
    return allowed_motion(points, pose, speed, turn, BRAKING)


def test_what_is_far_away_hangs_higher_or_lies_behind_takes_nothing_off():
    for points in (np.empty((0, 3)), at(3.0, 0.0), at(FRONT + 0.1, 0.0, z=0.44), at(-0.8, 0.0)):
        assert allowed(points, 0.5, 0.2) == (0.5, 0.2)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_drives_as_fast_as_the_row_of_the_nearest_point_allows(direction):
    outline = FRONT if direction > 0.0 else -FOOTPRINT[0]
    points = at(direction * (outline + 0.15), 0.0)
    expected = allowed_approach(0.10, 2.0, BRAKING, 0.05)
    speed, turn = allowed(points, direction * 1.0, 0.0)
    assert speed == pytest.approx(direction * expected)
    assert turn == 0.0


def test_keeps_a_turn_and_gives_up_speed_for_it():
    """A turn to the left takes the front left corner to the left."""
    corner = at(FRONT + 0.08, SIDE + 0.08)
    straight, _ = allowed(corner, 0.5, 0.0)
    speed, turn = allowed(corner, 0.5, 0.1)
    assert turn == 0.1
    assert 0.0 <= speed < straight


def test_turns_less_where_no_speed_allows_the_turn():
    beside = at(0.3, SIDE + 0.06)
    speed, turn = allowed(beside, 0.0, 1.0)
    assert speed == 0.0
    assert turn in (0.0, 0.25, 0.5, 0.75)


def test_asks_for_everything_where_nothing_is_allowed():
    beside = at(0.0, SIDE + 0.01)
    assert allowed(beside, 0.5, 0.0) == (0.5, 0.0)


def test_sees_points_from_where_the_base_stands():
    c, s = np.cos(2.0), np.sin(2.0)
    pose = np.array([[c, -s, 0, 3.0], [s, c, 0, -1.0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    points = at(FRONT + 0.15, 0.05)
    moved = points @ pose[:3, :3].T + pose[:3, 3]
    np.testing.assert_allclose(allowed(moved, 1.0, 0.3, pose), allowed(points, 1.0, 0.3))


def test_what_is_kept_off_the_base_is_its_height_and_the_margin_of_the_qp():
    assert pytest.approx(BASE_HEIGHT + ControlPreset.margin) == GUARDED_HEIGHT


numbers = st.floats(-1.5, 1.5)


@given(st.lists(st.tuples(numbers, numbers), max_size=6), numbers, numbers)
def test_never_more_than_asked_for_and_never_the_other_way(places, speed, turn):
    points = np.array([[x, y, 0.2] for x, y in places]).reshape(-1, 3)
    v, w = allowed(points, speed, turn)
    assert 0.0 <= v * np.sign(speed) <= abs(speed)
    assert 0.0 <= w * np.sign(turn) <= abs(turn)
