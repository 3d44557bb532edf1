"""Maneuvers of a base that is longer than wide, with its arm before it."""

import numpy as np
import pytest

from horf_env.perception.sweeping import crossing_costs, sweep
from horf_env.perception.ways import CELL, GroundPlan, cell_of
from horf_env.planners.maneuvers import Maneuvers
from horf_env.planners.pose_costs import WINDOW, YAWS, pose_costs, pose_factor
from horf_env.planners.pose_path import AHEAD, BACK, LEFT, RIGHT, PosePath, pose_path

SIDE = 120  # cells
START = np.array([3.0, 3.0])
FAR = 1e4


def distance(boxes):
    """Of the middles of cells to boxes (x0, x1, y0, y1) [m]."""
    middles = (np.arange(SIDE) + 0.5) * CELL
    x, y = np.meshgrid(middles, middles, indexing="ij")
    gaps = [np.full_like(x, 9.0)]
    for x0, x1, y0, y1 in boxes:
        dx = np.maximum(np.maximum(x0 - x, x - x1), 0.0)
        dy = np.maximum(np.maximum(y0 - y, y - y1), 0.0)
        gaps.append(np.hypot(dx, dy))
    return np.min(gaps, axis=0)


def plan(low=(), high=(), goal=(5.5, 3.0)):
    """Ways of a disc to a goal."""
    low, high = distance(low), distance(high)
    ends = np.full_like(low, FAR)
    ends[tuple(cell_of(np.array(goal)))] = 0.0
    step, cost = crossing_costs(low, high, CELL), ends.copy()
    sweep(cost, step)
    return GroundPlan(np.zeros(2), low, high, step, ends, cost)


def drive(found, yaw, steps=200, place=START):
    """Follow the maneuvers without dynamics; poses (n, 3)."""
    maneuvers, (x, y), poses = Maneuvers(), place, []
    for _ in range(steps):
        speed, turn = maneuvers.choose(found, np.array([x, y]), yaw, 0.5)
        yaw += 0.05 * turn
        x, y = x + 0.05 * speed * np.cos(yaw), y + 0.05 * speed * np.sin(yaw)
        poses.append((x, y, yaw))
        if x > 4.2:
            break
    return np.array(poses)


def window_costs(found):
    first = (60 - WINDOW // 2, 60 - WINDOW // 2)
    return pose_costs(found.low, found.high, found.ends, found.cost, first)


def test_drives_ahead_on_free_ground():
    speed, turn = Maneuvers().choose(plan(), START, 0.0, 0.5)
    assert speed == pytest.approx(0.5, abs=0.01)
    assert abs(turn) < 0.2  # to the middle of the cell


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_turns_on_the_spot_to_what_lies_behind(side):
    speed, turn = Maneuvers().choose(plan(), START, side * 2.5, 0.5)
    assert speed == 0.0
    assert turn * side < 0.0


def test_passes_a_gap_that_is_wide_enough_for_the_base_alone():
    """0.75 m wide: a disc around the base, 0.91 m wide, does not pass."""
    gap = [(3.4, 3.9, 3.375, 6.0), (3.4, 3.9, 0.0, 2.625)]
    poses = drive(plan(gap), 0.4, place=np.array([2.6, 3.1]))
    assert poses[-1, 0] > 4.2
    inside = np.abs(poses[:, 0] - 3.65) < 0.25
    assert np.abs(poses[inside, 2]).max() < 0.2


def test_comes_out_of_a_dead_end_backwards_as_it_cannot_turn():
    pocket = [(2.0, 3.5, 3.375, 3.6), (2.0, 3.5, 2.4, 2.625), (3.4, 5.0, 2.4, 3.6)]
    poses = drive(plan(pocket), 0.0, place=np.array([2.7, 3.0]))
    out = np.argmax(poses[:, 0] < 1.6)
    assert 0 < out < 120
    assert np.abs(poses[:out, 2][poses[:out, 0] > 2.2]).max() < 0.4


def test_costs_fall_by_the_way_that_is_driven():
    costs = window_costs(plan()).cost
    middle = WINDOW // 2
    assert costs[middle, middle, 0] - costs[middle + 8, middle, 0] == pytest.approx(0.4, abs=0.02)


def test_a_turn_costs_more_than_none():
    costs = window_costs(plan()).cost[WINDOW // 2, WINDOW // 2]
    assert costs[4] > costs[0] + 0.5


def test_the_way_on_free_ground_is_one_straight_run():
    path = pose_path(window_costs(plan()), WINDOW / 2, WINDOW / 2, 0.0)
    assert set(path.moves.tolist()) == {AHEAD}
    np.testing.assert_allclose(path.places[:, 1], path.places[0, 1])
    assert path.turns == 0


@pytest.mark.parametrize(("yaw", "turn"), [(1.0, RIGHT), (-1.0, LEFT), (2.9, RIGHT), (3.5, LEFT)])
def test_the_way_begins_with_turns_the_shorter_way_around(yaw, turn):
    path = pose_path(window_costs(plan()), WINDOW / 2, WINDOW / 2, yaw)
    assert path.turns > 0
    assert set(path.moves[: path.turns].tolist()) == {turn}
    assert path.moves[path.turns] == AHEAD


def test_costs_fall_along_the_way():
    boxes = [(3.4, 3.9, 3.3, 6.0), (3.4, 3.9, 0.0, 2.5)]
    costs = window_costs(plan(boxes))
    path = pose_path(costs, WINDOW / 2 - 6, WINDOW / 2 + 5, 2.0)
    places = path.places.astype(int)
    directions = [int(np.argmin(np.abs(YAWS - yaw))) for yaw in path.yaws]
    along = costs.cost[places[:, 0], places[:, 1], directions]
    assert len(along) > 20
    assert (np.diff(along) < 0.02).all()


def test_a_run_ends_where_the_way_turns_back():
    path = PosePath(
        np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 0.0]]),
        np.zeros(4),
        np.array([AHEAD, AHEAD, BACK]),
    )
    np.testing.assert_array_equal(path.run(0, 1.0), [1.0, 0.0])
    np.testing.assert_array_equal(path.run(0, 9.0), [2.0, 0.0])
    np.testing.assert_array_equal(path.run(2, 9.0), [1.0, 0.0])


