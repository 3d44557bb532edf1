"""The local map: what it remembers, forgets, and takes as occupied without having seen it."""

import numpy as np
import pytest

from horf_env.errors import SettingError
from horf_env.perception import (
    CameraModel,
    DepthCamera,
    DisparityNoise,
    FrameSettings,
    Image,
    MapSettings,
    View,
    goal_space,
    unproject,
)
from horf_env.perception.goal_space import LENGTH
from horf_env.robot import ARM_READY
from horf_env.scenes import Box, Cylinder, Goal, Scene, Start, obstacle_distance, triangles

LEVEL = CameraModel(pitch_up=0.0)
NOTHING_FILLED = {"fill_above": False, "fill_behind": 0.0}


def scene(boxes=(), cylinders=()):
    start = Start((0.0, 0.0, 0.0), tuple(ARM_READY.tolist()))
    goal = Goal((1.0, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0))
    return Scene("test", tuple(boxes), tuple(cylinders), (), start, goal)


def base(x=0.0, y=0.0, yaw=0.0):
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1.0]])


class Looker:
    """A camera on a base that stands where the test wants it."""

    def __init__(self, world, settings, model=LEVEL, change=lambda depth: depth):
        self.memory, self.model, self.change, self.time = settings.make(), model, change, 0.0
        self.camera = DepthCamera(model)
        self.show(world)
        self.memory.reset(base(), np.empty((0, 3)))

    def show(self, world):
        self.camera.set_scene(*triangles(world, floor=True))

    def look(self, T_world_base, times=1, own=lambda points: np.zeros(len(points), dtype=bool)):
        for _ in range(times):
            T = T_world_base @ self.model.T_base_camera
            depth = self.change(self.camera.render(T))
            points = unproject(depth, self.model, T)
            image = Image(depth, self.model, None, self.time)
            self.memory.add(View(image, T, points, own(points)))
            self.memory.occupy(T_world_base, np.empty((0, 3)))
            self.time += 0.05
        return self.memory.points(T_world_base)


FRONT = Box((1.2, 0.0, 0.4), (0.1, 0.4, 0.4), 0.0)


def test_points_lie_on_what_was_seen():
    world = scene([FRONT], [Cylinder((1.0, -0.8, 0.5), 0.1, 0.5)])
    points = Looker(world, MapSettings(**NOTHING_FILLED)).look(base(), 4)
    assert len(points) > 50
    assert np.abs(obstacle_distance(world, points)).max() < 2e-3


def test_no_two_points_of_a_near_surface_are_far_apart():
    points = Looker(scene([FRONT]), MapSettings(**NOTHING_FILLED)).look(base(), 4)
    face = np.stack(np.meshgrid([1.1], np.linspace(-0.3, 0.3, 41), np.linspace(0.1, 0.6, 41)), -1)
    gaps = np.linalg.norm(face.reshape(-1, 1, 3) - points, axis=2).min(axis=1)
    assert gaps.max() < 0.06


def test_what_left_the_view_is_remembered():
    looker = Looker(scene([FRONT]), MapSettings(**NOTHING_FILLED))
    before = looker.look(base(), 4)
    after = looker.look(base(yaw=np.pi), 40)
    front = after[after[:, 0] > 0.9]
    np.testing.assert_array_equal(np.sort(front, axis=0), np.sort(before, axis=0))


def test_surfaces_are_what_was_seen_without_what_it_may_hide():
    world = scene([FRONT])
    looker = Looker(world, MapSettings())
    points = looker.look(base(), 4)
    surfaces = looker.memory.surfaces(np.zeros(2))
    assert 50 < len(surfaces) < len(points)
    assert np.abs(obstacle_distance(world, surfaces)).max() < 2e-3


def test_what_was_looked_at():
    before_and_behind = np.array([[0.8, 0.0, 0.33], [1.6, 0.0, 0.33], [-1.5, 0.0, 0.33]])
    looker = Looker(scene([FRONT]), MapSettings())
    looker.look(base(), 4)
    assert looker.memory.seen(before_and_behind).tolist() == [True, False, False]
    paper = Looker(scene([FRONT]), FrameSettings(frames=5))
    surfaces = paper.look(base(), 4)
    np.testing.assert_array_equal(paper.memory.surfaces(np.zeros(2)), surfaces)
    assert not paper.memory.seen(before_and_behind).any()


def test_the_papers_memory_forgets_it():
    looker = Looker(scene([FRONT]), FrameSettings(frames=5))
    assert len(looker.look(base(), 4)) > 50
    assert len(looker.look(base(yaw=np.pi), 5)) == 0
    assert len(looker.memory.unseen(base())) == 0


def test_a_finite_history_forgets_it_in_time():
    looker = Looker(scene([FRONT]), MapSettings(history=1.0, **NOTHING_FILLED))
    looker.look(base(), 4)
    assert len(looker.look(base(yaw=np.pi), 15)) > 50
    assert len(looker.look(base(yaw=np.pi), 10)) == 0


