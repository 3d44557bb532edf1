"""The reaching task: when it is done, and the reward (eq. 14 of the paper)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from horf_env.robot.vectors import norm
from horf_env.settings import check_not_negative
from horf_env.types import FloatArray

STEP = 0.05
"""Duration of a step [s]; not in the paper. At 1.8 m/s it is 9 cm of way."""
MAX_STEPS = 1000
"""Length of an episode; from the paper's training protocol."""

POSITION_TOLERANCE = 0.03  # m; delta of the paper, which gives no value
ROTATION_TOLERANCE = 0.1  # rad; the same

# Values of eq. 14. The 25s are printed; the rest has no value in the paper.
GOAL_REWARD = 25.0
COLLISION_REWARD = -25.0
# s_d [m]: equal to the margin of the avoidance rows, so that only what the QP did not hold costs.
SAFE_DISTANCE = 0.05
# Clearances below count as this [m], so that a touch costs -3.9 a step at most and not -infinity.
_LEAST_DISTANCE = 0.001


@dataclass(frozen=True)
class RewardWeights:
    """Weights of the two terms of eq. 14 that every step has; the paper prints none.

    Attributes:
        deviation: lambda_dev, per step and (m and rad mixed, as printed). 10 m away for 200 steps
            costs 100, so that waiting is never better than arriving, while a metre more or less on
            the way stays below the goal's 25. To somebody who looks far ahead it makes a collision
            cheaper than being stuck: 0.01 does not.
        follow: lambda_fol, per step and m/s (and rad/s). Ignoring the servo for 100 steps costs
            5 to 10, detours stay cheap.
    """

    deviation: float = 0.05
    follow: float = 0.05

    def __post_init__(self) -> None:
        """Refuse what would reward deviations.

        Raises:
            SettingError: If a weight is negative or not finite.
        """
        check_not_negative(self, "deviation", "follow")


@dataclass(frozen=True)
class RewardTerms:
    """Terms of eq. 14, weighted, so that the reward is their sum.

    Attributes:
        deviation: lambda_dev r_dev.
        follow: lambda_fol r_follow.
        time: r_time, minus the duration of the step [s]; the sum over an episode is -t_run.
        goal: r_goal.
        collision: r_coll.
    """

    deviation: float
    follow: float
    time: float
    goal: float
    collision: float

    @property
    def total(self) -> float:
        """The reward of the step."""
        return self.deviation + self.follow + self.time + self.goal + self.collision


def is_reached(deviation: FloatArray) -> bool:
    """Whether position and orientation are within tolerance.

    The paper compares one norm over m and rad with delta; here each unit has its own tolerance.

    Args:
        deviation: Position error [m] and rotation vector [rad] to the goal, shape (6,).
    """
    return norm(deviation[:3]) < POSITION_TOLERANCE and norm(deviation[3:]) < ROTATION_TOLERANCE


def reward_terms(
    deviation: FloatArray,
    *,
    twist: FloatArray,
    servo_twist: FloatArray,
    clearance: float,
    collided: bool,
    weights: RewardWeights,
) -> RewardTerms:
    """Evaluate eq. 14 after a step.

    Args:
        deviation: Deviation from the goal after the step, shape (6,), m and rad.
        twist: EE twist that the action asked for, a of the paper, shape (6,), m/s and rad/s.
        servo_twist: EE twist of the position servo, v_dir, shape (6,), m/s and rad/s.
        clearance: Least distance y to anything during the step [m].
        collided: Whether the robot touched anything.
        weights: Of the terms that every step has.
    """
    reached = is_reached(deviation) and not collided
    return RewardTerms(
        deviation=-weights.deviation * norm(deviation),
        follow=-weights.follow * norm(servo_twist - twist),
        time=-STEP,
        goal=GOAL_REWARD if reached else 0.0,
        collision=COLLISION_REWARD if collided else _closeness(clearance),
    )


def _closeness(clearance: float) -> float:
    """log(y / s_d) below s_d, else 0. Printed is log(y), which jumps at s_d unless s_d = 1 m."""
    return float(np.log(min(max(clearance, _LEAST_DISTANCE) / SAFE_DISTANCE, 1.0)))
