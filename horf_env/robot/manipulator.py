"""Kinematics of the mobile manipulator, computed by Pinocchio."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from horf_env.errors import ConfigurationError
from horf_env.robot.bodies import BODIES, collision_parts, visual_parts
from horf_env.robot.configuration import velocity_map
from horf_env.robot.description import urdf_text
from horf_env.robot.jacobians import poses_and_jacobians
from horf_env.robot.joint_limits import check_limits, within
from horf_env.robot.limits import ARM_LOWER, ARM_UPPER
from horf_env.robot.parts import Elements, Part
from horf_env.robot.vectors import cross
from horf_env.types import N_CONFIGURATION, N_VELOCITIES, FloatArray

_EE_FRAME = "hand_tcp"

# Which velocities move which body: the base has two, each further link one more; all of them move
# the end effector, the last row; shape (10, 9).
_MOVES = np.tri(len(BODIES) + 1, N_VELOCITIES, k=1)

# The base may be anywhere.
_LOWER = (*[-sys.float_info.max] * 3, *ARM_LOWER.tolist())
_UPPER = (*[sys.float_info.max] * 3, *ARM_UPPER.tolist())


@dataclass(frozen=True)
class RobotState:
    """A configuration with everything that follows from it: forward kinematics has been run.

    Attributes:
        configuration: Shape (10,), m and rad.
        link_poses: T_world_body of the nine bodies, shape (9, 4, 4).
        body_jacobians: Per body (linear; angular) velocity in world axes, taken at the origin of
            the body's frame, for each velocity; shape (9, 6, 9).
        T_world_base: Pose of the base, shape (4, 4).
        T_world_ee: Pose of the end effector (between the finger tips), shape (4, 4).
        ee_world_jacobian: EE twist in world axes for each velocity, shape (6, 9).
    """

    configuration: FloatArray
    link_poses: FloatArray
    body_jacobians: FloatArray
    T_world_base: FloatArray
    T_world_ee: FloatArray
    ee_world_jacobian: FloatArray

    @cached_property
    def ee_jacobian(self) -> FloatArray:
        """EE twist in the axes of the base for each velocity, shape (6, 9)."""
        R_base = self.T_world_base[:3, :3]
        return (R_base.T @ self.ee_world_jacobian.reshape(2, 3, -1)).reshape(6, -1)


class MobileManipulator:
    """Omron LD-60 with a Franka Panda: poses and Jacobians.

    Not thread-safe: Pinocchio's work space is reused.
    """

    link_names: tuple[str, ...] = tuple(body.frame for body in BODIES)

    def __init__(self, urdf: str) -> None:
        """Build the model.

        Args:
            urdf: Text of a URDF whose joints are x, y, theta of the base and seven arm joints.
        """
        self._model = pin.buildModelFromXML(urdf)
        self._data = self._model.createData()
        names = (*self.link_names, _EE_FRAME)
        placements = [self._data.oMf[self._model.getFrameId(name)] for name in names]
        self._joint_names = tuple(self._model.names)[1:]  # the first is the universe
        # References: Pinocchio overwrites the placements and the Jacobian in place. Columns of the
        # latter are (linear; angular) velocities at the origin of the world.
        self._joints = self._data.J
        self._rotations = tuple(placement.rotation for placement in placements)
        self._translations = tuple(placement.translation for placement in placements)

    @classmethod
    def load(cls) -> MobileManipulator:
        """The robot of this package.

        Raises:
            MissingAssetError: If the Panda's meshes are not installed.
        """
        return cls(urdf_text())

    def state(self, configuration: FloatArray, *, overshoot: bool = False) -> RobotState:
        """Run forward kinematics and all Jacobians once.

        Args:
            configuration: Shape (10,), m and rad.
            overshoot: Whether joints may be outside their limits, as motors leave them; the joint
                dampers of the control layer bring such joints back.

        Raises:
            ConfigurationError: If the configuration has another shape, is not finite or outside the
                limits.
        """
        q = self._checked(configuration, overshoot)
        pin.computeJointJacobians(self._model, self._data, q)
        pin.updateFramePlacements(self._model, self._data)
        frames, jacobians = poses_and_jacobians(
            self._rotations, self._translations, self._joints, velocity_map(q[2]), _MOVES
        )
        return RobotState(q, frames[:-1], jacobians[:-1], frames[0], frames[-1], jacobians[-1])

    def _checked(self, configuration: FloatArray, overshoot: bool) -> FloatArray:
        """A read-only copy."""
        q = np.array(configuration, dtype=float)
        if q.shape != (N_CONFIGURATION,):
            raise ConfigurationError(f"configuration: expected shape (10,), got {q.shape}")
        values = q.tolist()
        if not within(values, _LOWER, _UPPER):
            if not all(map(math.isfinite, values)):
                raise ConfigurationError(f"configuration: expected finite numbers, got {q}")
            if not overshoot:
                check_limits(values, _LOWER, _UPPER, self._joint_names)
        q.setflags(write=False)
        return q

    def parts(self, elements: Elements) -> tuple[tuple[Part, ...], ...]:
        """Parts of the nine bodies, "collision" (convex hulls) or "visual"."""
        return collision_parts() if elements == "collision" else visual_parts()

    def link_poses(self, configuration: FloatArray) -> FloatArray:
        """Poses T_world_body of the nine bodies, shape (9, 4, 4)."""
        return self.state(configuration).link_poses

    def ee_pose(self, configuration: FloatArray) -> FloatArray:
        """Pose T_world_ee of the end effector, shape (4, 4)."""
        return self.state(configuration).T_world_ee

    def ee_jacobian(self, configuration: FloatArray) -> FloatArray:
        """EE twist (in base axes) for each velocity, shape (6, 9)."""
        return self.state(configuration).ee_jacobian


def point_jacobian(state: RobotState, body: int, point: FloatArray) -> FloatArray:
    """Velocity of the body-fixed point that is at `point` now.

    Args:
        state: State of the robot.
        body: Index of the body, 0 to 8.
        point: Point in the world, shape (3,), m.

    Returns:
        Shape (3, 9): linear velocity in world axes for each velocity.
    """
    arm = point - state.link_poses[body, :3, 3]
    return _shift(state.body_jacobians[body], arm[None])[0, :3]


def _shift(J: FloatArray, arms: FloatArray) -> FloatArray:
    """Move the reference point of a Jacobian (6, n) by each of the arms (m, 3): (m, 6, n)."""
    shifted = np.repeat(J[None], len(arms), axis=0)
    shifted[:, :3] += cross(J[3:].T[None], arms[:, None]).transpose(0, 2, 1)
    return shifted
