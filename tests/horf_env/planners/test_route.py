"""Ways on the true scene."""

import numpy as np
import pytest

from horf_env.planners.route import Route
from horf_env.robot import ARM_READY
from horf_env.scenes import Box, Goal, Scene, Start
from horf_env.scenes.distance import outline_distance

DOWN = (1.0, 0.0, 0.0, 0.0)
ALONG_X = (0.0, 0.70710678, 0.0, 0.70710678)
WALL = Box((3.0, 0.5, 0.6), (0.1, 2.0, 0.6), 0.0)  # leaves room below y = -1.5


def scene(*boxes, goal=(6.0, 0.0, 0.7), orientation=DOWN):
    start = Start((0.0, 0.0, 0.0), tuple(ARM_READY.tolist()))
    return Scene("test", boxes, (), (), start, Goal(goal, orientation))


def walk(route, position, step=0.2):
    """All places on the way from a position."""
    places = [np.asarray(position, float)]
    for _ in range(200):
        point, length = route.ahead(places[-1], step)
        places.append(point)
        if length < step / 2:
            return np.array(places)
    raise AssertionError("the way does not end")


def test_without_obstacles_the_way_is_short_and_ends_within_reach():
    way = walk(Route(scene()), (0.0, 0.0))
    length = np.linalg.norm(np.diff(way, axis=0), axis=1).sum()
    assert 0.55 <= np.linalg.norm(way[-1] - [6.0, 0.0]) <= 0.95
    assert length < 1.1 * 5.25


def test_goes_around_a_wall_with_room_for_the_base():
    world = scene(WALL)
    way = walk(Route(world), (0.0, 0.0))
    assert outline_distance(world, way).min() > 0.35
    assert way[:, 1].min() < -1.7
    assert np.linalg.norm(way[-1] - [6.0, 0.0]) < 1.0


def test_stands_behind_the_gripper_where_the_approach_is_level():
    way = walk(Route(scene(orientation=ALONG_X)), (0.0, 0.0))
    np.testing.assert_allclose(way[-1], [5.1, 0.0], atol=0.15)


def test_off_the_way_it_leads_back_to_it():
    route = Route(scene(WALL))
    point, _ = route.ahead(np.array([3.0, 0.5]), 0.5)  # in the wall
    assert np.isfinite(point).all()
    assert route.clearance(np.array([3.0, 0.5])) < 0 < route.clearance(np.array([0.0, 0.0]))


@pytest.mark.parametrize("seed", range(3))
def test_the_way_only_gets_shorter(seed):
    rng = np.random.default_rng(seed)
    route = Route(scene(WALL))
    position = rng.uniform([-1, -1], [2, 1])
    lengths = [route.ahead(place, 100.0)[1] for place in walk(route, position)]
    assert (np.diff(lengths[1:]) <= 1e-9).all()
