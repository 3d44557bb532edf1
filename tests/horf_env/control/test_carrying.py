"""What the QP makes of the twists with which planners carry the gripper."""

import numpy as np
import pytest

from horf_env.control import control_preset
from horf_env.planners.carrying import ARM_TUCKED, carrying_twist, posture_before
from horf_env.robot import ARM_READY, LIMITS, integrate
from horf_env.robot.bodies import collision_parts
from horf_env.robot.footprint import FOOTPRINT

NO_POINTS = np.zeros((0, 3))
SCALE = LIMITS["ld60"].twist_scale
DT = 0.05
# Within reach of the ready pose, at the height of the shoulder and level.
GOAL = np.eye(4)
GOAL[:3, :3] = [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]
GOAL[:3, 3] = [1.0, 0.3, 0.9]


def carry(make_tick, q, base, steps, posture=ARM_READY):
    """Configuration and velocity after some ticks in free space."""
    qp, velocity = control_preset("default").whole_body_qp(), np.zeros(9)
    for _ in range(steps):
        state = make_tick(q, NO_POINTS, np.zeros(6)).state
        twist = carrying_twist(state, posture, base, SCALE)
        tick = make_tick(
            q, NO_POINTS, twist, velocity=velocity, position_error=5.0, posture=posture
        )
        velocity = qp.solve(tick).velocity
        q = integrate(q, velocity, DT)
    return q, velocity


@pytest.mark.parametrize("base", [[0.8, 0.0], [0.6, 0.4], [0.0, -1.0]])
def test_the_base_does_what_it_is_told(make_tick, base):
    q = np.concatenate([np.zeros(3), ARM_READY])
    _, velocity = carry(make_tick, q, np.array(base), 60)
    np.testing.assert_allclose(velocity[:2], base, atol=0.05)
    assert np.abs(velocity[2:]).max() < 0.05


@pytest.mark.parametrize("base", [[0.8, 0.0], [0.6, 0.4], [0.0, -1.0]])
def test_the_arm_is_tucked_while_the_base_drives(make_tick, base):
    q = np.concatenate([np.zeros(3), ARM_READY])
    q, velocity = carry(make_tick, q, np.array(base), 100, ARM_TUCKED)
    np.testing.assert_allclose(velocity[:2], base, atol=0.05)
    np.testing.assert_allclose(q[3:], ARM_TUCKED, atol=0.05)


def test_the_tucked_arm_is_above_the_base(robot):
    """No part of it is before, behind or beside the body; the ready pose is 0.3 m before it."""
    state = robot.state(np.concatenate([np.zeros(3), ARM_TUCKED]))
    corners = [
        np.asarray(part.vertices) @ T[:3, :3].T + T[:3, 3]
        for body, T in zip(collision_parts()[1:], state.link_poses[1:], strict=True)
        for part in body
    ]
    arm = np.concatenate(corners)
    back, front, right, left = FOOTPRINT
    assert (arm.min(axis=0)[:2] > (back, right)).all()
    assert (arm.max(axis=0) < (front, left, 1.09)).all()


def test_a_wound_arm_unwinds_while_the_base_turns(make_tick):
    wound = ARM_READY + np.array([1.8, 0.3, 0.5, -0.5, 0.6, -0.4, 1.0])
    q, _ = carry(make_tick, np.concatenate([np.zeros(3), wound]), np.array([0.0, 0.8]), 120)
    np.testing.assert_allclose(q[3:], ARM_READY, atol=0.1)
    assert q[2] == pytest.approx(0.8 * 120 * DT, abs=0.6)


def test_twists_stay_within_their_range_far_from_the_posture(make_tick):
    q = np.concatenate([np.zeros(3), LIMITS["ld60"].arm_lower + 0.1])
    state = make_tick(q, NO_POINTS, np.zeros(6)).state
    twist = carrying_twist(state, ARM_READY, np.zeros(2), SCALE)
    assert np.abs(twist / SCALE).max() <= 0.8 + 1e-9


def test_before_a_goal_the_gripper_is_turned_as_the_goal_wants_it(robot):
    base = np.array([0.3, 0.0])
    arm = posture_before(GOAL, base, 0.1)
    facing = np.arctan2(GOAL[1, 3] - base[1], GOAL[0, 3] - base[0])
    T = robot.state(np.array([*base, facing, *arm])).T_world_ee
    np.testing.assert_allclose(T[:3, :3], GOAL[:3, :3], atol=0.01)
    np.testing.assert_allclose(T[:3, 3], [0.9, 0.3, 0.9], atol=0.002)


def test_low_goals_are_approached_from_above_what_stands_about(robot):
    low = GOAL.copy()
    low[2, 3] = 0.4
    low[:2, 3] = [0.9, 0.4]
    arm = posture_before(low, np.zeros(2), 0.1)
    facing = np.arctan2(0.4, 0.9)
    assert robot.state(np.array([0.0, 0.0, facing, *arm])).T_world_ee[2, 3] > 0.75


def test_the_ready_pose_where_no_posture_is_found():
    np.testing.assert_array_equal(posture_before(GOAL, np.array([-3.0, 0.0]), 0.1), ARM_READY)
