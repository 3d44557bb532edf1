"""Ways on the true scene."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from horf_env.planners.route import Route
from horf_env.robot import ARM_READY
from horf_env.scenes import Box, Goal, Scene, Start
from horf_env.scenes.distance import outline_distance

DOWN = (1.0, 0.0, 0.0, 0.0)
ALONG_X = (0.70710678, 0.0, 0.70710678, 0.0)
WALL = Box((3.0, 0.5, 0.6), (0.1, 2.0, 0.6), 0.0)  # leaves room below y = -1.5


def scene(*boxes, goal=(6.0, 0.0, 0.7), orientation=DOWN):
    start = Start((0.0, 0.0, 0.0), tuple(ARM_READY.tolist()))
    return Scene("test", boxes, (), (), start, Goal(goal, orientation))


def route_in(world):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat(world.goal.quaternion_xyzw).as_matrix()
    T[:3, 3] = world.goal.position
    return Route(world, T)


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
    way = walk(route_in(scene()), (0.0, 0.0))
    length = np.linalg.norm(np.diff(way, axis=0), axis=1).sum()
    assert 0.55 <= np.linalg.norm(way[-1] - [6.0, 0.0]) <= 0.95
    assert length < 1.1 * 5.25


def test_goes_around_a_wall_with_room_for_the_base():
    world = scene(WALL)
    way = walk(route_in(world), (0.0, 0.0))
    assert outline_distance(world, way).min() > 0.35
    assert way[:, 1].min() < -1.7
    assert np.linalg.norm(way[-1] - [6.0, 0.0]) < 1.0


def test_stands_beside_the_approach_where_the_arm_cannot_reach_straight_ahead():
    level = scene(goal=(6.0, 0.0, 0.7), orientation=ALONG_X)
    end = walk(route_in(level), (0.0, 0.0))[-1] - [6.0, 0.0]
    assert abs(np.degrees(np.arctan2(end[1], -end[0]))) > 25.0
    assert 0.4 < np.linalg.norm(end) < 1.2


def test_a_discouraged_place_is_not_stood_at_again():
    route = route_in(scene())
    before = walk(route, (0.0, 0.0))[-1]
    route.discourage(before)
    after = walk(route, (0.0, 0.0))[-1]
    assert np.linalg.norm(after - before) > 0.3


def test_costs_more_where_it_is_narrow_and_is_infinite_in_a_wall():
    open_way, narrow = route_in(scene()), route_in(scene(WALL))
    start = np.zeros(2)
    assert open_way.cost(start) < narrow.cost(start) < np.inf
    assert narrow.cost(np.array([3.0, 0.5])) == np.inf


def test_off_the_way_it_leads_back_to_it():
    route = route_in(scene(WALL))
    point, _ = route.ahead(np.array([3.0, 0.5]), 0.5)  # in the wall
    assert np.isfinite(point).all()
    assert route.clearance(np.array([3.0, 0.5])) < 0 < route.clearance(np.array([0.0, 0.0]))


@pytest.mark.parametrize("seed", range(3))
def test_the_way_only_gets_shorter(seed):
    rng = np.random.default_rng(seed)
    route = route_in(scene(WALL))
    position = rng.uniform([-1, -1], [2, 1])
    lengths = [route.ahead(place, 100.0)[1] for place in walk(route, position)]
    assert (np.diff(lengths[1:]) <= 1e-9).all()
