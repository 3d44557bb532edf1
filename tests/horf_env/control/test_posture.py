"""The default objective: the base faces the end effector, the arm returns, changes cost."""

import numpy as np
from scipy.spatial.transform import Rotation

from horf_env.control import control_preset
from horf_env.control.posture import PostureObjective
from horf_env.robot import ARM_READY, LIMITS, integrate

QR = np.concatenate([np.zeros(3), ARM_READY])
NO_POINTS = np.zeros((0, 3))
STILL = np.zeros(6)
DT = 0.05


def minimiser(terms):
    return -terms.linear / terms.weights


def drive(make_tick, q, twist_of, steps):
    """Configuration after some ticks in free space; `twist_of` gives the twist of a state."""
    qp, velocity = control_preset("default").whole_body_qp(), np.zeros(9)
    tick = make_tick(q, NO_POINTS, STILL)
    for _ in range(steps):
        tick = make_tick(q, NO_POINTS, twist_of(tick.state), velocity=velocity, position_error=5.0)
        velocity = qp.solve(tick).velocity
        q = integrate(q, velocity, DT)
    return q


def test_prefers_to_face_the_end_effector_and_to_get_the_arm_ready(make_tick):
    q = QR.copy()
    q[3] = 0.8  # the arm looks to the left of the base
    objective = PostureObjective(base_change_weight=0.0, arm_change_weight=0.0)
    preferred = minimiser(objective.terms(make_tick(q, NO_POINTS, STILL)))
    assert preferred[0] == 0.0
    assert preferred[1] > 0.5
    np.testing.assert_allclose(preferred[2:], [-0.8, 0, 0, 0, 0, 0, 0], atol=1e-9)


def test_the_arm_goes_back_to_the_posture_of_the_tick(make_tick):
    posture = ARM_READY + np.linspace(-0.3, 0.3, 7)
    objective = PostureObjective(base_change_weight=0.0, arm_change_weight=0.0)
    preferred = minimiser(objective.terms(make_tick(QR, NO_POINTS, STILL, posture=posture)))
    np.testing.assert_allclose(preferred[2:], posture - ARM_READY, atol=1e-9)


def test_a_far_arm_does_not_jerk_back(make_tick):
    q = QR.copy()
    q[3] = 2.5
    objective = PostureObjective(base_change_weight=0.0, arm_change_weight=0.0)
    assert minimiser(objective.terms(make_tick(q, NO_POINTS, STILL)))[2] == -1.0


def test_changes_of_the_velocity_cost(make_tick):
    velocity = np.linspace(-0.4, 0.4, 9)
    tick = make_tick(QR, NO_POINTS, STILL, velocity=velocity)
    weights = {"base_change_weight": 0.1, "arm_change_weight": 0.3}
    with_change = PostureObjective(**weights).terms(tick)
    without = PostureObjective(base_change_weight=0.0, arm_change_weight=0.0).terms(tick)

    def cost(x):
        a, b = ((0.5 * t.weights * x + t.linear) @ x for t in (with_change, without))
        return a - b

    difference = cost(velocity + 0.1) - cost(velocity)
    np.testing.assert_allclose(difference, 0.5 * 0.01 * (2 * 0.1 + 7 * 0.3))


def test_the_base_turns_to_where_the_end_effector_is_led(make_tick):
    def around(state):
        """Lead the end effector around the base, upright, at 0.5 rad/s."""
        x, y = (state.T_world_ee[:3, 3] - state.T_world_base[:3, 3]) @ state.T_world_base[:3, :2]
        return np.array([-0.5 * y, 0.5 * x, 0.0, 0.0, 0.0, 0.5])

    q = drive(make_tick, QR, around, 120)
    assert q[2] > 2.5  # of 3 rad
    np.testing.assert_allclose(q[3:], ARM_READY, atol=0.35)


def test_the_arm_unwinds_while_the_end_effector_stands_still(make_tick, robot):
    q = QR.copy()
    q[3:] += np.array([0.0, 0.2, 0.9, 0.1, -0.9, 0.0, 0.3])
    goal = robot.state(q).T_world_ee

    def hold(state):
        """Pull the end effector back to where it was."""
        R = state.T_world_base[:3, :3]
        turn = Rotation.from_matrix(goal[:3, :3] @ state.T_world_ee[:3, :3].T).as_rotvec()
        return np.concatenate([R.T @ (goal[:3, 3] - state.T_world_ee[:3, 3]), R.T @ turn])

    after = drive(make_tick, q, hold, 200)
    # The held orientation keeps it from returning all the way.
    assert np.linalg.norm(after[3:] - ARM_READY) < 0.75 * np.linalg.norm(q[3:] - ARM_READY)
    assert abs(after[5]) < 0.5 * 0.9  # the elbow
    moved = robot.state(after).T_world_ee[:3, 3] - goal[:3, 3]
    assert np.linalg.norm(moved) < 0.05
    assert (np.abs(after[3:] - LIMITS["ld60"].arm_lower) > 0.1).all()
