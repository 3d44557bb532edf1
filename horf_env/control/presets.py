"""Named settings of the control layer."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from horf_env.control.avoidance import Avoidance, Rows
from horf_env.control.bounds import RobotBounds
from horf_env.control.haviland import HavilandObjective
from horf_env.control.objective import Objective, ScaledObjective
from horf_env.control.posture import PostureObjective
from horf_env.control.qp import WholeBodyQp
from horf_env.control.tick import ControlTick
from horf_env.control.unseen import UnseenGround, UnseenReach
from horf_env.errors import SettingError, UnknownNameError
from horf_env.perception import FrameSettings, MapSettings, MemorySettings
from horf_env.robot import MobileManipulator
from horf_env.sdf import Witnesses
from horf_env.settings import check_counts, check_not_negative, check_unbounded


@dataclass(frozen=True)
class ControlPreset:
    """Settings of the whole-body QP.

    Attributes:
        objective: Weights.
        witnesses: Obstacle points a body; the paper has one.
        influence: Obstacle points that stay farther than this from a body even if it brakes only
            now [m] are left out: no body gains the speed within a tick that would make them matter.
        spacing: Least distance between two obstacle points of a body of the arm [m]: wider apart,
            a finger sinks in between two of them.
        base_spacing: The same for the base [m]: closer together, all of a base's points are on one
            side of it, and a fast turn hits what is on the other.
        gain: Barrier gain of the avoidance rows [1/s].
        margin: Distance psi to obstacles that is kept [m].
        own_body_margin: Distance of the arm to floor and own base that is kept [m].
        avoid_own_base: Whether the arm avoids the robot's own base.
        own_base_witnesses: Points of the own base for each body of the arm.
        guard_unseen: Whether the base keeps off ground that nobody has looked at.
        guard_reach: Whether the gripper keeps off the space above such ground.
        unseen_gain: Barrier gain of those rows [1/s].
        unseen_margin: Distance that the base keeps from unseen ground [m]: half a voxel.
        damper_gain: Speed of a joint that is allowed at the influence distance from its limit
            [rad/s] (eta; the paper has no values for these three, they are Haviland's).
        damper_influence: Distance from a joint's limit at which its damper begins [rad] (rho_i).
        damper_stopping: Distance from a joint's limit at which it stops [rad] (rho_s).
        memory: How the obstacles that the camera has shown are remembered.
    """

    objective: Objective = field(default_factory=PostureObjective)
    witnesses: int = 8
    influence: float = 1.0
    spacing: float = 0.05
    base_spacing: float = 0.12
    gain: float = 2.0
    margin: float = 0.05
    own_body_margin: float = 0.03
    avoid_own_base: bool = True
    own_base_witnesses: int = 4
    guard_unseen: bool = True
    guard_reach: bool = True
    unseen_gain: float = 2.0
    unseen_margin: float = 0.03
    damper_gain: float = 1.0
    damper_influence: float = 0.9
    damper_stopping: float = 0.1
    memory: MemorySettings = field(default_factory=MapSettings)

    def __post_init__(self) -> None:
        """Refuse what is no setting.

        Raises:
            SettingError: If a number is out of its range.
        """
        check_counts(self, "witnesses", "own_base_witnesses")
        check_unbounded(self, "influence")
        check_not_negative(self, "spacing", "base_spacing", "gain", "margin", "own_body_margin")
        check_not_negative(self, "unseen_gain", "unseen_margin", "damper_gain", "damper_stopping")
        if not self.damper_stopping < self.damper_influence < math.inf:
            raise SettingError("damper_influence", self.damper_influence, "more than the stopping")

    def whole_body_qp(self, obstacle_rows: Rows | None = None) -> WholeBodyQp:
        """The QP with these settings.

        Args:
            obstacle_rows: How obstacles are avoided; by the SDF's witness points without it.
        """
        rows = [
            obstacle_rows or self._obstacle_rows(),
            self._avoidance(lambda tick: tick.floor, "floor", margin=self.own_body_margin),
        ]
        if self.avoid_own_base:
            rows.append(
                self._avoidance(
                    lambda tick: tick.own_base,
                    "own base",
                    count=self.own_base_witnesses,
                    margin=self.own_body_margin,
                )
            )
        if self.guard_unseen:
            rows.append(UnseenGround(gain=self.unseen_gain, margin=self.unseen_margin))
        if self.guard_reach:
            rows.append(UnseenReach(gain=self.unseen_gain, margin=self.unseen_margin))
        limits = RobotBounds(
            gain=self.damper_gain,
            influence=self.damper_influence,
            stopping=self.damper_stopping,
        )
        return WholeBodyQp(self.objective, [limits], rows)

    def _obstacle_rows(self) -> Rows:
        return self._avoidance(
            lambda tick: tick.obstacles, "obstacle", count=self.witnesses, margin=self.margin
        )

    def _avoidance(
        self,
        witnesses: Callable[[ControlTick], Witnesses],
        label: str,
        *,
        count: int = 1,
        margin: float,
    ) -> Rows:
        return Avoidance(
            witnesses,
            label=label,
            bodies=MobileManipulator.link_names,
            count=count,
            gain=self.gain,
            margin=margin,
        )


PRESETS: dict[str, ControlPreset] = {
    "default": ControlPreset(),
    # The printed formulas with the readings stated in ScaledObjective, Avoidance and JointDampers:
    # one row a body, gain 1/s, linear term as printed, no rows for the robot's own base. The floor
    # and the shared slack are ours: without the slack some ticks have no solution at all.
    "paper": ControlPreset(
        objective=ScaledObjective(),
        witnesses=1,
        gain=1.0,
        avoid_own_base=False,
        guard_unseen=False,
        guard_reach=False,
        memory=FrameSettings(frames=5),
    ),
    # The weights of Haviland's holistic controller; rows and limits as in the default.
    "hra": ControlPreset(objective=HavilandObjective()),
}


def control_preset(preset: str | ControlPreset) -> ControlPreset:
    """Look a preset up; settings made elsewhere pass through.

    Raises:
        UnknownNameError: If there is no preset of that name.
    """
    if isinstance(preset, ControlPreset):
        return preset
    if preset not in PRESETS:
        raise UnknownNameError("control preset", preset, PRESETS)
    return PRESETS[preset]
