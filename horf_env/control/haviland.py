"""Objective of Haviland's holistic controller (RA-L 2022), the published form of HRA."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from horf_env.control.objective import FAR, NEAR, Terms, pulls
from horf_env.control.tick import ControlTick
from horf_env.settings import check_not_negative, check_positive


@dataclass(frozen=True)
class HavilandObjective:
    """Base 0.01 / e, arm 0.01, EE slack 1 / e for a position error e, pulls as linear term.

    The source takes the 1-norm of the error in the axes of the end effector for e; here it is the
    Euclidean norm, kept within the same range as in `ScaledObjective`.

    Attributes:
        joint_weight: Weight of the arm's joints, and of the base at 1 m from the goal
            [1 / (velocity unit)^2].
        heading_gain: Pull that turns the base towards the end effector (k_epsilon) [s/rad^2].
    """

    joint_weight: float = 0.01
    heading_gain: float = 0.5

    def __post_init__(self) -> None:
        """Refuse weights that leave the QP without a minimum.

        Raises:
            SettingError: If a number is out of its range.
        """
        check_positive(self, "joint_weight")
        check_not_negative(self, "heading_gain")

    def terms(self, tick: ControlTick) -> Terms:
        """See `Objective`."""
        error = min(max(tick.position_error, NEAR), FAR)
        weights = np.full(9, self.joint_weight)
        weights[:2] /= error
        return Terms(weights, -pulls(tick, self.heading_gain, 1.0), 1.0 / error)
