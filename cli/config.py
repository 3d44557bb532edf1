"""What a training run does, as typed settings with a hash."""

from __future__ import annotations

import hashlib
import json
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PositiveFloat, PositiveInt

from .algorithms import Setting, SettingError, catalogue
from .environments import EnvSettings

_STRICT = ConfigDict(frozen=True, extra="forbid", strict=True)
_HASH_DIGITS = 16


class Protocol(BaseModel):
    """When and how a policy is evaluated while it learns.

    Attributes:
        every: Steps between two evaluations; 6000 in the paper.
        episodes: Episodes of each, on validation instances without action noise; 2 in the paper.
        final_episodes: Episodes at the end; not in the paper, chosen because 2 tell little.
    """

    model_config = _STRICT

    every: PositiveInt = 6000
    episodes: PositiveInt = 2
    final_episodes: PositiveInt = 20


class Storage(BaseModel):
    """What is written when; nothing of it changes the result of a run.

    Attributes:
        checkpoint_every: Steps between two checkpoints; 0 for one after each evaluation.
        keep: How many checkpoints stay.
    """

    model_config = _STRICT

    checkpoint_every: int = Field(default=0, ge=0)
    keep: PositiveInt = 2


class TrainConfig(BaseModel):
    """Everything that decides what a training run does, and how it is stored.

    Attributes:
        algo: Name of the algorithm.
        steps: Environment steps.
        seed: Of networks, exploration and training instances.
        replay_ratio: Gradient steps an environment step; None for the algorithm's own.
        n_envs: Environments that are stepped together, each in a process of its own if above 1.
        device: Of torch.
        threads: Of torch.
        env: The environment.
        guided_steps: Steps of demonstrations (of the oracle, or of the planner that actions
            correct) that are in the replay buffer before the policy acts; they are not among
            `steps`. 0 in the paper.
        hand_over: Share of training episodes in which the oracle drives up to a random distance
            from the goal, a curriculum over distance. 0 in the paper.
        encoding: How nets see the deviation: "raw" as it is, "multi_scale" also squashed at 0.1 and
            1 m and rad, so that centimetres count as metres do. Raw in the paper.
        layer_norm: Whether critics normalise before each activation; for the algorithms of
            `sb3_bayes_dsac`. Not in the paper.
        settings: Arguments of the algorithm that differ from `algorithms.toml`.
        protocol: Evaluation.
        storage: Files.
    """

    model_config = _STRICT

    algo: str = "bayes_dsac"
    steps: PositiveInt = 100_000
    seed: int = Field(default=0, ge=0)
    replay_ratio: PositiveFloat | None = None
    n_envs: PositiveInt = 1
    device: str = "cpu"
    threads: PositiveInt = 1
    env: EnvSettings = EnvSettings()
    guided_steps: int = Field(default=0, ge=0)
    hand_over: float = Field(default=0.0, ge=0, le=1)
    encoding: Literal["raw", "multi_scale"] = "raw"
    layer_norm: bool = False
    settings: dict[str, Setting] = Field(default_factory=dict)
    protocol: Protocol = Protocol()
    storage: Storage = Storage()

    def arguments(self) -> dict[str, Setting]:
        """Arguments of the algorithm's constructor, complete with the catalogue's defaults.

        Raises:
            UnknownNameError: If there is no such algorithm.
            SettingError: If a setting cannot be given, or is out of its range.
        """
        return catalogue().arguments(
            self.algo,
            steps=self.steps + self.guided_steps,
            n_envs=self.n_envs,
            replay_ratio=self.replay_ratio,
            settings=self.settings,
        )

    def content_hash(self) -> str:
        """Names what the run computes: equal for equal results, in any process.

        The defaults of `algorithms.toml` count, and so a changed default makes another run.
        """
        content = self.model_dump(mode="json", exclude={"storage", "settings", "replay_ratio"})
        text = json.dumps(content | {"arguments": self.arguments()}, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:_HASH_DIGITS]

    def check(self) -> None:
        """Refuse what could not run, before a folder is made; imports the algorithm.

        Raises:
            UnknownNameError: If a name is not valid.
            SettingError: If a setting of the algorithm is not valid.
            SceneFileError: If the scene file cannot be used.
            InstanceIndexError: If there are fewer validation instances than episodes.
        """
        from horf_env.planners import OraclePlanner
        from horf_env.scenes import validation_instance
        from horf_env.scenes.source import family_instance

        self.env.check()
        arguments = self.arguments()
        entry = catalogue().algorithm(self.algo)
        is_taught = entry.is_taught or bool(self.hand_over)
        is_shown = is_taught or self.guided_steps
        if is_shown and self.env.action_layer != OraclePlanner.action_layer:
            cure = f"the planner that shows how needs {OraclePlanner.action_layer}"
            raise SettingError("env.action_layer", cure)
        if is_taught and self.env.action_mode == "residual":
            cure = "dagger and hand_over give whole actions; leave them or residual out"
            raise SettingError("env.action_mode", cure)
        if self.env.action_mode == "residual" and self.env.action_layer == "joint_velocity":
            raise SettingError("env.action_mode", "residual corrects twists, not joint_velocity")
        plain = entry.kind == "off_policy" and not entry.is_taught
        if self.guided_steps and (not plain or self.n_envs > 1):
            raise SettingError(
                "guided_steps",
                "needs a replay buffer, no other teacher and one environment; leave it out",
            )
        last = max(self.protocol.episodes, self.protocol.final_episodes) - 1
        if self.layer_norm and not entry.has_ensemble:
            raise SettingError("layer_norm", f"{self.algo} does not have it; leave it out")
        if found := family_instance(self.env.scene, last):
            validation_instance(*found)
        from .signatures import check_arguments

        check_arguments(entry.load(), arguments)


def updated(data: dict[str, Any], path: tuple[str, ...], value: Any) -> dict[str, Any]:
    """A copy of nested tables with one value replaced.

    Args:
        data: Tables.
        path: Keys that lead to the value; missing tables are made.
        value: What to put there.
    """
    key, *rest = path
    inner = data.get(key, {})
    new = updated(inner if isinstance(inner, dict) else {}, tuple(rest), value) if rest else value
    return {**data, key: new}
