"""Jacobians against central differences, for random configurations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from horf_env.errors import ConfigurationError
from horf_env.robot import ARM_READY, LIMITS, integrate, point_jacobian
from horf_env.robot.manipulability import manipulability, manipulability_gradient

STEP = 1e-6


def random_configurations(n, seed=0):
    rng = np.random.default_rng(seed)
    limits = LIMITS["ld60"]
    for _ in range(n):
        arm = rng.uniform(limits.arm_lower, limits.arm_upper)
        yield np.concatenate([rng.uniform(-3, 3, 3), arm])


def moved(configuration, direction, sign):
    """The configuration after a small time at unit velocity in one direction."""
    return integrate(configuration, sign * np.eye(9)[direction], STEP)


def test_ee_jacobian_matches_central_differences(robot):
    for q in random_configurations(5):
        J = robot.ee_jacobian(q)
        R_base = robot.link_poses(q)[0, :3, :3]
        for i in range(9):
            plus, minus = robot.ee_pose(moved(q, i, 1)), robot.ee_pose(moved(q, i, -1))
            linear = (plus[:3, 3] - minus[:3, 3]) / (2 * STEP)
            rotation = Rotation.from_matrix(plus[:3, :3] @ minus[:3, :3].T)
            angular = rotation.as_rotvec() / (2 * STEP)
            expected = np.concatenate([R_base.T @ linear, R_base.T @ angular])
            np.testing.assert_allclose(J[:, i], expected, atol=1e-7)


@pytest.mark.parametrize("body", range(9))
def test_point_jacobian_matches_central_differences(robot, body):
    point_in_body = np.array([0.07, -0.03, 0.11])

    def position(q):
        T = robot.link_poses(q)[body]
        return T[:3, :3] @ point_in_body + T[:3, 3]

    for q in random_configurations(3, seed=body):
        J = point_jacobian(robot.state(q), body, position(q))
        numeric = [
            (position(moved(q, i, 1)) - position(moved(q, i, -1))) / (2 * STEP) for i in range(9)
        ]
        np.testing.assert_allclose(J, np.transpose(numeric), atol=1e-7)


def test_manipulability_gradient_matches_central_differences(robot):
    def measure(q):
        return manipulability(robot.ee_jacobian(q)[:, 2:])

    for q in random_configurations(5, seed=3):
        gradient = manipulability_gradient(robot.ee_jacobian(q)[:, 2:])
        steps = STEP * np.eye(10)[3:]
        numeric = [(measure(q + s) - measure(q - s)) / (2 * STEP) for s in steps]
        np.testing.assert_allclose(gradient, numeric, atol=1e-7)


def test_manipulability_gradient_is_zero_at_a_singular_arm(robot):
    stretched = np.zeros(10)
    stretched[6] = 0.0
    J = robot.state(stretched, overshoot=True).ee_jacobian[:, 2:]
    J[:, 3] = 0.0
    J[:, 4] = J[:, 6]
    gradient = manipulability_gradient(J)
    assert np.isfinite(gradient).all()


def test_ready_pose_reaches_ahead_with_the_tool_down(robot):
    pose = robot.ee_pose(np.concatenate([np.zeros(3), ARM_READY]))
    assert 0.55 < pose[0, 3] < 0.75
    assert abs(pose[1, 3]) < 1e-6  # the URDF rounds angles to 8 digits
    assert pose[2, 2] < -0.99


def test_a_configuration_of_another_shape_is_refused(robot):
    with pytest.raises(ConfigurationError, match=r"expected shape \(10,\), got \(9,\)"):
        robot.state(np.zeros(9))
    with pytest.raises(ConfigurationError, match="expected finite numbers"):
        robot.state(np.full(10, np.nan))


def test_joints_beyond_their_limits_are_named_unless_motors_may_have_overshot(robot):
    q = np.concatenate([[50.0, -50.0, 9.0], ARM_READY])
    assert robot.state(q).configuration[0] == 50.0  # the base has no limits
    for joint, value in ((3, 3.0), (6, -4.0)):
        outside = q.copy()
        outside[joint] = value
        with pytest.raises(ConfigurationError, match=f"'panda_joint{joint - 2}': {value:g} is out"):
            robot.state(outside)
        assert robot.state(outside, overshoot=True).configuration[joint] == value


def test_arc_of_half_steps_equals_the_whole_and_a_turn_closes():
    q, velocity = np.zeros(10), np.array([0.7, 1.3, *np.linspace(-1, 1, 7)])
    half = integrate(integrate(q, velocity, 0.1), velocity, 0.1)
    np.testing.assert_allclose(half, integrate(q, velocity, 0.2), atol=1e-13)
    circle = integrate(q, np.array([1.0, 1.0, *np.zeros(7)]), 2 * np.pi)
    np.testing.assert_allclose(circle[:2], 0, atol=1e-12)
    straight = integrate(q, np.array([1.0, 1e-9, *np.zeros(7)]), 1.0)
    np.testing.assert_allclose(straight[:2], [1.0, 0.5e-9], atol=1e-12)
