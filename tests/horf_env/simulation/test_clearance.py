import igl
import numpy as np
import pytest

from horf_env.robot import ARM_READY, BODIES, collision_parts
from horf_env.robot.limits import ARM_LOWER, ARM_UPPER
from horf_env.scenes.scene import Box, Cylinder, Sphere
from horf_env.simulation import WorldState, clearance
from horf_env.simulation.clearance import QUERY_RANGE

MARGIN = 0.001  # what PyBullet adds to a hull, m


def put(world, *, base=(0.0, 0.0, 0.0), arm=ARM_READY):
    world.set_state(WorldState(np.r_[base, arm], np.zeros(9)))


PARTS = collision_parts()


def hull_distance(robot, configuration, point):
    """Distance of a point to the nearest collision hull of the robot, by libigl."""
    poses = robot.link_poses(configuration)
    distances = []
    for T, parts in zip(poses, PARTS, strict=True):
        local = (point - T[:3, 3]) @ T[:3, :3]
        for part in parts:
            faces = np.asarray(part.faces, dtype=np.int64)
            squared, _, _ = igl.point_mesh_squared_distance(local[None], part.vertices, faces)
            distances.append(np.sqrt(squared[0]))
    return min(distances)


@pytest.mark.parametrize(
    ("obstacle", "distance"),
    [
        ({"boxes": [Box(center=(0.0, 0.5, 0.2), half_extents=(0.1, 0.2, 0.1), yaw=0.0)]}, 0.05),
        (
            # Turned by 90 degrees: the long side now lies along y.
            {"boxes": [Box(center=(0.0, 0.5, 0.2), half_extents=(0.2, 0.1, 0.1), yaw=np.pi / 2)]},
            0.05,
        ),
        (
            # Turned the other way: the long side lies along x.
            {"boxes": [Box(center=(-1.4, 0.0, 0.2), half_extents=(0.01, 1, 0.1), yaw=np.pi / 2)]},
            0.05,
        ),
        ({"boxes": [Box(center=(-0.5, 0.0, 0.2), half_extents=(0.002, 1, 0.2), yaw=0.0)]}, None),
        ({"boxes": [Box(center=(-0.4, 0.0, 0.2), half_extents=(0.002, 1, 0.2), yaw=0.0)]}, 0.048),
        ({"cylinders": [Cylinder(center=(0.0, 0.4, 0.2), radius=0.1, half_height=0.2)]}, 0.05),
        ({"spheres": [Sphere(center=(-0.45, 0.0, 0.2), radius=0.07)]}, 0.03),
        ({"spheres": [Sphere(center=(-0.35, 0.0, 0.2), radius=0.07)]}, -0.07),
    ],
)
def test_known_distances_to_the_base(make_world, obstacle, distance):
    found = make_world(**obstacle).clearance
    if distance is None:
        assert (found.distance, found.bodies) == (QUERY_RANGE, None)
        return
    assert found.distance == pytest.approx(distance - MARGIN, abs=1e-4)
    assert found.bodies == ("base_link", f"{next(iter(obstacle))}[0]")
    assert found.is_contact == (distance <= 0)


def test_edges_and_corners_of_the_base_are_as_sharp_as_its_hull(make_world, make_scene):
    radius, world = 0.01, make_world()
    for way in ([-1.0, -1.0, 0.0], [-1.0, 1.0, 1.0], [-1.0, 0.0, 1.0]):
        corner = np.array([0.35, 0.25, 0.19]) * way + [0.0, 0.0, 0.19]
        centre = corner + 0.03 * np.array(way) / np.linalg.norm(way)
        world.set_scene(make_scene(spheres=[Sphere(center=tuple(centre), radius=radius)]))
        found = world.clearance
        assert found.bodies == ("base_link", "spheres[0]")
        assert found.distance == pytest.approx(0.03 - radius - MARGIN, abs=1e-4)


