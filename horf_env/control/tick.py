"""What the control layer knows at one tick."""

from __future__ import annotations

from dataclasses import dataclass

from horf_env.robot import LimitsProfile, RobotState
from horf_env.sdf import Witnesses
from horf_env.types import FloatArray


@dataclass(frozen=True)
class ControlTick:
    """Inputs of the whole-body QP.

    Attributes:
        state: Present state of the robot.
        velocity: Velocity of the last tick, shape (9,), m/s and rad/s.
        twist: EE twist that is asked for, in base axes, shape (6,), m/s and rad/s.
        position_error: Distance of the end effector from the goal [m].
        posture: Joints that the arm goes back to where the twist leaves it free, shape (7,), rad.
        obstacles: Witness points of the obstacles.
        floor: Witness points of the floor.
        own_base: Witness points of the robot's own base for its arm.
        unseen: Ground near the base that was neither seen nor covered, shape (M, 2), m.
        limits: Speed and acceleration limits.
        dt: Duration of a tick [s].
    """

    state: RobotState
    velocity: FloatArray
    twist: FloatArray
    position_error: float
    posture: FloatArray
    obstacles: Witnesses
    floor: Witnesses
    own_base: Witnesses
    unseen: FloatArray
    limits: LimitsProfile
    dt: float
