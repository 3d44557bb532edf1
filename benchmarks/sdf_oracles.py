"""Other programs' distances to the robot's bodies, to judge its own by: libigl and PyBullet."""

from __future__ import annotations

from collections.abc import Sequence

import igl
import numpy as np
import pybullet

from horf_env.robot import MobileManipulator, Part
from horf_env.robot.bodies import BODIES
from horf_env.simulation.loading import RobotFile, connect
from horf_env.simulation.robot_body import RobotBody
from horf_env.types import FloatArray

_MARGIN = 1e-3  # m; by this PyBullet grows the hull of a mesh
_SPHERE = 1e-4  # m; radius of the probe
_RANGE = 1.0  # m; PyBullet is asked for no larger distance


def brute_force(parts: Sequence[Part], points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Signed distance of points to a union of parts and its gradient, by libigl.

    Inside, it is the distance to the surface of the part in which the point is deepest.

    Args:
        parts: The body.
        points: Shape (N, 3), frame of the body, m.

    Returns:
        Distance, shape (N,), m, and the unit vectors from the nearest surface points, negative
        inside, shape (N, 3).
    """
    least, gradient = np.full(len(points), np.inf), np.zeros_like(points)
    for part in parts:
        faces = np.ascontiguousarray(part.faces, dtype=np.int64)
        squared, _, nearest = igl.point_mesh_squared_distance(points, part.vertices, faces)
        inside = igl.fast_winding_number(part.vertices, faces, points) > 0.5
        distance = np.where(inside, -1.0, 1.0) * np.sqrt(squared)
        closer = distance < least
        least[closer] = distance[closer]
        gradient[closer] = (points - nearest)[closer] / distance[closer, None]
    return least, gradient


class ClosestPoints:
    """PyBullet's distances of points to the bodies at the zero configuration."""

    def __enter__(self) -> ClosestPoints:
        """Start a physics server."""
        self._client, self._file = connect(), RobotFile()
        self._robot = RobotBody(self._client, self._file)
        self._poses = MobileManipulator.load().state(np.zeros(10), overshoot=True).link_poses
        self._probe = pybullet.createCollisionShape(
            pybullet.GEOM_SPHERE, radius=_SPHERE, physicsClientId=self._client
        )
        return self

    def __exit__(self, *exception: object) -> None:
        """Stop it."""
        pybullet.disconnect(physicsClientId=self._client)
        self._file.close()

    def distance(self, body: int, points: FloatArray) -> FloatArray:
        """Distances with the margin taken away, shape (N,), m; inf beyond `_RANGE`."""
        T = self._poses[body]
        world = (points @ T[:3, :3].T + T[:3, 3]).tolist()
        least = np.full(len(points), np.inf)
        for name in BODIES[body].links:
            if name in self._robot.link_names:
                link = self._robot.link_indices[self._robot.link_names.index(name)]
                least = np.minimum(least, self._link_distance(link, world))
        return least

    def _link_distance(self, link: int, points: list[list[float]]) -> FloatArray:
        query = {
            "bodyA": self._robot.body,
            "linkIndexA": link,
            "bodyB": -1,
            "collisionShapeB": self._probe,
            "distance": _RANGE,
            "physicsClientId": self._client,
        }
        contacts = (
            pybullet.getClosestPoints(collisionShapePositionB=point, **query) for point in points
        )
        grown = [min((c[8] for c in near), default=np.inf) for near in contacts]
        return np.array(grown) + _SPHERE + _MARGIN
