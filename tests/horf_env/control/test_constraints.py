"""Bounds, avoidance rows and objective, each against a hand calculation or finite differences."""

import numpy as np
import pytest

from horf_env.control.avoidance import PUSH_OUT_SPEED, Avoidance, allowed_approach
from horf_env.control.bounds import (
    RobotBounds,
    combined_bounds,
    damp_joints,
    limit_change,
    limit_speed,
    limit_turn,
)
from horf_env.control.objective import ScaledObjective
from horf_env.robot import ARM_READY, LIMITS, integrate
from horf_env.robot.manipulability import manipulability

QR = np.concatenate([np.zeros(3), ARM_READY])
NO_POINTS = np.zeros((0, 3))
STILL = np.zeros(6)


def unbounded():
    return np.array([[-np.inf] * 9, [np.inf] * 9])


def test_dampers_slow_down_towards_a_limit_and_pull_back_from_beyond():
    limits, box = LIMITS["ld60"], unbounded()
    q = QR.copy()
    q[3] = limits.arm_upper[0] - 0.5  # inside the influence distance
    q[4] = limits.arm_upper[1] + 0.05  # beyond the limit
    damp_joints(box, q, limits.arm_lower, limits.arm_upper, 1.0 / 0.8, 0.9, 0.1)
    lower, upper = box
    assert upper[2] == pytest.approx((0.5 - 0.1) / (0.9 - 0.1))
    assert lower[2] == -np.inf
    assert upper[3] == pytest.approx((-0.05 - 0.1) / 0.8)
    assert np.isinf(upper[:2]).all()


def test_speeds_and_their_changes_are_limited():
    speed, change = unbounded(), unbounded()
    limit_speed(speed, np.arange(9.0))
    np.testing.assert_array_equal(speed, [-np.arange(9.0), np.arange(9.0)])
    limit_change(change, np.arange(9.0), np.full(9, 2.0), 0.5)
    np.testing.assert_array_equal(change, [np.arange(9.0) - 1.0, np.arange(9.0) + 1.0])


def test_earlier_bounds_win_where_nothing_is_left(make_tick):
    velocity = np.array([1.8, 0.0, 2.0, *np.zeros(6)])
    q = QR.copy()
    q[3] = LIMITS["ld60"].arm_upper[0] - 0.1  # the damper says 0, the brakes say 1.25
    tick = make_tick(q, NO_POINTS, STILL, velocity=velocity)
    bounds = RobotBounds(gain=1.0, influence=0.9, stopping=0.1)
    lower, upper = combined_bounds([bounds], tick)
    assert (lower <= upper).all()
    assert upper[2] == lower[2] == pytest.approx(2.0 - 15.0 * 0.05)
    assert upper[0] == pytest.approx(1.8)


def test_a_box_of_ones_own_narrows_what_the_robot_allows(make_tick):
    class Forward:
        def narrow(self, tick, box):
            box[0, 0] = max(box[0, 0], 0.0)

    bounds = RobotBounds(gain=1.0, influence=0.9, stopping=0.1)
    tick = make_tick(QR, NO_POINTS, STILL)
    own, both = combined_bounds([bounds], tick), combined_bounds([bounds, Forward()], tick)
    assert (own[0, 0], both[0, 0]) == (pytest.approx(-0.05), 0.0)
    np.testing.assert_array_equal(own[1], both[1])


def test_a_fast_base_may_not_turn_sharply():
    velocity, box = np.array([1.0, *np.zeros(8)]), unbounded()
    limit_turn(box, -velocity, LIMITS["ld60"].lateral_acceleration)
    assert box[:, 1] == pytest.approx([-0.5, 0.5])
    standing, free = unbounded(), unbounded()
    limit_turn(standing, np.zeros(9), LIMITS["ld60"].lateral_acceleration)
    limit_turn(free, velocity, np.inf)
    assert np.isinf([standing, free]).all()


@pytest.mark.parametrize("limits", LIMITS.values(), ids=LIMITS)
def test_the_simulated_base_can_do_what_the_profile_allows(limits):
    """2000 N push the 80 kg of base and arm."""
    assert limits.acceleration[0] < 2000.0 / 80.0
    assert limits.braking + limits.lateral_acceleration <= limits.acceleration[0]