def test_the_way_ends_where_ways_end():
    path = pose_path(window_costs(plan(goal=(3.5, 3.0))), WINDOW / 2, WINDOW / 2, 0.0)
    np.testing.assert_allclose(path.places[-1], [WINDOW / 2 + 10.5, WINDOW / 2 + 0.5])


@pytest.mark.parametrize("yaw", np.linspace(0.0, 6.0, 7))
def test_the_base_is_longer_than_wide(yaw):
    """0.36 m from its middle a wall is beside it, not before it."""
    c, s = np.cos(yaw), np.sin(yaw)
    x, y = (np.arange(SIDE) + 0.5) * CELL, (np.arange(SIDE) + 0.5) * CELL
    x, y = np.meshgrid(x, y, indexing="ij")
    free = np.full((SIDE, SIDE), 9.0)
    before = np.abs((x - 3.0) * c + (y - 3.0) * s - 0.36)
    beside = np.abs(-(x - 3.0) * s + (y - 3.0) * c - 0.36)
    assert pose_factor(before, free, 60.0, 60.0, yaw) > 15.0
    assert pose_factor(beside, free, 60.0, 60.0, yaw) < 10.0


def test_what_hangs_blocks_the_arm_only():
    far = np.full((SIDE, SIDE), 9.0)
    hangs = distance([(3.4, 3.5, 2.9, 3.1)])
    assert pose_factor(far, hangs, 60.0, 60.0, 0.0) == 15.0
    assert pose_factor(far, hangs, 60.0, 60.0, np.pi) < 5.0


def test_turns_on_the_spot_to_one_side_only():
    """In a narrow place: once it has begun to turn it does not turn back."""
    corner = [(2.0, 4.2, 3.55, 3.7), (3.6, 3.75, 2.0, 2.75), (1.9, 2.0, 2.0, 3.7)]
    poses = drive(plan(corner, goal=(5.5, 3.1)), 2.0, place=np.array([2.9, 3.0]))
    turned = np.diff(poses[np.hypot(*np.diff(poses[:, :2], axis=0, prepend=0.0).T) < 1e-6, 2])
    assert poses[-1, 0] > 4.2
    assert np.sum(np.diff(np.sign(turned[np.abs(turned) > 1e-3])) != 0) <= 1


def test_plans_anew_when_the_plan_changes():
    maneuvers = Maneuvers()
    assert maneuvers.choose(plan(), START, 0.0, 0.5)[0] > 0.4
    assert maneuvers.choose(plan(goal=(0.5, 3.0)), START, 0.0, 0.5)[0] == 0.0
