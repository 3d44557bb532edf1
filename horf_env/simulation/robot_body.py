"""The robot inside PyBullet: its joints, and how its links move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pybullet
from numba import njit

from horf_env.robot.configuration import velocity_map
from horf_env.simulation.loading import RobotFile, load_robot, movable_joints
from horf_env.types import FloatArray


@dataclass(frozen=True)
class LinkMotion:
    """Where the links that can collide are, and the fastest point of any of them.

    Attributes:
        centres: Their centres of mass in the world frame, shape (L, 3), m.
        speed: No point of the robot moves faster [m/s].
    """

    centres: FloatArray
    speed: float


class RobotBody:
    """Joint states and link motion of the robot in one physics server.

    Attributes:
        client: Number of the server.
        body: Index of the robot there.
        link_names: Names of the links that can collide.
        link_indices: Their indices in PyBullet.
        link_boxes: Their bounding boxes (lower, upper corner) at the zero configuration, where the
            frame of the base is the world's; shape (L, 2, 3), m.
        link_radii: Radius of a sphere about each link's centre of mass around it, shape (L,), m.
    """

    def __init__(self, client: int, file: RobotFile) -> None:
        """Load the robot at the zero configuration."""
        self.client = client
        self.body = body = load_robot(client, file, visuals=False)
        self._joints = movable_joints(client, body)
        infos = [pybullet.getJointInfo(body, j, physicsClientId=client) for j in self._joints]
        self._lower, self._upper = np.array([info[8:10] for info in infos]).T
        self._efforts = [info[10] for info in infos]
        self.link_indices = links = [
            k
            for k in range(pybullet.getNumJoints(body, physicsClientId=client))
            if pybullet.getCollisionShapeData(body, k, physicsClientId=client)
        ]
        self.link_names = [
            pybullet.getJointInfo(body, k, physicsClientId=client)[12].decode() for k in links
        ]
        self.link_boxes = np.array(
            [pybullet.getAABB(body, k, physicsClientId=client) for k in links]
        )
        states = pybullet.getLinkStates(body, links, physicsClientId=client)
        centres = np.array([state[0] for state in states])
        corner = np.maximum(self.link_boxes[:, 1] - centres, centres - self.link_boxes[:, 0])
        self.link_radii: FloatArray = np.linalg.norm(corner, axis=1)

    def within_joint_limits(self, configuration: FloatArray) -> FloatArray:
        """The configuration with each joint stopped at its limits, shape (10,)."""
        return np.clip(configuration, self._lower, self._upper)

    def set_state(self, configuration: FloatArray, velocity: FloatArray) -> None:
        """Put the robot somewhere, moving with a velocity.

        Args:
            configuration: Shape (10,), m and rad.
            velocity: Shape (9,), m/s and rad/s.
        """
        rates = velocity_map(configuration[2]) @ velocity
        pybullet.resetJointStatesMultiDof(
            self.body,
            self._joints,
            configuration[:, None].tolist(),
            rates[:, None].tolist(),
            physicsClientId=self.client,
        )

    def configuration(self) -> FloatArray:
        """Configuration now, shape (10,), m and rad."""
        states = pybullet.getJointStates(self.body, self._joints, physicsClientId=self.client)
        return np.array([state[0] for state in states])

    def state(self) -> tuple[FloatArray, FloatArray]:
        """Configuration (10,) and velocity (9,) now.

        The forward speed is the speed over ground along the heading; sideways slip is left out.
        """
        states = pybullet.getJointStates(self.body, self._joints, physicsClientId=self.client)
        configuration, rates = np.array([state[:2] for state in states]).T.copy()
        return configuration, velocity_map(configuration[2]).T @ rates

    def base_pose(self) -> tuple[float, float, float]:
        """(x, y, theta) now, in m and rad."""
        x, y, theta = (
            state[0]
            for state in pybullet.getJointStates(
                self.body, self._joints[:3], physicsClientId=self.client
            )
        )
        return x, y, theta

    def command(self, velocity: FloatArray) -> None:
        """Set the targets of the velocity motors, with the forces that the URDF allows.

        A differential drive rolls along its heading and does not slip sideways: the motors of the
        virtual joints get (v cos theta, v sin theta, omega) for the heading of this instant.

        Args:
            velocity: Shape (9,), m/s and rad/s.
        """
        _, _, theta = self.base_pose()
        pybullet.setJointMotorControlArray(
            self.body,
            self._joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=(velocity_map(theta) @ velocity).tolist(),
            forces=self._efforts,
            physicsClientId=self.client,
        )

    def motion(self) -> LinkMotion:
        """Where the links are and how fast any of their points moves."""
        states = pybullet.getLinkStates(
            self.body, self.link_indices, computeLinkVelocity=1, physicsClientId=self.client
        )
        # Centre, linear and angular velocity in one row a link: arrays of tuples are dear.
        links = np.array([state[0] + state[6] + state[7] for state in states])
        return LinkMotion(links[:, :3], _fastest(links, self.link_radii))


@njit(cache=True)
def _fastest(links: FloatArray, radii: FloatArray) -> float:
    """Bound on the speed of all points of the links (columns 3 to 8 of `links`), in m/s."""
    fastest = 0.0
    for k in range(len(links)):
        vx, vy, vz, wx, wy, wz = links[k, 3:]
        linear = np.sqrt(vx * vx + vy * vy + vz * vz)
        angular = np.sqrt(wx * wx + wy * wy + wz * wz)
        fastest = max(fastest, linear + angular * radii[k])
    return fastest
