"""Limits profiles: how fast the robot may move, and what a full action means."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from horf_env.errors import UnknownNameError
from horf_env.types import FloatArray

# Franka Panda, published limits (not those of pybullet_data's URDF, which are wider).
ARM_LOWER = np.array([-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973])  # rad
ARM_UPPER = np.array([2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973])  # rad
_ARM_VELOCITY = (2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61)  # rad/s
_ARM_ACCELERATION = (15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0)  # rad/s^2

ARM_READY = np.array([0.0, -0.3, 0.0, -2.2, 0.0, 2.0, np.pi / 4])
"""Start pose of the arm [rad], as in Haviland's holistic examples."""


@dataclass(frozen=True)
class LimitsProfile:
    """Speed and acceleration limits of base and arm, and the scale of an action.

    Attributes:
        name: Name of the profile.
        velocity: Bound on |velocity|, shape (9,), m/s and rad/s.
        acceleration: Bound on |acceleration|, shape (9,), m/s^2 and rad/s^2; inf for none.
        braking: Deceleration towards an obstacle that any body point can count on [m/s^2]; inf if
            speeds may jump.
        lateral_acceleration: Bound on |v omega| of the base [m/s^2]; inf for none.
        twist_scale: EE twist that an action of ones asks for, shape (6,), m/s and rad/s.
        arm_lower: Lower joint limits, shape (7,), rad.
        arm_upper: Upper joint limits, shape (7,), rad.
    """

    name: str
    velocity: FloatArray
    acceleration: FloatArray
    braking: float
    lateral_acceleration: float
    twist_scale: FloatArray
    arm_lower: FloatArray = field(default_factory=ARM_LOWER.copy)
    arm_upper: FloatArray = field(default_factory=ARM_UPPER.copy)


_LD60 = LimitsProfile(
    name="ld60",
    # 1.8 m/s and 180 deg/s: the LD-60's data sheet.
    velocity=np.array([1.8, np.pi, *_ARM_VELOCITY]),
    # 1 m/s^2 and 180 deg/s^2: not in the paper; what the platform is run with elsewhere.
    acceleration=np.array([1.0, np.pi, *_ARM_ACCELERATION]),
    # Turning at v omega brings obstacles ahead as fast as braking takes speed away. So half of the
    # base's 1 m/s^2 is kept for each; the arm's joints stop a body point faster than that.
    braking=0.5,
    lateral_acceleration=0.5,
    # Not in the paper: below what base and arm reach together, so that most commands are feasible.
    twist_scale=np.array([1.5, 1.5, 1.0, 1.2, 1.2, 1.2]),
)

_PAPER = LimitsProfile(
    name="paper",
    # 4 m/s and 4 rad/s: the toolbox model behind the paper's base speeds of up to 2.7 m/s.
    velocity=np.array([4.0, 4.0, *_ARM_VELOCITY]),
    # The paper has none. But no motor makes speeds jump: the simulated ones reach 25 m/s^2, and
    # random twists at 4 m/s hit something in 7 of 100 runs when the QP did not know it.
    acceleration=np.array([20.0, 40.0, *_ARM_ACCELERATION]),
    braking=10.0,
    lateral_acceleration=10.0,
    twist_scale=np.array([3.5, 3.5, 1.0, 1.2, 1.2, 1.2]),
)

LIMITS: dict[str, LimitsProfile] = {"ld60": _LD60, "paper": _PAPER}


def limits_profile(name: str) -> LimitsProfile:
    """Look a profile up.

    Raises:
        UnknownNameError: If there is no profile of that name.
    """
    if name not in LIMITS:
        raise UnknownNameError("limits profile", name, LIMITS)
    return LIMITS[name]
