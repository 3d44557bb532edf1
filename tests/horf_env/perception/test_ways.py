"""Ways on what has been seen: memory, plans and the choice of a direction."""

import numpy as np
import pytest

from horf_env.perception.ways import CELL, GroundWays, cell_of

START, GOAL = np.zeros(2), np.array([6.0, 0.0])
NOTHING = np.empty((0, 3))
# 6 m, of which the last 0.9 are out of sight and count double.
FREE = 6.9


class Space:
    """What the senses have shown."""

    def __init__(self, looked_at=lambda points: np.ones(len(points), dtype=bool)):
        self.points = NOTHING
        self.seen = looked_at

    def surfaces(self, place):
        return self.points


def ways(points=(), goal=GOAL, space=None):
    space = space or Space()
    found = GroundWays(START, goal, np.zeros((4, 4)), cell_of(goal), space)
    for cloud in points:
        space.points = cloud
        found.update(START)
    return found


def wall(x, least_y, greatest_y, z=0.2):
    y = np.arange(least_y, greatest_y, 0.02)
    return np.stack([np.full_like(y, x), y, np.full_like(y, z)], axis=1)


def test_a_free_way_costs_its_length_and_double_out_of_sight():
    place, length, cost = ways([NOTHING]).ahead(START, 0.0)
    assert cost == pytest.approx(FREE, abs=0.1)
    assert length == pytest.approx(0.8, abs=CELL)
    np.testing.assert_allclose(place, [0.8, 0.0], atol=0.06)


def test_what_is_out_of_sight_is_remembered():
    far = wall(2.0, -1.0, 3.0)
    seen = ways([far]).ahead(START, 0.0)
    remembered = ways([far] + 10 * [NOTHING]).ahead(START, 0.0)
    assert remembered[2] == seen[2] > FREE + 0.5


def test_what_is_gone_nearby_is_forgotten():
    near = wall(1.0, -0.5, 0.5)
    assert ways([near]).ahead(START, 0.0)[2] > FREE + 0.5
    assert ways([near] + 10 * [NOTHING]).ahead(START, 0.0)[2] == pytest.approx(FREE, abs=0.1)


def test_bad_news_are_counted():
    space = Space()
    found = ways([NOTHING], space=space)
    before = found.ahead(START, 0.0)[2]
    space.points = wall(2.0, -1.0, 3.0)
    for _ in range(10):
        found.update(START)
    assert found.surprises == pytest.approx(found.ahead(START, 0.0)[2] - before)
    assert found.surprises > 0.5


def test_goes_on_where_a_turn_would_not_pay():
    """Both ends of a wall are as good; the robot keeps to the side that it looks at."""
    found = ways([wall(2.0, -2.0, 2.0)])
    left, right = (found.ahead(START, yaw)[0][1] for yaw in (0.9, -0.9))
    assert left > 0.1
    assert right < -0.1


def test_a_closed_wall_is_no_end_of_the_way():
    """It is dear to break through, not impossible: what was seen may be wrong."""
    ring = np.vstack([wall(x, -1.0, 1.0) for x in (-1.0, 1.0)])
    ring = np.vstack([ring, ring[:, [1, 0, 2]]])
    _, length, cost = ways([ring]).ahead(START, 0.0)
    assert length == pytest.approx(0.8, abs=CELL)
    assert 7.0 < cost < 50.0


def test_a_base_beyond_the_grid_finds_back():
    found = ways([NOTHING])
    place, _, _ = found.ahead(np.array([-50.0, 0.0]), 0.0)
    assert np.isfinite(place).all()
    found.update(np.array([-50.0, 0.0]))


def test_ground_that_nobody_looked_at_counts_double():
    """Else a gap that was seen would look worse than a detour through what was not."""
    hidden = ways([NOTHING], space=Space(lambda points: np.zeros(len(points), dtype=bool)))
    half = ways([NOTHING], space=Space(lambda points: points[:, 0] < 3.0))
    assert hidden.ahead(START, 0.0)[2] == pytest.approx(12.0, abs=0.4)
    assert half.ahead(START, 0.0)[2] == pytest.approx(9.0, abs=0.2)


@pytest.mark.parametrize("is_seen", [True, False])
def test_unseen_ground_right_behind_a_surface_is_a_part_of_it(is_seen):
    space = Space(lambda points: (points[:, 0] < 2.05) | is_seen)
    plan = ways([wall(2.0, -1.0, 1.0)], space=space).plan
    beside, beyond = (
        plan.low[tuple(cell_of(np.array([x, 0.02]) - plan.offset))] for x in (2.2, 2.9)
    )
    assert beside == (pytest.approx(0.2, abs=0.03) if is_seen else 0.0)
    assert beyond > 0.3


def test_what_was_looked_at_once_stays_so():
    space = Space()
    found = ways(11 * [NOTHING], space=space)
    seen = found.ahead(START, 0.0)[2]
    space.seen = lambda points: np.zeros(len(points), dtype=bool)
    for _ in range(10):
        found.update(START)
    assert found.ahead(START, 0.0)[2] == pytest.approx(seen, abs=1e-9)


def test_a_place_to_avoid_stands_in_the_way():
    found = ways([NOTHING])
    before = found.ahead(START, 0.0)[2]
    found.avoid(np.array([2.0, 0.0]))
    for _ in range(10):
        found.update(START)
    assert found.ahead(START, 0.0)[2] > before + 0.2


def test_notices_ground_that_is_seen_between_two_plans():
    """A wall hides nothing of ground that was in view for a moment while the robot turned."""
    view = {"seen": False}
    space = Space(lambda points: np.full(len(points), view["seen"]))
    never, once = ways([NOTHING] * 11, space=space), ways([NOTHING], space=space)
    for k in range(10):
        view["seen"] = 3 <= k < 6
        once.update(START)
    assert once.ahead(START, 0.0)[2] < never.ahead(START, 0.0)[2] - 3.0
