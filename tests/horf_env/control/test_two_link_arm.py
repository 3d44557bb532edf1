"""Rows of a planar arm with two links of 1 m, against numbers worked out on paper.

The first link lies on the x axis, the second stands upright on its end, from (1, 0) to (1, 1). An
obstacle point at (0.8, 0.5) is 0.2 m left of the second link. Turning either joint at 1 rad/s moves
the second link's point at that height to the left by 0.5 m/s; upwards it moves, too, by 0.8 m/s
(first joint) or -0.2 m/s (second joint), which does not matter to the distance.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from horf_env.control.avoidance import Avoidance
from horf_env.control.sampled_dampers import SampledDampers
from horf_env.robot import LIMITS, RobotState
from horf_env.sdf import Witnesses
from horf_env.sdf.gradient import distance_gradient

OBSTACLE, LEFT = np.array([0.8, 0.5, 0.0]), np.array([-1.0, 0.0, 0.0])
AXIS = np.array([0.0, 0.0, 1.0])


@pytest.fixture
def state():
    elbow = np.array([1.0, 0.0, 0.0])
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[1, :3, 3] = elbow
    jacobians = np.zeros((2, 6, 9))
    jacobians[:, 3:, 0] = AXIS  # the first joint turns both links
    jacobians[1, :3, 0] = np.cross(AXIS, elbow)
    jacobians[1, 3:, 1] = AXIS  # the second joint only the second
    return RobotState(np.zeros(10), poses, jacobians, np.eye(4), np.eye(4), np.zeros((6, 9)))


@pytest.fixture
def witnesses(state):
    point, normal = np.zeros((2, 1, 3)), np.zeros((2, 1, 3))
    point[1, 0], normal[1, 0] = OBSTACLE, LEFT
    gradient = distance_gradient(state, np.arange(2), point, normal)
    distance = np.array([[np.inf], [0.2]])
    return Witnesses(distance, normal, gradient, point, np.array([[-1], [0]]))


def avoidance(witnesses, gain):
    return Avoidance(
        lambda tick: witnesses,
        label="obstacle",
        bodies=("first", "second"),
        count=1,
        gain=gain,
        margin=0.05,
    )


def test_gradient_of_the_distance(witnesses):
    np.testing.assert_allclose(witnesses.gradient[1, 0, :2], [-0.5, -0.5])
    assert not witnesses.gradient[1, 0, 2:].any()
    assert not witnesses.gradient[0].any()


@pytest.mark.parametrize(
    ("limits", "allowed"),
    # gain (0.2 - 0.05) = 0.3 m/s; with brakes of 0.5 m/s^2 and a step of 0.05 s it is
    # sqrt(0.025^2 + 2 x 0.5 x 0.15) - 0.025 = 0.3631 m/s, which allows more.
    [("paper", 0.3), ("ld60", 0.3)],
)
def test_row_of_the_second_link(filled, witnesses, limits, allowed):
    rows = avoidance(witnesses, gain=2.0)
    G, h = filled(rows, SimpleNamespace(limits=LIMITS[limits], dt=0.05))
    np.testing.assert_allclose(G[1, :2], [0.5, 0.5])
    assert h[1] == pytest.approx(allowed)
    assert not G[0].any()
    assert rows.names() == ("obstacle first 0", "obstacle second 0")


def test_brakes_bound_the_row_where_the_gain_allows_more(filled, witnesses):
    rows = avoidance(witnesses, gain=4.0)
    _, h = filled(rows, SimpleNamespace(limits=LIMITS["ld60"], dt=0.05))
    assert h[1] == pytest.approx(0.3631, abs=1e-4)


def test_sampled_damper_at_the_end_of_the_upright_link(filled, state):
    """A sample at the tip (1, 1), the obstacle 0.2 m to its left: both joints turn it at 1 m/s."""
    tip = np.array([0.8, 1.0, 0.0])
    point, normal = np.zeros((2, 1, 3)), np.zeros((2, 1, 3))
    point[1, 0], normal[1, 0] = tip, LEFT
    found = Witnesses(
        distance=np.array([[np.inf], [0.2]]),
        normal=normal,
        gradient=distance_gradient(state, np.arange(2), point, normal),
        point=point,
        index=np.array([[-1], [0]]),
    )
    rows = SampledDampers(
        lambda tick: found,
        bodies=("first", "second"),
        count=1,
        gain=1.0,
        influence=0.3,
        stopping=0.05,
    )
    G, h = filled(rows, SimpleNamespace())
    np.testing.assert_allclose(G[1, :2], [1.0, 1.0])
    assert h[1] == pytest.approx((0.2 - 0.05) / (0.3 - 0.05))  # 0.6 m/s
    assert not G[0].any()