def test_an_obstacle_that_moved_disappears():
    looker = Looker(scene([FRONT, Box((3.0, 0.0, 1.0), (0.1, 3.0, 1.0), 0.0)]), MapSettings())
    looker.look(base(), 4)
    looker.show(scene([Box((3.0, 0.0, 1.0), (0.1, 3.0, 1.0), 0.0)]))
    points = looker.look(base(), 20)  # 1 s
    left = points[points[:, 0] < 1.5]
    assert not (left[:, 2] > 0.05).any()  # lower ones cannot be told from the floor behind them


def test_a_thin_post_stays_while_rays_miss_it():
    rng = np.random.default_rng(0)
    wall = Box((4.0, 0.0, 1.0), (0.1, 4.0, 1.0), 0.0)
    looker = Looker(scene([wall], [Cylinder((2.3, 0.0, 0.5), 0.015, 0.5)]), MapSettings())
    for _ in range(60):
        points = looker.look(base(yaw=rng.uniform(-0.3, 0.3)))
    post = points[points[:, 0] < 2.5]
    assert np.ptp(post[:, 2]) > 0.6


@pytest.mark.parametrize("noise", [0.08, 0.24])
def test_noise_and_holes_leave_the_surface_where_it_is(noise):
    rng = np.random.default_rng(1)

    def change(depth):
        noisy = DisparityNoise(subpixel_sd=noise).apply(depth, LEVEL, rng)
        noisy[rng.random(depth.shape) < 0.2] = 0.0
        return noisy

    world = scene([FRONT])
    points = Looker(world, MapSettings(**NOTHING_FILLED), change=change).look(base(), 20)
    assert len(points) > 50
    assert np.percentile(np.abs(obstacle_distance(world, points)), 95) < 0.05


def test_own_points_are_no_obstacles_but_hide_what_is_behind():
    looker = Looker(scene([FRONT]), MapSettings())
    assert len(looker.look(base(), 4, own=lambda points: points[:, 0] < 1.2)) == 0


TALL = Box((1.0, 0.0, 1.0), (0.2, 0.3, 1.0), 0.0)  # face at 0.8 m: seen up to 0.57 m by LEVEL


@pytest.mark.parametrize(("above", "lowest"), [(True, 1.4), (False, 0.0)])
def test_unseen_space_above_a_surface_counts_as_occupied(above, lowest):
    settings = MapSettings(fill_above=above, fill_behind=0.0)
    points = Looker(scene([TALL]), settings).look(base(), 8)
    over = points[np.abs(points[:, 1]) < 0.25]
    assert over[:, 2].max() < 0.7 or over[:, 2].max() > lowest > 0.0
    assert (over[:, 2].max() > 0.7) == above


@pytest.mark.parametrize(
    ("plate", "low", "high"), [(0.0, 0.55, 0.6), (0.1, 0.65, 0.7), (np.inf, 0.7, 0.8)]
)
def test_what_hangs_is_taken_for_a_plate(plate, low, high):
    """A table whose top, at 0.6 m, is higher than the camera, which sees it from below."""
    table, wall = Box((1.3, 0.0, 0.58), (0.5, 0.5, 0.02), 0.0), Box((3, 0, 1), (0.1, 3, 1), 0.0)
    settings = MapSettings(fill_behind=0.0, plate=plate)
    looker = Looker(scene([table, wall]), settings, model=CameraModel())
    for x in np.linspace(-0.3, 0.0, 13):
        points = looker.look(base(x))
    over = points[(points[:, 0] > 0.9) & (points[:, 0] < 1.2) & (np.abs(points[:, 1]) < 0.3)]
    assert low < over[:, 2].max() <= high


@pytest.mark.parametrize("depth", [0.0, 0.15, 0.3])
def test_unseen_space_behind_a_surface_counts_as_occupied_so_far(depth):
    low = Box((1.2, 0.0, 0.15), (0.4, 0.4, 0.15), 0.0)  # its top, 0.3 m, is below the camera
    raised = CameraModel(pitch_up=0.0, position=(0.365, 0.0, 0.25))
    settings = MapSettings(fill_above=False, fill_behind=depth)
    points = Looker(scene([low]), settings, model=raised).look(base(), 8)
    behind = points[(points[:, 0] > 0.85) & (np.abs(points[:, 1]) < 0.3)]
    reach = behind[:, 0].max() - 0.8 if len(behind) else 0.0
    assert reach == pytest.approx(depth, abs=0.06)


@pytest.mark.parametrize("known", [True, False])
def test_the_hand_has_room_at_its_goal(known):
    """The goal is in the space above an obstacle that nobody has seen the top of."""
    goal = np.diag([1.0, -1.0, -1.0, 1.0])
    goal[:3, 3] = [0.9, 0.0, 1.0]
    looker = Looker(scene([TALL]), MapSettings(free_goal=known))
    looker.memory.reset(base(), goal_space(goal))
    points = looker.look(base(), 8)
    offset = points - goal[:3, 3]
    at_the_hand = np.linalg.norm(offset[:, :2], axis=1) + np.maximum(-offset[:, 2], 0.0) < 0.1
    assert at_the_hand[offset[:, 2] < LENGTH].any() != known


