"""How far the robot is from what it must not touch: PyBullet's verdict on collisions.

PyBullet collides with the convex hull of each link's collision mesh, grown by about 1 mm. Asked are
all links against the obstacles, the arm against the floor, and the arm against its own base. Pairs
whose bounding volumes are farther apart than matters are not asked.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pybullet
from numba import njit

from horf_env.scenes.scene import Scene
from horf_env.simulation.obstacles import bounding_boxes, create_obstacles
from horf_env.simulation.robot_body import RobotBody
from horf_env.types import FloatArray

QUERY_RANGE = 0.1
"""Distances above are not told apart [m]: enough to make one check a step in free space."""

FLOOR = "floor"
_BASE = ("base_link", "camera_link", "panda_link0")
# Links that touched the base in 20,000 random configurations within the joint limits. Link 3 and 4
# never did; links 1 and 2 cannot (link 1 overlaps link 0 in all of them).
_HITS_BASE = (
    "panda_link5",
    "panda_link6",
    "panda_link7",
    "panda_hand",
    "panda_leftfinger",
    "panda_rightfinger",
)


@dataclass(frozen=True)
class Clearance:
    """Least distance between the robot and what it must not touch.

    Attributes:
        distance: In m, at most `QUERY_RANGE`; negative in penetration.
        bodies: Link and what it is nearest to ("boxes[3]", "floor", "base_link"); None if nothing
            is within `QUERY_RANGE`.
    """

    distance: float
    bodies: tuple[str, str] | None

    @property
    def is_contact(self) -> bool:
        """Whether the two touch."""
        return self.distance <= 0.0


class ClearanceChecker:
    """Asks PyBullet for the clearance of the robot at its present configuration."""

    def __init__(self, robot: RobotBody, scene: Scene) -> None:
        """Create the shapes of the scene's obstacles in the robot's physics server."""
        self._robot = robot
        self._obstacles = create_obstacles(robot.client, scene)
        self._obstacle_boxes = bounding_boxes(self._obstacles)
        self._floor = pybullet.createCollisionShape(
            pybullet.GEOM_PLANE, physicsClientId=robot.client
        )
        names = robot.link_names
        self._name_of = dict(zip(robot.link_indices, names, strict=True))
        self._base = [names.index(name) for name in _BASE]
        self._base_boxes = robot.link_boxes[self._base]
        self._arm = [k for k in range(len(names)) if k not in self._base]
        self._hitting = [names.index(name) for name in _HITS_BASE]
        self._hitting_radii = robot.link_radii[self._hitting]

    def check(self, centres: FloatArray) -> Clearance:
        """The clearance now.

        Args:
            centres: Centres of the links now, from `RobotBody.motion`, shape (L, 3), m.
        """
        found = [
            *self._to_obstacles(centres),
            *self._arm_to_floor(centres),
            *self._arm_to_base(centres),
        ]
        return min(found, key=lambda c: c.distance, default=Clearance(QUERY_RANGE, None))

    def _to_obstacles(self, centres: FloatArray) -> Iterator[Clearance]:
        gaps = _gaps(centres, self._robot.link_radii, self._obstacle_boxes)
        for k in np.flatnonzero((gaps < QUERY_RANGE).any(axis=0)):
            obstacle = self._obstacles[k]
            yield from self._closest(
                obstacle.name,
                bodyB=-1,
                collisionShapeB=obstacle.shape,
                collisionShapePositionB=obstacle.position,
                collisionShapeOrientationB=obstacle.quaternion_xyzw,
            )

    def _arm_to_floor(self, centres: FloatArray) -> Iterator[Clearance]:
        heights = centres[:, 2] - self._robot.link_radii
        for k in self._arm:
            if heights[k] < QUERY_RANGE:
                yield from self._closest(
                    FLOOR,
                    linkIndexA=self._robot.link_indices[k],
                    bodyB=-1,
                    collisionShapeB=self._floor,
                    collisionShapePositionB=(0.0, 0.0, 0.0),
                )

    def _arm_to_base(self, centres: FloatArray) -> Iterator[Clearance]:
        in_base = _in_base(centres[self._hitting], *self._robot.base_pose())
        near = _gaps(in_base, self._hitting_radii, self._base_boxes) < QUERY_RANGE
        for i, j in zip(*near.nonzero(), strict=True):
            link, base = self._hitting[i], self._base[j]
            yield from self._closest(
                self._robot.link_names[base],
                linkIndexA=self._robot.link_indices[link],
                bodyB=self._robot.body,
                linkIndexB=self._robot.link_indices[base],
            )

    def _closest(self, other: str, **query: object) -> Iterator[Clearance]:
        for point in pybullet.getClosestPoints(
            bodyA=self._robot.body,
            distance=QUERY_RANGE,
            physicsClientId=self._robot.client,
            **query,
        ):
            yield Clearance(point[8], (self._name_of[point[3]], other))


@njit(cache=True)
def _in_base(centres: FloatArray, x: float, y: float, theta: float) -> FloatArray:
    """Points (L, 3) of the world in the frame of a base at (x, y, theta), m and rad."""
    c, s = np.cos(theta), np.sin(theta)
    moved = np.empty_like(centres)
    for k in range(len(centres)):
        dx, dy = centres[k, 0] - x, centres[k, 1] - y
        moved[k, 0], moved[k, 1], moved[k, 2] = c * dx + s * dy, c * dy - s * dx, centres[k, 2]
    return moved


@njit(cache=True)
def _gaps(centres: FloatArray, radii: FloatArray, boxes: FloatArray) -> FloatArray:
    """Distance of each of L spheres to each of M boxes, negative inside, shape (L, M), m."""
    gaps = np.empty((len(centres), len(boxes)))
    for k in range(len(centres)):
        for m in range(len(boxes)):
            squared = 0.0
            for j in range(3):
                c = centres[k, j]
                outside = max(boxes[m, 0, j] - c, c - boxes[m, 1, j], 0.0)
                squared += outside * outside
            gaps[k, m] = np.sqrt(squared) - radii[k]
    return gaps
