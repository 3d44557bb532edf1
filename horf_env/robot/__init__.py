"""Robot: description, limits, kinematics."""

from horf_env.robot.bodies import BODIES, collision_parts, visual_parts
from horf_env.robot.configuration import integrate
from horf_env.robot.limits import ARM_READY, LIMITS, LimitsProfile, limits_profile
from horf_env.robot.manipulator import MobileManipulator, RobotState, point_jacobian
from horf_env.robot.parts import ConvexPart, MeshPart, Part
from horf_env.robot.urdf_robot import BodyState, UrdfRobot

__all__ = [
    "ARM_READY",
    "BODIES",
    "LIMITS",
    "BodyState",
    "ConvexPart",
    "LimitsProfile",
    "MeshPart",
    "MobileManipulator",
    "Part",
    "RobotState",
    "UrdfRobot",
    "collision_parts",
    "integrate",
    "limits_profile",
    "point_jacobian",
    "visual_parts",
]
