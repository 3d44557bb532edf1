"""Objective that keeps the arm in a posture from which it can go on, for long drives.

Not in the paper, whose linear term pulls towards manipulability. Over metres of way that pull does
not keep the arm from winding up: the end effector is followed by turning the arm instead of the
base, until joints are at their limits and the robot stands still in free space. A pull towards the
ready pose is the usual cure in whole-body control.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from horf_env.control.objective import Terms, heading_error, scaled_weights
from horf_env.control.tick import ControlTick
from horf_env.settings import check_not_negative, check_positive
from horf_env.types import FloatArray

FASTEST_RETURN = 1.0  # rad/s; far from the ready pose the arm shall not jerk back


@dataclass(frozen=True)
class PostureObjective:
    """The paper's weights around preferred velocities: face the end effector, get the arm ready.

    The cost of a velocity v is weight / 2 (v - preferred)^2 and change_weight / 2 (v - last)^2.

    Attributes:
        base_weight: Weight of the base 1 m from the goal; farther away it is cheaper.
            [1 / (velocity unit)^2]
        arm_weight: The same of the arm, which is dearer farther away.
        slack_weight: Weight of the EE slack (lambda_delta, no value in the paper). So large beside
            the others that they only choose among velocities that follow the twist, and so small
            beside the cost of the row slack that no twist is worth an avoidance row: with 300 of
            it, random twists hit something in one episode of seven.
        heading_gain: Rate at which the base turns towards the end effector (k_epsilon) [1/s].
        posture_gain: Rate at which the arm goes back to the tick's posture [1/s].
        base_change_weight: Weight of the change of the base's velocity; small, since acceleration
            limits bound it, and a dear change makes the arm turn where the base should.
        arm_change_weight: The same of the arm's joints. Without it the arm chatters in front of
            obstacles: of the velocities that follow the twist equally well, those of two ticks in
            a row lie far apart. It costs nothing once the robot moves evenly.
    """

    base_weight: float = 0.003
    arm_weight: float = 0.03
    slack_weight: float = 10.0
    heading_gain: float = 1.0
    posture_gain: float = 1.0
    base_change_weight: float = 0.03
    arm_change_weight: float = 0.1

    def __post_init__(self) -> None:
        """Refuse weights that leave the QP without a minimum.

        Raises:
            SettingError: If a number is out of its range.
        """
        check_positive(self, "base_weight", "arm_weight", "slack_weight")
        check_not_negative(self, "heading_gain", "posture_gain")
        check_not_negative(self, "base_change_weight", "arm_change_weight")

    def terms(self, tick: ControlTick) -> Terms:
        """See `Objective`."""
        state = tick.state
        weights, linear = _terms(
            state.configuration,
            tick.posture,
            tick.velocity,
            state.T_world_base,
            state.T_world_ee,
            tick.position_error,
            self.base_weight,
            self.arm_weight,
            self.base_change_weight,
            self.arm_change_weight,
            self.heading_gain,
            self.posture_gain,
        )
        return Terms(weights, linear, self.slack_weight)


@numba.njit(cache=True)
def _terms(
    configuration: FloatArray,
    posture: FloatArray,
    last: FloatArray,
    T_world_base: FloatArray,
    T_world_ee: FloatArray,
    position_error: float,
    base_weight: float,
    arm_weight: float,
    base_change_weight: float,
    arm_change_weight: float,
    heading_gain: float,
    posture_gain: float,
) -> tuple[FloatArray, FloatArray]:
    """Weights and linear term, both (9,), around a turn of the base and the arm's return."""
    weights, linear = scaled_weights(base_weight, arm_weight, position_error), np.empty(9)
    turn = heading_gain * heading_error(T_world_base, T_world_ee)
    for i in range(9):
        change, preferred = base_change_weight, turn if i == 1 else 0.0
        if i >= 2:
            back = posture_gain * (posture[i - 2] - configuration[i + 1])
            change, preferred = arm_change_weight, min(max(back, -FASTEST_RETURN), FASTEST_RETURN)
        linear[i] = -weights[i] * preferred - change * last[i]
        weights[i] += change
    return weights, linear
