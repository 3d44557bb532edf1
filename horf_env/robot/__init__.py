"""Robot: description, limits, kinematics."""

from horf_env.robot.bodies import BODIES, ConvexPart, collision_parts
from horf_env.robot.configuration import integrate
from horf_env.robot.limits import ARM_READY, LIMITS, LimitsProfile, limits_profile
from horf_env.robot.manipulator import MobileManipulator, RobotState, point_jacobian

__all__ = [
    "ARM_READY",
    "BODIES",
    "LIMITS",
    "ConvexPart",
    "LimitsProfile",
    "MobileManipulator",
    "RobotState",
    "collision_parts",
    "integrate",
    "limits_profile",
    "point_jacobian",
]
