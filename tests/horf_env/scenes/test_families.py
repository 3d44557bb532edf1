"""The laws of the scene families, on several seeds each."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from horf_env.scenes.distance import obstacle_distance, outline_distance
from horf_env.scenes.families import SCENES, aisle, doorway
from horf_env.scenes.instances import random_scene
from horf_env.scenes.scene import Box, Scene
from horf_env.scenes.scene_mesh import triangles
from horf_env.scenes.surface_points import surface_points

SEEDS = range(8)
everywhere = pytest.mark.parametrize("seed", SEEDS)
all_families = pytest.mark.parametrize("name", SCENES)


def _bodies(scene: Scene) -> list[Scene]:
    """Each obstacle as a scene of its own."""
    parts = [("boxes", b) for b in scene.boxes]
    parts += [("cylinders", c) for c in scene.cylinders] + [("spheres", s) for s in scene.spheres]
    empty = {"boxes": (), "cylinders": (), "spheres": ()}
    rest = {"name": scene.name, "start": scene.start, "goal": scene.goal}
    return [Scene(**{**empty, kind: (body,)}, **rest) for kind, body in parts]


def _bottom(body: Scene) -> float:
    lows = [b.center[2] - b.half_extents[2] for b in body.boxes]
    lows += [c.center[2] - c.half_height for c in body.cylinders]
    return min(lows + [s.center[2] - s.radius for s in body.spheres])


def _is_wall(box: Box) -> bool:
    """Walls are the only things thicker than a board that are longer than any furniture or door."""
    return max(box.half_extents[:2]) > 1.1 or box.half_extents[2] >= 1.1


def test_families_are_the_four_of_the_paper():
    assert list(SCENES) == ["aisle", "room", "forest", "doorway"]
    assert all(SCENES[name].name == name for name in SCENES)


@all_families
def test_same_seed_same_scene(name, draw):
    assert random_scene(name, 3) == draw(name, 3)
    assert random_scene(name, 4) != draw(name, 3)


@all_families
@everywhere
def test_start_is_in_the_open_with_the_arm_ready(name, seed, draw):
    scene = draw(name, seed)
    base = np.array([scene.start.base[:2]])
    assert outline_distance(scene, base)[0] >= 0.9 - 1e-6
    np.testing.assert_allclose(scene.start.arm, [0, -0.3, 0, -2.2, 0, 2, np.pi / 4], atol=1e-6)


def test_start_headings_cover_the_circle(draw):
    headings = [draw(name, seed).start.base[2] for name in SCENES for seed in SEEDS]
    assert -np.pi <= min(headings)
    assert max(headings) <= np.pi
    counts, _ = np.histogram(headings, bins=4, range=(-np.pi, np.pi))
    assert counts.min() >= 2  # of 32


@all_families
@everywhere
def test_goal_has_room_for_the_hand(name, seed, draw):
    scene = draw(name, seed)
    goal = np.array(scene.goal.position)
    assert obstacle_distance(scene, goal[None])[0] >= 0.08 - 1e-6
    # The corners of a hand 0.2 m wide and 0.06 m thick, from the palm to the flange.
    corners = np.array(
        [[x, y, z] for x in (-0.03, 0.03) for y in (-0.1, 0.1) for z in (-0.045, -0.19)]
    )
    hand = Rotation.from_quat(scene.goal.quaternion_xyzw).apply(corners) + goal
    assert obstacle_distance(scene, hand).min() >= 0.0
    assert hand[:, 2].min() >= 0.0


@all_families
@everywhere
def test_fingers_open_horizontally_and_no_hand_points_up(name, seed, draw):
    R = Rotation.from_quat(draw(name, seed).goal.quaternion_xyzw).as_matrix()
    assert abs(R[2, 1]) < 1e-5
    assert R[2, 2] < 1e-5


@all_families
@everywhere
def test_walls_are_closed_high_and_thick(name, seed, draw):
    scene = draw(name, seed)
    walls = [box for box in scene.boxes if _is_wall(box) and _touches_floor(box)]
    assert len(walls) >= 4
    for box in walls:
        assert 2 * box.half_extents[2] >= 1.5
        assert 2 * min(box.half_extents[:2]) >= 0.1
    only_walls = Scene(scene.name, tuple(walls), (), (), scene.start, scene.goal)
    mesh = trimesh.Trimesh(*triangles(only_walls), process=False)
    angles = np.linspace(-np.pi, np.pi, 3601)
    rays = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    for z in (0.05, 0.75, 1.45):
        origins = np.broadcast_to([*scene.start.base[:2], z], rays.shape)
        assert mesh.ray.intersects_any(origins, rays).all()


def _touches_floor(box: Box) -> bool:
    return abs(box.center[2] - box.half_extents[2]) < 1e-5


@all_families
@pytest.mark.parametrize("seed", range(2))
def test_furniture_touches_but_does_not_overlap(name, seed, draw):
    scene = draw(name, seed)
    bodies = _bodies(scene)
    samples = [surface_points(body, 0.05) for body in bodies]
    for k, body in enumerate(bodies):
        others = np.vstack(samples[:k] + samples[k + 1 :])
        assert obstacle_distance(body, others).min() >= -1e-4


@pytest.mark.parametrize("name", [name for name in SCENES if name != "forest"])
@pytest.mark.parametrize("seed", range(2))
def test_nothing_floats(name, seed, draw):
    bodies = _bodies(draw(name, seed))
    samples = [surface_points(body, 0.1) for body in bodies]  # corners and centres included
    supported = {k for k, body in enumerate(bodies) if abs(_bottom(body)) < 1e-5}
    waiting = set(range(len(bodies))) - supported
    while waiting:
        held = {
            k
            for k in waiting
            for s in supported
            if obstacle_distance(bodies[s], samples[k]).min() < 1e-4
            or obstacle_distance(bodies[k], samples[s]).min() < 1e-4
        }
        assert held, [bodies[k] for k in waiting]
        supported |= held
        waiting -= held


@everywhere
def test_aisle_leaves_a_gap_for_the_robot(seed, draw):
    scene = draw("aisle", seed)
    sides: dict[bool, list[np.ndarray]] = {True: [], False: []}
    for body in _bodies(scene):
        center = (*body.boxes, *body.cylinders)[0].center
        points = surface_points(body, 0.02)[:, :2]
        if not (body.boxes and _is_wall(body.boxes[0]) and abs(center[1]) > 1.5):
            sides[center[1] > 0].append(points)
    left, right = (np.unique(np.round(np.vstack(sides[k]), 3), axis=0) for k in (True, False))
    inside = (left[:, 0] < 16.0) & (left[:, 0] > 0.0)
    gap, _ = cKDTree(right[(right[:, 0] < 16.0) & (right[:, 0] > 0.0)]).query(left[inside])
    assert gap.min() >= aisle.MIN_GAP - 1e-3
    assert (left[:, 1].min() + 1.5, 1.5 - right[:, 1].max()) >= (aisle.MIN_GAP, aisle.MIN_GAP)


@pytest.mark.parametrize("name", ["aisle", "doorway"])
@everywhere
def test_shelf_goal_is_on_a_layer_and_the_hand_points_in(name, seed, draw):
    scene = draw(name, seed)
    goal = np.array(scene.goal.position)
    assert 0.4 <= goal[2] <= 1.2
    approach = Rotation.from_quat(scene.goal.quaternion_xyzw).as_matrix()[:, 2]
    assert abs(approach[2]) < 1e-5
    # Boards above and below the goal, the back ahead of it, and nothing behind it.
    rays = np.array([[0, 0, 1], [0, 0, -1], approach, -approach])
    mesh = trimesh.Trimesh(*triangles(scene), process=False)
    hits, index, _ = mesh.ray.intersects_location(np.tile(goal, (4, 1)), rays, multiple_hits=False)
    free = np.full(4, np.inf)
    free[index] = np.linalg.norm(hits - goal, axis=1)
    assert np.all(free[:2] < 0.42)
    assert free[2] < 0.5
    assert free[3] > 1.0


@everywhere
def test_room_has_a_table_and_its_goal_is_above_or_under_the_top(seed, draw):
    scene = draw("room", seed)
    x, y, z = scene.goal.position
    tops = [b for b in scene.boxes if abs(b.half_extents[2] - 0.02) < 1e-6 and b.center[2] > 0.6]
    assert len(tops) == 1
    top = tops[0].center[2] + 0.02
    assert 0.72 <= top <= 0.8
    down = Rotation.from_quat(scene.goal.quaternion_xyzw).as_matrix()[2, 2]
    column = np.array([[x, y, top - 0.02]])
    assert obstacle_distance(scene, column)[0] < 0.0  # the top is straight above or below the goal
    posts = [c for c in scene.cylinders if c.radius <= 0.05]
    if z > top:
        assert down == pytest.approx(-1.0, abs=1e-5)
        bottles = [c for c in posts if c.center[2] > top]
        assert len(bottles) == 4
        assert all(0.15 < np.hypot(c.center[0] - x, c.center[1] - y) < 0.35 for c in bottles)
    else:
        assert down == pytest.approx(0.0, abs=1e-5)
        assert len(posts) == 4


def test_room_offers_both_kinds_of_goal(draw):
    assert len({draw("room", seed).goal.position[2] > 0.7 for seed in SEEDS}) == 2


@everywhere
def test_forest_has_the_stated_numbers_of_boxes(seed, draw):
    scene = draw("forest", seed)
    boxes = [b for b in scene.boxes if not _is_wall(b)]
    floating = [b for b in boxes if not _touches_floor(b)]
    standing = [b for b in boxes if _touches_floor(b)]
    assert 18 <= len(standing) <= 25
    assert 15 <= len(floating) <= 25
    centers = np.array([b.center[:2] for b in standing])
    assert cKDTree(centers).query(centers, k=2)[0][:, 1].min() >= 1.2 - 1e-5


@everywhere
def test_doorway_is_as_wide_as_a_door(seed, draw):
    scene = draw("doorway", seed)
    x = (doorway.FIRST.x1 + doorway.SECOND.x0) / 2
    y = np.linspace(-2.95, 2.95, 5901)
    line = np.column_stack([np.full_like(y, x), y, np.full_like(y, 1.0)])
    free = obstacle_distance(scene, line) > 0.0
    width = free.sum() * (y[1] - y[0])
    assert 0.95 - 2e-3 <= width <= 1.2 + 2e-3
    assert np.count_nonzero(np.diff(free.astype(int))) == 2  # one opening
    assert scene.start.base[0] < x < scene.goal.position[0]
    middle = float(y[free].mean())
    above = obstacle_distance(scene, np.array([[x, middle, 1.95], [x, middle, 2.05]]))
    assert above[0] > 0.0 > above[1]  # there is a wall above the door
