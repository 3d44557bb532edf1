"""Worlds and scenes for the tests of the simulation."""

import pytest

from horf_env.robot import ARM_READY
from horf_env.scenes.scene import Goal, Scene, Start
from horf_env.simulation import PyBulletWorld


@pytest.fixture
def make_scene():
    """A scene of given obstacles, with the robot at the origin or elsewhere."""

    def make(*, boxes=(), cylinders=(), spheres=(), base=(0.0, 0.0, 0.0), arm=tuple(ARM_READY)):
        return Scene(
            name="test",
            boxes=tuple(boxes),
            cylinders=tuple(cylinders),
            spheres=tuple(spheres),
            start=Start(base=base, arm=arm),
            goal=Goal(position=(2.0, 0.0, 1.0), quaternion_xyzw=(0.0, 0.0, 0.0, 1.0)),
        )

    return make


@pytest.fixture
def make_world(make_scene):
    """Worlds with a scene, closed after the test."""
    worlds = []

    def make(*, mode="kinematic", **obstacles):
        world = PyBulletWorld(mode=mode)
        worlds.append(world)
        world.set_scene(make_scene(**obstacles))
        return world

    yield make
    for world in worlds:
        world.close()
