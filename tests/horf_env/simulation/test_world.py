import numpy as np
import pybullet
import pytest

from horf_env.errors import UnknownNameError
from horf_env.robot import ARM_READY
from horf_env.robot.limits import ARM_LOWER, ARM_UPPER
from horf_env.scenes.scene import Box
from horf_env.simulation import PyBulletWorld, WorldState
from horf_env.simulation.loading import RobotFile, connect
from horf_env.simulation.robot_body import RobotBody
from horf_env.simulation.world import WorldNotReadyError

FORWARD = np.array([1.0, 0, 0, 0, 0, 0, 0, 0, 0])


def test_a_scene_puts_the_robot_at_its_start_at_rest(make_world):
    state = make_world(base=(1.0, 2.0, 0.5)).state
    np.testing.assert_allclose(state.configuration, [1.0, 2.0, 0.5, *ARM_READY])
    np.testing.assert_array_equal(state.velocity, np.zeros(9))


@pytest.mark.parametrize("mode", ["kinematic", "dynamic"])
def test_state_survives_a_round_trip(make_world, mode):
    world = make_world(mode=mode)
    state = WorldState(np.r_[1.0, -2.0, 2.5, ARM_READY + 0.1], np.linspace(-0.4, 0.4, 9))
    world.set_state(state)
    np.testing.assert_allclose(world.state.configuration, state.configuration, atol=1e-12)
    np.testing.assert_allclose(world.state.velocity, state.velocity, atol=1e-12)


def test_a_new_scene_replaces_the_old_one(make_world, make_scene):
    here = Box(center=(0.0, 0.5, 0.2), half_extents=(0.1, 0.2, 0.1), yaw=0.0)
    world = make_world(boxes=[here])
    assert world.clearance.bodies
    world.set_scene(make_scene())
    assert world.clearance.bodies is None
    world.set_scene(make_scene(boxes=[here]))
    assert world.clearance.bodies == ("base_link", "boxes[0]")


def test_worlds_do_not_disturb_each_other(make_world):
    wall = Box(center=(0.6, 0, 0.2), half_extents=(0.1, 3, 0.2), yaw=0.0)
    first, second = make_world(boxes=[wall]), make_world()
    assert second.move(4.0 * FORWARD, 0.05).contact is None
    assert first.state.configuration[0] == 0.0
    first.close()
    assert second.move(4.0 * FORWARD, 0.05).configuration[0] == pytest.approx(0.4)


def test_closing_twice_is_fine_and_a_closed_world_says_so(make_scene):
    world = PyBulletWorld()
    world.set_scene(make_scene())
    world.render_rgb(width=16, height=16)
    world.close()
    world.close()
    with pytest.raises(WorldNotReadyError, match="closed"):
        world.set_scene(make_scene())
    with pytest.raises(WorldNotReadyError, match="no scene"):
        world.move(FORWARD, 0.05)


def test_a_world_without_a_scene_says_so():
    world = PyBulletWorld()
    with pytest.raises(WorldNotReadyError, match="set_scene"):
        _ = world.state
    world.close()


def test_an_unknown_mode_names_the_nearest():
    with pytest.raises(UnknownNameError, match="did you mean 'kinematic'"):
        PyBulletWorld(mode="kinematics")


def test_nothing_is_written_to_stdout(capfd, make_world):
    world = make_world()
    world.move(FORWARD, 0.05)
    world.render_rgb(width=16, height=16)
    assert capfd.readouterr().out == ""


def test_links_are_where_the_kinematics_put_them(make_world, robot):
    """PyBullet and Pinocchio read the same robot out of the URDF."""
    client = connect()
    file = RobotFile()
    body = RobotBody(client, file)
    rng = np.random.default_rng(0)
    for _ in range(20):
        configuration = np.r_[rng.uniform(-3, 3, 3), rng.uniform(ARM_LOWER, ARM_UPPER)]
        body.set_state(configuration, np.zeros(9))
        poses = robot.link_poses(configuration)
        for name, T in zip(robot.link_names, poses, strict=True):
            link = body.link_indices[body.link_names.index(name)]
            state = pybullet.getLinkState(body.body, link, physicsClientId=client)
            np.testing.assert_allclose(state[4], T[:3, 3], atol=1e-5)
    pybullet.disconnect(physicsClientId=client)
    file.close()


def test_no_point_moves_faster_than_the_stated_speed():
    client = connect()
    file = RobotFile()
    body = RobotBody(client, file)
    rng = np.random.default_rng(0)
    for _ in range(20):
        configuration = np.r_[rng.uniform(-3, 3, 3), rng.uniform(ARM_LOWER, ARM_UPPER)]
        velocity = rng.uniform(-2, 2, 9)
        body.set_state(configuration, velocity)
        motion = body.motion()
        after = (
            configuration
            + 1e-6
            * np.r_[
                velocity[0] * np.cos(configuration[2]),
                velocity[0] * np.sin(configuration[2]),
                velocity[1:],
            ]
        )
        body.set_state(after, velocity)
        fastest = np.linalg.norm(body.motion().centres - motion.centres, axis=1).max() / 1e-6
        assert 0.5 * motion.speed < fastest <= motion.speed
    pybullet.disconnect(physicsClientId=client)
    file.close()


def test_pictures_show_robot_and_obstacles(make_world, make_scene):
    world = make_world()
    picture = world.render_rgb(width=160, height=120)
    assert picture.shape == (120, 160, 3)
    assert picture.dtype == np.uint8
    np.testing.assert_array_equal(world.render_rgb(width=160, height=120), picture)
    world.set_state(WorldState(np.r_[0, 0, 1.5, ARM_READY], np.zeros(9)))
    turned = world.render_rgb(width=160, height=120)
    assert (turned != picture).any(axis=-1).mean() > 0.01
    wall = Box(center=(1.5, 0, 0.5), half_extents=(0.1, 2, 0.5), yaw=0.0)
    world.set_scene(make_scene(boxes=[wall]))
    assert (world.render_rgb(width=160, height=120) != picture).any(axis=-1).mean() > 0.03
