"""The map that a policy sees: where points of the world are drawn."""

import numpy as np

from horf_env.perception import CELLS, CHANNELS, top_view


def base(x=0.0, y=0.0, yaw=0.0):
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1.0]])


def drawn(image, channel):
    return [tuple(cell) for cell in np.argwhere(image[channel])]


NO_GROUND = np.empty((0, 2))


def test_low_and_high_obstacles_have_a_channel_each():
    points = np.array([[1.05, 0.05, 0.2], [1.05, 0.85, 0.9]])
    image = top_view(points, NO_GROUND, base())
    assert image.shape == (CHANNELS, CELLS, CELLS)
    assert image.dtype == np.uint8
    assert drawn(image, 0) == [(16 + 5, 16)]
    assert drawn(image, 1) == [(16 + 5, 16 + 4)]
    assert image.max() == 255


def test_unseen_ground_is_the_third():
    image = top_view(np.empty((0, 3)), np.array([[-1.05, 0.05]]), base())
    assert drawn(image, 2) == [(16 - 6, 16)]
    assert not image[:2].any()


def test_turns_and_moves_with_the_base():
    rng = np.random.default_rng(0)
    points = rng.uniform([-3, -3, 0], [3, 3, 1], (200, 3))
    T = base(2.0, -1.0, 0.7)
    moved = points @ T[:3, :3].T + T[:3, 3]
    moved_ground = points[:, :2] @ T[:2, :2].T + T[:2, 3]
    here = top_view(points, points[:, :2], base())
    there = top_view(moved, moved_ground, T)
    assert (here != there).sum() <= 2  # a point on the edge of a cell may fall to either side


def test_what_is_farther_away_is_left_out():
    far = np.array([[3.3, 0, 0.5], [-3.3, 0, 0.5], [0, 3.3, 0.5], [0, -3.3, 0.5]])
    assert not top_view(far, far[:, :2], base()).any()
