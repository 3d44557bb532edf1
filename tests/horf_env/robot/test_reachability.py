"""Where the arm reaches a goal from, by inverse kinematics."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from horf_env.robot import ARM_READY, MobileManipulator
from horf_env.robot.inverse_kinematics import arm_ik
from horf_env.robot.limits import ARM_LOWER, ARM_UPPER
from horf_env.robot.reachability import joint_margin

LEVEL = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])  # along x, x axis up


def pose(axes, height, yaw=0.0, at=(0.0, 0.0)):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("z", yaw).as_matrix() @ axes
    T[:3, 3] = [*at, height]
    return T


def around(distance, directions, yaw=0.0, at=(0.0, 0.0)):
    """Places from which the goal lies in these directions [rad]."""
    angles = np.asarray(directions) + yaw
    return np.asarray(at) - distance * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def test_a_level_goal_at_shoulder_height_is_reached_from_the_side_only():
    ahead, side = joint_margin(pose(LEVEL, 0.65), around(0.75, [0.0, -np.pi / 3]))
    assert side > 0.4
    assert ahead < 0.1


def test_nothing_is_reached_from_afar_or_from_too_near():
    margins = joint_margin(pose(LEVEL, 0.65), np.concatenate([around(3.0, [0]), around(0.1, [0])]))
    assert (margins < 0).all()


def test_a_pose_that_no_way_from_the_ready_pose_leads_to_does_not_count():
    robot, goal = MobileManipulator.load(), pose(LEVEL, 0.4, -np.pi / 3, (0.45, 0.0))
    branch = np.array([0.05, 0.93, 0.53, -2.56, -1.6, 1.14, -2.12])
    arm = arm_ik(robot, np.zeros(3), goal, branch)
    assert arm is not None
    assert min((arm - ARM_LOWER).min(), (ARM_UPPER - arm).min()) > 0.4
    assert joint_margin(goal, np.zeros((1, 2)))[0] < 0.0


@pytest.mark.parametrize("yaw", [0.7, -2.5])
def test_turns_and_moves_with_the_goal(yaw):
    directions = np.linspace(-3.0, 3.0, 13)
    here = joint_margin(pose(LEVEL, 1.0), around(0.8, directions))
    at = (4.0, -2.0)
    there = joint_margin(pose(LEVEL, 1.0, yaw, at), around(0.8, directions, yaw, at))
    np.testing.assert_allclose(here, there, atol=1e-9)


def test_inverse_kinematics_finds_the_pose_again():
    robot = MobileManipulator.load()
    arm = ARM_READY + 0.3
    base = np.array([1.0, 2.0, 0.5])
    goal = robot.state(np.concatenate([base, arm])).T_world_ee
    found = arm_ik(robot, base, goal, ARM_READY)
    assert found is not None
    reached = robot.state(np.concatenate([base, found])).T_world_ee
    np.testing.assert_allclose(reached, goal, atol=6e-3)


def test_inverse_kinematics_says_so_where_there_is_none():
    robot = MobileManipulator.load()
    assert arm_ik(robot, np.zeros(3), pose(LEVEL, 0.7, at=(3.0, 0.0)), ARM_READY) is None
