"""The layer's witness points: where they lie decides what the arm and the base can hit."""

import numpy as np
import pytest

from horf_env.control import PRESETS, Sensed
from horf_env.control.sdf_qp_layer import SdfQpLayer
from horf_env.robot import ARM_READY, LIMITS, integrate

DT = 0.05
START = np.concatenate([np.zeros(3), ARM_READY])
NO_GROUND = np.zeros((0, 2))


@pytest.fixture(scope="module")
def layer(sdf):
    return SdfQpLayer(sdf, LIMITS["ld60"], PRESETS["default"], DT)


def sensed(state, points, velocity):
    return Sensed(
        state=state,
        velocity=velocity,
        points=points,
        unseen=NO_GROUND,
        position_error=2.0,
        posture=ARM_READY,
    )


def test_points_of_the_base_lie_on_both_sides_of_it(robot, layer):
    along = [(x, z) for x in np.linspace(-0.3, 0.3, 25) for z in (0.1, 0.13, 0.16)]
    left = np.array([[x, 0.35, z] for x, z in along])
    right = np.array([[x, -0.45, z] for x, z in along])
    told = sensed(robot.state(START), np.concatenate([left, right]), np.zeros(9))
    side = layer.tick(np.zeros(6), told).obstacles.point[0, :, 1]
    assert (side > 0.0).any()
    assert (side < 0.0).any()


def test_rows_of_the_own_base_are_the_change_of_the_distance_to_it(robot, sdf):
    """The point rides on the base, so it moves with the robot in the finite differences."""
    q = np.concatenate([[0.4, -0.3, 0.7], ARM_READY])
    q[4], q[6] = 1.2, -2.6  # the hand low in front of the base
    before, step, checked = robot.state(q), 1e-6, 0
    found = sdf.own_base_witnesses(before, count=2, spacing=0.05, cutoff=0.5)
    for body, k in zip(*np.nonzero(np.isfinite(found.distance)), strict=True):
        fixed = np.linalg.solve(before.T_world_base, np.append(found.point[body, k], 1.0))
        for i, e in enumerate(np.eye(9)):
            plus, minus = robot.state(integrate(q, e, step)), robot.state(integrate(q, -e, step))
            ends = [
                sdf.witnesses(
                    (state.T_world_base @ fixed)[None, :3],
                    state,
                    count=1,
                    spacing=0.0,
                    cutoff=np.inf,
                ).distance[body, 0]
                for state in (plus, minus)
            ]
            numeric = (ends[0] - ends[1]) / (2 * step)
            assert found.gradient[body, k, i] == pytest.approx(numeric, abs=1e-6)
            checked += abs(numeric) > 1e-3
    assert checked > 10


def test_a_free_arm_does_not_hit_its_own_base(robot, sdf, layer):
    # With one point a body, this motion takes the hand 2 mm into the base.
    rng = np.random.default_rng(16)
    q, velocity, action = START, np.zeros(9), np.zeros(6)
    least = np.inf
    for _ in range(445):
        action = 0.95 * action + rng.normal(0.0, np.sqrt(1.0 - 0.95**2), 6)
        told = sensed(robot.state(q), np.zeros((0, 3)), velocity)
        velocity = layer.command(np.clip(action, -1.0, 1.0), told).velocity
        q = integrate(q, velocity, DT)
        found = sdf.own_base_witnesses(robot.state(q), count=1, spacing=0.0, cutoff=0.5)
        least = min(least, found.distance.min())
    assert 0.01 < least < 0.1
