"""The environment of an experiment, from typed settings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, cast

import gymnasium as gym
import numpy as np
from pydantic import BaseModel, ConfigDict, Field, NonNegativeFloat, PositiveInt

import horf_env
from horf_env.control import ACTION_LAYERS, control_preset
from horf_env.env import HorfReachEnv
from horf_env.errors import UnknownNameError
from horf_env.faults import FAULTS, with_fault
from horf_env.planners import Planner
from horf_env.residual import RESIDUAL_PLANNERS, ResidualActions
from horf_env.robot import limits_profile
from horf_env.scenes import SCENES
from horf_env.scenes.instances import instances
from horf_env.scenes.source import MIXED, family_instance, scene_source
from horf_env.sensing import PERCEPTIONS
from horf_env.simulation import MODES
from horf_env.task import RewardWeights
from horf_env.types import FloatArray

Env = gym.Env[dict[str, np.ndarray], FloatArray]

gym.register_envs(horf_env)


class EnvSettings(BaseModel):
    """Arguments of `horf/Reach-v0`, see there, and what is put around it.

    Attributes:
        deviation_weight: See `horf_env.task.RewardWeights`.
        follow_weight: The same.
        action_mode: "direct" if actions are those of the action layer, "residual" if they correct
            those of a planner; see `horf_env.residual`.
        base_planner: The planner that is corrected.
        fault: A name of `horf_env.faults`, or None.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    scene: str = "forest"
    action_layer: str = "sdf_qp"
    control: str = "default"
    limits: str = "ld60"
    perception: str = "camera"
    simulation: str = "kinematic"
    # TOML and command lines have lists, and no tuples.
    image: Annotated[tuple[PositiveInt, PositiveInt] | None, Field(strict=False)] = None
    depth_noise: bool = False
    map_view: bool = False
    guide: bool = False
    deviation_weight: NonNegativeFloat = RewardWeights.deviation
    follow_weight: NonNegativeFloat = RewardWeights.follow
    action_mode: Literal["direct", "residual"] = "direct"
    base_planner: str = "mapped"
    fault: str | None = None

    def check(self) -> None:
        """Refuse what `make_env` would refuse, in a moment instead of seconds.

        Raises:
            UnknownNameError: If one of the names is not valid.
            SceneFileError: If the scene file cannot be used.
        """
        scene_source(self.scene)
        control_preset(self.control)
        limits_profile(self.limits)
        for kind, name, valid in (
            *([("fault", self.fault, FAULTS)] if self.fault else []),
            ("action layer", self.action_layer, ACTION_LAYERS),
            ("perception", self.perception, PERCEPTIONS),
            ("simulation mode", self.simulation, MODES),
            ("planner to be corrected", self.base_planner, RESIDUAL_PLANNERS),
        ):
            if name not in valid:
                raise UnknownNameError(kind, name, valid)

    def for_planner(self, planner: Planner) -> EnvSettings:
        """The same with the action layer of a planner and the observations that a policy wants.

        A planner's actions are whole ones, also those of a policy that corrects another planner's.
        """
        policy = getattr(planner, "trained_in", EnvSettings())
        wanted = {name: getattr(policy, name) for name in ("image", "map_view", "guide")}
        whole = {"action_layer": planner.action_layer, "action_mode": "direct"}
        return self.model_copy(update=whole | wanted)

    @property
    def scene_name(self) -> str:
        """Name of the scene without folders: part of file names."""
        return Path(self.scene).stem


def make_env(settings: EnvSettings) -> Env:
    """Make the environment.

    Raises:
        UnknownNameError: If one of the names is not valid.
        SceneFileError: If the scene file cannot be used.
    """
    ours = {"fault", "action_mode", "base_planner", "deviation_weight", "follow_weight"}
    reward = RewardWeights(settings.deviation_weight, settings.follow_weight)
    env: Env = gym.make("horf/Reach-v0", reward=reward, **settings.model_dump(exclude=ours))
    if settings.fault:
        env = with_fault(env, settings.fault)
    if settings.action_mode == "residual":
        env = ResidualActions(env, settings.base_planner)
    return env


def reach_env(env: Env) -> HorfReachEnv:
    """The environment below all wrappers."""
    return cast(HorfReachEnv, env.unwrapped)


def instance_options(scene: str, split: str, instance: int) -> dict[str, Any]:
    """Options of `reset` for an instance of a split; a scene file has one scene and no options."""
    return {"instance": instance, "split": split} if family_instance(scene, instance) else {}


def reference_length(scene: str, split: str, instance: int) -> float | None:
    """Way of the base in the path that proved an instance feasible [m]; None for a scene file."""
    found = family_instance(scene, instance)
    if found is None:
        return None
    family, number = found
    length: float = getattr(instances(family), split)[number].path_length
    return length


def test_instances(scene: str) -> int:
    """How many test instances a scene has; a scene file is one."""
    families = list(SCENES) if scene == MIXED else [scene] if scene in SCENES else []
    return sum(len(instances(family).test) for family in families) or 1
