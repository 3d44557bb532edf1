"""Objective of the whole-body QP: small velocities, a dexterous arm, an arm in front of the base.

1/2 v^T W v + c^T v over the velocity, and 1/2 slack_weight |delta|^2 over the EE slack.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from horf_env.control.tick import ControlTick
from horf_env.robot.manipulability import manipulability_gradient
from horf_env.types import FloatArray

# The position error that scales the weights stays in this range [m]: no division by zero at the
# goal, and far from it no weight vanishes (the paper prints lambda_qd = {1/s_dev, s_dev}).
_NEAR, _FAR = 0.05, 4.0


@dataclass(frozen=True)
class Objective:
    """Weights of the objective.

    Attributes:
        base_weight: Base weight is base_weight / s for a position error s: far away the base is
            cheap and moves, near the goal the arm does the work. [1 / (velocity unit)^2]
        arm_weight: Arm weight is arm_weight * s.
        slack_weight: Weight of the EE slack (lambda_delta, no value in the paper).
        heading_gain: Pull that turns the base towards the end effector (k_epsilon).
        manipulability_gain: Pull along the manipulability gradient J_m; 1 in the paper.
        preferred_velocity: False: the pulls are the linear term itself, as printed. True: they are
            velocities (gain 1/s times angle, rad/s per unit of J_m) from which the quadratic term
            measures, so that a cheap base is not torn around by the same pull.
    """

    base_weight: float = 0.01
    arm_weight: float = 0.01
    slack_weight: float = 10.0
    heading_gain: float = 0.5
    manipulability_gain: float = 1.0
    preferred_velocity: bool = True

    def terms(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        """Diagonal of W and linear term c, each of shape (9,)."""
        scale = float(np.clip(tick.position_error, _NEAR, _FAR))
        weights = np.full(9, self.arm_weight * scale)
        weights[:2] = self.base_weight / scale
        pull = np.zeros(9)
        pull[1] = self.heading_gain * _bearing(tick)
        pull[2:] = self.manipulability_gain * manipulability_gradient(tick.state.ee_jacobian[:, 2:])
        return weights, -weights * pull if self.preferred_velocity else -pull


def _bearing(tick: ControlTick) -> float:
    """Angle of the end effector seen from the base, theta_epsilon [rad]."""
    state = tick.state
    ahead = state.T_world_base[:3, :3].T @ (state.T_world_ee - state.T_world_base)[:3, 3]
    return float(np.arctan2(ahead[1], ahead[0]))
