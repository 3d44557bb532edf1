"""Hints from the goal and the robot's own map."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from horf_env.perception import GUIDE_SIZE, Guide

NOTHING = np.empty((0, 3))
START = np.zeros(2)
LEVEL = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])  # along x, x axis up


def goal(x, y, z=1.0):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = LEVEL, [x, y, z]
    return T


def base(x=0.0, y=0.0, yaw=0.0):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("z", yaw).as_matrix()
    T[:2, 3] = [x, y]
    return T


def wall(x, least_y, greatest_y, z=0.2):
    y = np.arange(least_y, greatest_y, 0.05)
    return np.stack([np.full_like(y, x), y, np.full_like(y, z)], axis=1)


class Space:
    """Everything was looked at; there are these points."""

    def __init__(self, points=NOTHING):
        self._points = points

    def surfaces(self, place):
        return self._points

    def seen(self, points):
        return np.ones(len(points), dtype=bool)


def guide_to(goal, points=NOTHING):
    return Guide(goal, START, Space(points))


def bearing(view):
    return np.arctan2(view[10], view[9])


@pytest.mark.parametrize("yaw", [0.0, 0.8, -2.0])
def test_the_goal_in_the_axes_of_the_base(yaw):
    view = guide_to(goal(2.0, 1.0)).view(base(0.5, 0.5, yaw))
    assert view.shape == (GUIDE_SIZE,)
    R = base(yaw=yaw)[:3, :3]
    np.testing.assert_allclose(R @ view[:3], [1.5, 0.5, 1.0], atol=1e-12)
    np.testing.assert_allclose(R @ view[3:6], LEVEL[:, 2], atol=1e-12)
    np.testing.assert_allclose(R @ view[6:9], LEVEL[:, 0], atol=1e-12)


@pytest.mark.parametrize("yaw", [0.0, 1.5])
def test_in_free_space_the_way_leads_to_a_goal_beyond_the_map(yaw):
    view = guide_to(goal(8.0, 0.0)).view(base(yaw=yaw))
    assert -yaw - 0.3 < bearing(view) < 0.3 - 0.4 * yaw  # turns on its way
    assert 0.7 < view[11] < 1.0
    assert view[12] > 7.0


def test_goes_around_a_wall():
    open_way = guide_to(goal(8.0, 0.0)).view(base())
    blocked = guide_to(goal(8.0, 0.0), wall(1.0, -0.5, 3.0)).view(base())
    assert bearing(blocked) < -0.5
    assert blocked[12] > open_way[12] + 0.5


def test_what_hangs_above_the_arm_is_passed_under():
    free = guide_to(goal(8.0, 0.0)).view(base())
    under = guide_to(goal(8.0, 0.0), wall(1.0, -3.0, 3.0, z=1.4)).view(base())
    np.testing.assert_array_equal(under, free)


def test_what_hangs_lower_than_the_margin_above_the_base_is_gone_around():
    hanging = guide_to(goal(8.0, 0.0), wall(1.0, -0.5, 3.0, z=0.4)).view(base())
    standing = guide_to(goal(8.0, 0.0), wall(1.0, -0.5, 3.0)).view(base())
    np.testing.assert_array_equal(hanging, standing)


def test_ends_where_the_arm_reaches_the_goal():
    guide, pose = guide_to(goal(1.5, 0.0)), base()
    for _ in range(20):
        view = guide.view(pose)
        pose[:2, 3] += view[9:11]
    assert view[11] < 0.15
    assert 0.4 < np.hypot(1.5 - pose[0, 3], pose[1, 3]) < 1.2


def test_costs_fall_along_the_way():
    guide, pose = guide_to(goal(8.0, 0.0), wall(1.0, -0.5, 3.0)), base()
    costs = []
    for _ in range(5):
        view = guide.view(pose)
        costs.append(view[12])
        pose[:2, 3] += view[9:11]
    assert (np.diff(costs) < 0.0).all()
