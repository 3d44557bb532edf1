"""Objective of the whole-body QP: small velocities, a dexterous arm, an arm in front of the base.

1/2 v^T W v + c^T v over the velocity, and 1/2 slack_weight |delta|^2 over the EE slack.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numba
import numpy as np

from horf_env.control.tick import ControlTick
from horf_env.robot.manipulability import compiled_gradient
from horf_env.settings import check_not_negative, check_positive
from horf_env.types import FloatArray

# The position error that scales the weights stays in this range [m]: no division by zero at the
# goal, and far from it no weight vanishes (the paper prints lambda_qd = {1/s_dev, s_dev}).
NEAR, FAR = 0.05, 4.0


class Terms(NamedTuple):
    """Numbers of the objective at one tick.

    Attributes:
        weights: Diagonal of W, shape (9,).
        linear: Linear term c, shape (9,).
        slack_weight: Weight of the EE slack.
    """

    weights: FloatArray
    linear: FloatArray
    slack_weight: float


class Objective(Protocol):
    """What the QP minimises."""

    def terms(self, tick: ControlTick) -> Terms:
        """Weights of this tick."""


@dataclass(frozen=True)
class ScaledObjective:
    """The paper's weights: the farther the goal, the cheaper the base and the dearer the arm.

    Attributes:
        base_weight: Base weight is base_weight / s for a position error s: far away the base is
            cheap and moves, near the goal the arm does the work. [1 / (velocity unit)^2]
        arm_weight: Arm weight is arm_weight * s. [1 / (rad/s)^2]
        slack_weight: Weight of the EE slack (lambda_delta, no value in the paper)
            [1 / (velocity unit)^2].
        heading_gain: Pull that turns the base towards the end effector (k_epsilon) [s/rad^2].
        manipulability_gain: Pull along the manipulability gradient J_m [s per unit of
            manipulability]; 1 in the paper.
    """

    base_weight: float = 0.01
    arm_weight: float = 0.01
    slack_weight: float = 10.0
    heading_gain: float = 0.5
    manipulability_gain: float = 1.0

    def __post_init__(self) -> None:
        """Refuse weights that leave the QP without a minimum.

        Raises:
            SettingError: If a number is out of its range.
        """
        check_positive(self, "base_weight", "arm_weight", "slack_weight")
        check_not_negative(self, "heading_gain", "manipulability_gain")

    def terms(self, tick: ControlTick) -> Terms:
        """See `Objective`."""
        weights = scaled_weights(self.base_weight, self.arm_weight, tick.position_error)
        pull = pulls(tick, self.heading_gain, self.manipulability_gain)
        return Terms(weights, -pull, self.slack_weight)


@numba.njit(cache=True)
def scaled_weights(base_weight: float, arm_weight: float, position_error: float) -> FloatArray:
    """The paper's lambda_qd = {1 / s_dev, s_dev}, shape (9,).

    Args:
        base_weight: Weight of the base 1 m from the goal.
        arm_weight: The same of the arm's joints.
        position_error: Distance of the end effector from the goal [m].
    """
    scale = min(max(position_error, NEAR), FAR)
    weights = np.full(9, arm_weight * scale)
    weights[:2] = base_weight / scale
    return weights


@numba.njit(cache=True)
def heading_error(T_world_base: FloatArray, T_world_ee: FloatArray) -> float:
    """Direction of the end effector as the base sees it, theta_epsilon [rad]."""
    forward, left = 0.0, 0.0
    for i in range(3):
        away = T_world_ee[i, 3] - T_world_base[i, 3]
        forward += away * T_world_base[i, 0]
        left += away * T_world_base[i, 1]
    return np.arctan2(left, forward)


def pulls(tick: ControlTick, heading_gain: float, manipulability_gain: float) -> FloatArray:
    """Pull of base and arm towards a better posture: (0, k_epsilon theta_epsilon, J_m).

    Args:
        tick: State of the robot.
        heading_gain: k_epsilon; turns the base towards the end effector.
        manipulability_gain: Factor of J_m; 1 in the paper.

    Returns:
        Shape (9,).
    """
    state = tick.state
    turn = heading_gain * heading_error(state.T_world_base, state.T_world_ee)
    return np.asarray(_pulls(state.ee_jacobian, turn, manipulability_gain))


@numba.njit(cache=True)
def _pulls(ee_jacobian: FloatArray, turn: float, manipulability_gain: float) -> FloatArray:
    pull = np.zeros(9)
    pull[1] = turn
    pull[2:] = manipulability_gain * compiled_gradient(np.ascontiguousarray(ee_jacobian[:, 2:]))
    return pull
