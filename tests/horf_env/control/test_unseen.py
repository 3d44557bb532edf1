"""Rows that keep base and gripper off unseen ground."""

from dataclasses import replace

import numpy as np
import pytest

from horf_env.control.unseen import UnseenGround, UnseenReach, _sector
from horf_env.robot import ARM_READY, integrate
from horf_env.robot.footprint import FOOTPRINT

ROWS = UnseenGround(gain=2.0, margin=0.03)
REACH = UnseenReach(gain=2.0, margin=0.03)


def tick_with(make_tick, places, base=(0.0, 0.0, 0.0)):
    q = np.concatenate([base, ARM_READY])
    return replace(make_tick(q, np.empty((0, 3)), np.zeros(6)), unseen=np.asarray(places, float))


def distance(configuration, place):
    x, y, theta = configuration[:3]
    c, s = np.cos(theta), np.sin(theta)
    local = np.array([[c, s], [-s, c]]) @ (place - [x, y])
    return np.linalg.norm(local - np.clip(local, FOOTPRINT[::2], FOOTPRINT[1::2]))


@pytest.mark.parametrize("seed", range(20))
def test_rows_are_the_rate_of_the_distance(make_tick, filled, seed):
    rng = np.random.default_rng(seed)
    place, base = rng.uniform(-1.5, 1.5, 2), rng.uniform(-0.2, 0.2, 3)
    tick = tick_with(make_tick, [place], base)
    G, _ = filled(ROWS, tick)
    row = G[np.abs(G).max(axis=1) > 0]
    if distance(tick.state.configuration, place) == 0.0:
        assert len(row) == 0
        return
    assert row.shape == (1, 9)
    velocity, step = rng.uniform(-1, 1, 9), 1e-6
    q = tick.state.configuration
    ahead, back = integrate(q, velocity, step), integrate(q, -velocity, step)
    rate = (distance(ahead, place) - distance(back, place)) / (2 * step)
    assert row[0] @ velocity == pytest.approx(-rate, abs=1e-6)


def test_only_the_nearest_place_of_a_direction_counts(make_tick, filled):
    G, h = filled(ROWS, tick_with(make_tick, [[-1.5, 0.01], [-0.6, 0.01], [-0.9, 0.01]]))
    active = np.flatnonzero(np.abs(G).max(axis=1))
    assert len(active) == 1
    assert h[active[0]] <= 2.0 * (0.25 - 0.03)


def test_reversing_is_limited_and_driving_on_is_not(make_tick, filled):
    G, h = filled(ROWS, tick_with(make_tick, [[-0.5, 0.0], [-0.5, 0.1], [-0.5, -0.1]]))
    assert (G @ [1.0, *np.zeros(8)] <= h).all()
    assert not (G @ [-1.0, *np.zeros(8)] <= h).all()


def test_standing_still_is_always_allowed(make_tick, filled):
    places = np.random.default_rng(0).uniform(-0.5, 0.5, (200, 2))
    _, h = filled(ROWS, tick_with(make_tick, places))
    assert (h >= 0.0).all()


def test_without_unseen_ground_nothing_is_said(make_tick, filled):
    G, h = filled(ROWS, tick_with(make_tick, np.empty((0, 2))))
    assert not G.any()
    assert (h > 0.0).all()
    assert len(ROWS.names()) == len(h)


@pytest.mark.parametrize("seed", range(10))
def test_rows_of_the_gripper_are_the_rate_of_its_distance(make_tick, filled, robot, seed):
    rng = np.random.default_rng(seed)
    place, base = rng.uniform(-1.5, 1.5, 2), rng.uniform(-0.2, 0.2, 3)
    tick = tick_with(make_tick, [place], base)
    G, _ = filled(REACH, tick)
    row = G[np.abs(G).max(axis=1) > 0]
    assert row.shape == (1, 9)
    velocity, step = rng.uniform(-1, 1, 9), 1e-6
    q = tick.state.configuration
    distances = [
        np.linalg.norm(robot.ee_pose(integrate(q, sign * velocity, step))[:2, 3] - place)
        for sign in (1.0, -1.0)
    ]
    rate = (distances[0] - distances[1]) / (2 * step)
    assert row[0] @ velocity == pytest.approx(-rate, abs=1e-6)


def test_the_gripper_may_not_swing_into_the_unseen_but_may_draw_back(make_tick, filled):
    tick = tick_with(make_tick, np.empty((0, 2)))
    x, y = tick.state.T_world_ee[:2, 3]
    G, h = filled(REACH, replace(tick, unseen=np.array([[x, y + 0.2]])))
    sideways = np.zeros(9)
    sideways[2] = 1.0  # the arm's first joint turns it to the left
    assert not (G @ sideways <= h).all()
    assert (G @ -sideways <= h).all()
    assert (h >= 0.0).all()


def test_a_direction_is_a_sixteenth_of_the_turn_from_the_x_axis_on():
    angles = np.arange(0.0, 2.0 * np.pi, 0.01)
    found = [_sector(2.0 * np.cos(angle), 2.0 * np.sin(angle)) for angle in angles]
    np.testing.assert_array_equal(found, np.floor(angles / (np.pi / 8.0)))
    sides = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)]
    assert [_sector(float(x), float(y)) for x, y in sides] == list(range(0, 16, 2))
    assert (_sector(-1.0, -0.0), _sector(1.0, -0.0)) == (8, 0)