def test_the_verdict_is_the_hull_plus_a_millimetre(make_world, make_scene, robot):
    rng = np.random.default_rng(2)
    ball, seen, world = 0.02, [], make_world()
    for _ in range(40):
        configuration = np.r_[rng.uniform(-1, 1, 3), ARM_READY + rng.uniform(-0.4, 0.4, 7)]
        T = robot.link_poses(configuration)[rng.integers(3, 9)]
        centre = T[:3, 3] + rng.normal(0, 0.12, 3)
        world.set_scene(make_scene(spheres=[Sphere(center=tuple(centre), radius=ball)]))
        world.set_state(WorldState(configuration, np.zeros(9)))
        found = world.clearance
        if found.bodies is not None and 0.002 < found.distance < 0.05:
            expected = hull_distance(robot, configuration, centre) - ball - MARGIN
            assert found.distance == pytest.approx(expected, abs=2e-4)
            seen.append(found.bodies[0])
    assert len(seen) >= 8
    assert len(set(seen)) >= 3


def test_culling_hides_nothing(make_world, monkeypatch):
    rng = np.random.default_rng(4)
    boxes = [
        Box(
            center=tuple(rng.uniform([-1.2, -1.2, 0.2], [1.2, 1.2, 1.2])),
            half_extents=tuple(rng.uniform(0.02, 0.2, 3)),
            yaw=rng.uniform(0, 3),
        )
        for _ in range(12)
    ]
    world = make_world(boxes=boxes)
    states = [
        WorldState(np.r_[rng.uniform(-2, 2, 3), rng.uniform(ARM_LOWER, ARM_UPPER)], np.zeros(9))
        for _ in range(150)
    ]

    def clearances():
        for state in states:
            world.set_state(state)
            yield world.clearance

    culled = list(clearances())
    monkeypatch.setattr(clearance, "_gaps", lambda c, r, b: np.full((len(c), len(b)), -1.0))
    assert list(clearances()) == culled
    partners = {found.bodies[1] for found in culled if found.bodies}
    assert {"base_link", "panda_link0"} & partners
    assert any(found.bodies is None for found in culled)


def test_the_floor_counts_for_the_arm_and_not_for_the_base(make_world, robot):
    world = make_world()
    assert world.clearance.bodies is None  # although the base stands on the floor
    arm = np.array([0.0, 1.7, 0.0, -1.0, 0.0, 2.3, 0.785])
    lowest = []
    for lower in (0.0, 0.1, 0.2, 0.3):
        configuration = np.r_[0, 0, 0, arm - lower * np.eye(7)[3]]
        poses = robot.link_poses(configuration)[1:]
        z = min(
            (T[:3, :3] @ part.vertices.T + T[:3, 3:])[2].min()
            for T, parts in zip(poses, PARTS[1:], strict=True)
            for part in parts
        )
        world.set_state(WorldState(configuration, np.zeros(9)))
        lowest.append(z)
        assert world.clearance.distance == pytest.approx(min(z - MARGIN, QUERY_RANGE), abs=3e-4)
        assert world.clearance.bodies[1] == "floor"
    assert max(lowest) > 0 > min(lowest)


def test_an_arm_folded_onto_its_base_is_in_contact(make_world):
    world = make_world()
    folded = np.array([0.0, 1.2, 0.0, -2.9, 0.0, 1.0, 0.785])
    for base in ((0.0, 0.0, 0.0), (2.0, -1.0, 2.3)):
        put(world, base=base, arm=folded)
        link, other = world.clearance.bodies
        assert world.clearance.is_contact
        assert other in {"base_link", "panda_link0", "camera_link"}
        assert link in {"panda_link5", "panda_link6", "panda_link7", "panda_hand"}


def test_the_ready_pose_touches_nothing(make_world):
    assert make_world().clearance == clearance.Clearance(QUERY_RANGE, None)


def test_every_link_of_the_robot_is_checked(make_world, make_scene, robot):
    world = make_world()
    poses = robot.link_poses(np.r_[0, 0, 0, ARM_READY])
    hit = set()
    for body, T, parts in zip(BODIES, poses, PARTS, strict=True):
        for part in parts:
            centre = tuple(T[:3, :3] @ part.vertices.mean(axis=0) + T[:3, 3])
            world.set_scene(make_scene(spheres=[Sphere(center=centre, radius=0.005)]))
            found = world.clearance
            assert found.is_contact, body.frame
            hit.add(found.bodies[0])
    assert len(hit) >= 9
