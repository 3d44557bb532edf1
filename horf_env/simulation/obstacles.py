"""The obstacles of a scene as collision shapes.

They are shapes to measure distances to, not bodies: a motion ends at the first contact, so nothing
ever bounces off an obstacle, and PyBullet measures to a shape exactly as it does to a body. A body
would cost 0.2 ms more and leak.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pybullet

from horf_env.scenes.scene import Scene
from horf_env.types import FloatArray

_UPRIGHT = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Obstacle:
    """One obstacle.

    Attributes:
        name: Its place in the scene file, as "boxes[3]".
        shape: Index of its collision shape.
        position: Centre, m.
        quaternion_xyzw: Orientation.
        reach: Half extents of its bounding box along the world's axes, m.
    """

    name: str
    shape: int
    position: tuple[float, float, float]
    quaternion_xyzw: tuple[float, float, float, float]
    reach: tuple[float, float, float]


def create_obstacles(client: int, scene: Scene) -> list[Obstacle]:
    """Collision shapes of all obstacles of a scene; the floor is not among them."""
    return [*_boxes(client, scene), *_cylinders(client, scene), *_spheres(client, scene)]


def bounding_boxes(obstacles: list[Obstacle]) -> FloatArray:
    """Lower and upper corner of each obstacle's bounding box, shape (M, 2, 3), m."""
    centres = np.array([obstacle.position for obstacle in obstacles]).reshape(-1, 3)
    reaches = np.array([obstacle.reach for obstacle in obstacles]).reshape(-1, 3)
    return np.stack([centres - reaches, centres + reaches], axis=1)


def _boxes(client: int, scene: Scene) -> Iterator[Obstacle]:
    for k, box in enumerate(scene.boxes):
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_BOX, halfExtents=box.half_extents, physicsClientId=client
        )
        a, b, c = box.half_extents
        cos, sin = abs(np.cos(box.yaw)), abs(np.sin(box.yaw))
        reach = (float(a * cos + b * sin), float(a * sin + b * cos), c)
        turn = pybullet.getQuaternionFromEuler((0.0, 0.0, box.yaw))
        yield Obstacle(f"boxes[{k}]", shape, box.center, turn, reach)


def _cylinders(client: int, scene: Scene) -> Iterator[Obstacle]:
    for k, cylinder in enumerate(scene.cylinders):
        r, h = cylinder.radius, cylinder.half_height
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_CYLINDER, radius=r, height=2.0 * h, physicsClientId=client
        )
        yield Obstacle(f"cylinders[{k}]", shape, cylinder.center, _UPRIGHT, (r, r, h))


def _spheres(client: int, scene: Scene) -> Iterator[Obstacle]:
    for k, sphere in enumerate(scene.spheres):
        r = sphere.radius
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_SPHERE, radius=r, physicsClientId=client
        )
        yield Obstacle(f"spheres[{k}]", shape, sphere.center, _UPRIGHT, (r, r, r))