def test_space_that_was_seen_free_is_never_filled():
    low = Box((1.6, 0.0, 0.1), (0.4, 0.4, 0.1), 0.0)  # the camera looks over it
    wall = Box((4.0, 0.0, 1.0), (0.1, 4.0, 1.0), 0.0)
    points = Looker(scene([low, wall]), MapSettings(near=3.0)).look(base(), 8)
    above = points[(points[:, 0] < 1.5) & (points[:, 2] > 0.4) & (np.abs(points[:, 1]) < 0.4)]
    assert len(above) == 0


def test_where_the_robot_is_there_is_nothing_hidden():
    looker = Looker(scene([TALL]), MapSettings())
    looker.look(base(), 8)
    hand = np.array([[0.825, 0.025, 0.875]])
    assert np.linalg.norm(looker.memory.points(base()) - hand, axis=1).min() < 0.01
    looker.memory.occupy(base(), hand)
    assert np.linalg.norm(looker.memory.points(base()) - hand, axis=1).min() > 0.03


def test_ground_is_seen_ahead_and_unseen_behind():
    looker = Looker(scene(), MapSettings(start_radius=0.6, grace=0.1))
    looker.look(base(), 4)
    places = looker.memory.unseen(base())
    bearing = np.abs(np.arctan2(places[:, 1], places[:, 0]))
    assert (bearing > np.deg2rad(35)).all()
    behind = places[bearing > np.deg2rad(120)]
    assert np.linalg.norm(behind, axis=1).min() == pytest.approx(0.7, abs=0.1)


def test_ground_that_the_base_covered_is_free():
    looker = Looker(scene(), MapSettings(start_radius=0.5, grace=0.0))
    for x in np.linspace(0.0, -1.0, 30):  # backwards
        looker.look(base(x))
    places = looker.memory.unseen(base(-1.0))
    under = (np.abs(places[:, 0] + 0.5) < 0.8) & (np.abs(places[:, 1]) < 0.2)
    assert not under.any()


def test_guarding_unseen_ground_can_be_switched_off():
    looker = Looker(scene(), MapSettings(guard_unseen_ground=False))
    looker.look(base(), 4)
    assert len(looker.memory.unseen(base())) == 0


def test_the_window_follows_and_forgets_what_leaves_it():
    looker = Looker(scene([FRONT]), MapSettings())
    looker.look(base(), 4)
    for x in np.arange(0.0, 12.0, 0.5):
        looker.look(base(-x))
    for x in np.arange(12.0, 0.0, -0.5):  # back again, looking the other way
        points = looker.look(base(-x, yaw=np.pi))
    assert len(points) == 0


def test_reset_forgets_everything():
    looker = Looker(scene([FRONT]), MapSettings())
    looker.look(base(), 4)
    looker.memory.reset(base(), np.empty((0, 3)))
    assert len(looker.memory.points(base())) == 0


@pytest.mark.parametrize(
    "wrong",
    [
        {"columns": 100},
        {"layers": 64},
        {"layers": 0},
        {"voxel": 0.0},
        {"history": np.nan},
        {"history": -1.0},
        {"grace": np.inf},
        {"fill_behind": -0.1},
        {"plate": np.nan},
    ],
)
def test_impossible_settings_are_refused(wrong):
    with pytest.raises(SettingError, match=f"setting '{next(iter(wrong))}': expected"):
        MapSettings(**wrong).make()


@pytest.mark.parametrize("frames", [0, 2.5])
def test_a_memory_of_no_frames_is_refused(frames):
    with pytest.raises(SettingError, match="'frames': expected a whole number from 1 on"):
        FrameSettings(frames=frames)


def test_memory_does_not_grow_with_the_way():
    looker = Looker(scene([FRONT]), MapSettings())
    grid = looker.memory._grid
    places = [array.ctypes.data for array in grid if isinstance(array, np.ndarray)]
    for x in np.linspace(0.0, 20.0, 40):
        looker.look(base(x=x))
    assert looker.memory._grid is grid
    assert places == [array.ctypes.data for array in grid if isinstance(array, np.ndarray)]


def test_presumes_as_little_behind_surfaces_as_it_is_told_until_the_next_reset():
    world = scene([Box((1.5, 0.0, 0.5), (0.25, 0.5, 0.5), 0.0)])
    looker = Looker(world, MapSettings(fill_behind=0.3))
    whole = len(looker.look(base()))
    looker.memory.presume(0.0)
    assert len(looker.memory.points(base())) < whole
    looker.memory.reset(base(), np.empty((0, 3)))
    assert len(looker.look(base())) == whole