def test_allowed_approach_stops_in_time_and_pushes_out_gently():
    rooms = [-1.0, -0.05, 0.0, 0.1, 5.0]
    free = [allowed_approach(room, gain=2.0, braking=np.inf, dt=0.05) for room in rooms]
    np.testing.assert_allclose(free, [-PUSH_OUT_SPEED, -0.1, 0.0, 0.2, 10.0])
    braked = [allowed_approach(room, gain=2.0, braking=0.5, dt=0.05) for room in rooms]
    np.testing.assert_allclose(braked[:4], free[:4])
    v = braked[4]
    assert v * 0.05 + v**2 / (2 * 0.5) == pytest.approx(5.0)
    assert allowed_approach(0.1, gain=50.0, braking=np.inf, dt=0.05) == pytest.approx(0.1 / 0.05)


@pytest.mark.parametrize("braking", [0.5, np.inf])
def test_an_approach_at_the_allowed_speed_never_enters_the_margin(braking):
    clearance, v, dt = 3.0, 1.8, 0.05
    for _ in range(400):
        allowed = allowed_approach(clearance, gain=2.0, braking=braking, dt=dt)
        v = max(min(1.8, allowed), v - 1.0 * dt) if np.isfinite(braking) else min(1.8, allowed)
        clearance -= v * dt
        assert clearance > -1e-9
    assert clearance < 0.01


def test_avoidance_rows_bound_the_change_of_the_true_distance(make_tick, sdf, filled):
    rng = np.random.default_rng(0)
    rows = Avoidance(
        lambda tick: tick.obstacles,
        label="obstacle",
        bodies=tuple("abcdefghi"),
        count=4,
        gain=2.0,
        margin=0.05,
    )
    points = rng.uniform([-1.5, -1.5, 0.1], [1.5, 1.5, 1.4], (200, 3))
    tick = make_tick(QR, points, STILL, count=4)
    G, _ = filled(rows, tick)
    assert G.shape == (36, 9)
    assert len(rows.names()) == 36
    step = 1e-6
    for body in range(9):
        own = points[tick.obstacles.index[body, 0]][None]
        for i in range(9):
            e = np.eye(9)[i]
            after = sdf.query(own, integrate(QR, e, step)).distance[body]
            before = sdf.query(own, integrate(QR, -e, step)).distance[body]
            assert -G[4 * body, i] == pytest.approx((after - before) / (2 * step), abs=1e-6)


def test_rows_without_a_point_say_nothing(make_tick, filled):
    rows = Avoidance(
        lambda tick: tick.obstacles,
        label="obstacle",
        bodies=tuple("abcdefghi"),
        count=8,
        gain=2.0,
        margin=0.05,
    )
    G, h = filled(rows, make_tick(QR, NO_POINTS, STILL))
    assert not G.any()
    assert (h > 0).all()


def test_objective_pulls_towards_dexterity_and_the_end_effector(make_tick):
    q = QR.copy()
    q[3] = 0.8  # the arm looks to the left of the base
    tick = make_tick(q, NO_POINTS, STILL, position_error=2.0)
    terms = ScaledObjective().terms(tick)
    weights, linear = terms.weights, terms.linear
    np.testing.assert_allclose(weights[:2], 0.01 / 2.0)
    np.testing.assert_allclose(weights[2:], 0.01 * 2.0)
    assert linear[1] < 0  # turning left lowers the cost
    better = integrate(q, -np.concatenate([[0, 0], linear[2:]]), 1e-3)
    state_after = make_tick(better, NO_POINTS, STILL).state
    assert manipulability(state_after.ee_jacobian[:, 2:]) > manipulability(
        tick.state.ee_jacobian[:, 2:]
    )


def test_weights_stay_finite_at_the_goal(make_tick):
    objective = ScaledObjective()
    weights = objective.terms(make_tick(QR, NO_POINTS, STILL, position_error=0.0)).weights
    assert np.isfinite(weights).all()
    assert weights.max() <= 0.01 / 0.05 + 1e-12
