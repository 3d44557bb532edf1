"""What happened in one step, for whoever records or draws it."""

from __future__ import annotations

from dataclasses import dataclass

from horf_env.control import Command
from horf_env.perception.camera import DepthImage
from horf_env.robot import RobotState
from horf_env.task import RewardTerms
from horf_env.types import FloatArray


@dataclass(frozen=True)
class StepRecord:
    """One step of an episode; arrays are not to be written to.

    Attributes:
        time: Simulated time at the end of the step [s].
        state: State of the robot at the end of the step.
        depth: Last depth image [m], shape (H, W).
        points: Obstacle points that the action layer used, in the world, shape (N, 3), m.
        command: What the action layer decided; None at the start of an episode.
        twist_achieved: EE twist of the motion, in base axes, shape (6,), m/s and rad/s.
        reward: Terms of the reward; None at the start of an episode.
        min_distance: Least clearance during the step [m].
        layer_time: Wall time of the action layer, SDF query and QP [s]; 0 at the start.
    """

    time: float
    state: RobotState
    depth: DepthImage
    points: FloatArray
    command: Command | None
    twist_achieved: FloatArray
    reward: RewardTerms | None
    min_distance: float
    layer_time: float
