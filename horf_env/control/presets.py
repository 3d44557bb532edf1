"""Named settings of the control layer."""

from __future__ import annotations

from dataclasses import dataclass, field

from horf_env.control.avoidance import Avoidance, Rows
from horf_env.control.bounds import (
    AccelerationBounds,
    JointDampers,
    SpeedBounds,
)
from horf_env.control.objective import Objective
from horf_env.control.qp import WholeBodyQp
from horf_env.errors import UnknownNameError
from horf_env.robot import MobileManipulator


@dataclass(frozen=True)
class ControlPreset:
    """Settings of the whole-body QP.

    Attributes:
        objective: Weights.
        witnesses: Obstacle points a body; the paper has one.
        influence: Obstacle points that stay farther than this from a body even if it brakes only
            now [m] are left out: no body gains the speed within a tick that would make them matter.
        spacing: Least distance between two obstacle points of a body [m].
        gain: Barrier gain of the avoidance rows [1/s].
        margin: Distance psi to obstacles that is kept [m].
        own_body_margin: Distance of the arm to floor and own base that is kept [m].
        avoid_own_base: Whether the arm avoids the robot's own base.
    """

    objective: Objective = field(default_factory=Objective)
    witnesses: int = 8
    influence: float = 1.0
    spacing: float = 0.12
    gain: float = 2.0
    margin: float = 0.05
    own_body_margin: float = 0.03
    avoid_own_base: bool = True

    def whole_body_qp(self) -> WholeBodyQp:
        """The QP with these settings."""
        bodies = MobileManipulator.link_names
        rows: list[Rows] = [
            Avoidance(
                lambda tick: tick.obstacles,
                label="obstacle",
                bodies=bodies,
                count=self.witnesses,
                gain=self.gain,
                margin=self.margin,
            ),
            Avoidance(
                lambda tick: tick.floor,
                label="floor",
                bodies=bodies,
                count=1,
                gain=self.gain,
                margin=self.own_body_margin,
            ),
        ]
        if self.avoid_own_base:
            rows.append(
                Avoidance(
                    lambda tick: tick.own_base,
                    label="own base",
                    bodies=bodies,
                    count=1,
                    gain=self.gain,
                    margin=self.own_body_margin,
                )
            )
        # eta, rho_i and rho_s have no values in the paper; Haviland's.
        dampers = JointDampers(gain=1.0, influence=0.9, stopping=0.1)
        return WholeBodyQp(self.objective, (SpeedBounds(), AccelerationBounds(), dampers), rows)


PRESETS: dict[str, ControlPreset] = {
    "default": ControlPreset(),
    # The printed formulas with the readings stated in Objective, Avoidance and JointDampers: one
    # row a body, gain 1/s, linear term as printed, no rows for the robot's own base. The floor and
    # the shared slack are ours: without the slack some ticks have no solution at all.
    "paper": ControlPreset(
        objective=Objective(preferred_velocity=False),
        witnesses=1,
        gain=1.0,
        avoid_own_base=False,
    ),
}


def control_preset(name: str) -> ControlPreset:
    """Look a preset up.

    Raises:
        UnknownNameError: If there is no preset of that name.
    """
    if name not in PRESETS:
        raise UnknownNameError("control preset", name, PRESETS)
    return PRESETS[name]
