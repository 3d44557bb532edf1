"""Algorithms by name, and the arguments that `algorithms.toml` gives them."""

from __future__ import annotations

import importlib
import tomllib
from collections.abc import Mapping
from fractions import Fraction
from functools import cache
from importlib import resources
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PositiveFloat, PositiveInt, ValidationError

from horf_env.errors import UnknownNameError

from .exit_codes import UsageError

Setting = bool | int | float | str
"""Value of an argument in a file."""

_STRICT = ConfigDict(frozen=True, extra="forbid")
# Part of a run during which actions are random, at most: a short run shall learn something too.
_WARM_UP_SHARE = 5
_FINEST_RATIO = 1000  # largest denominator of a replay ratio; 0.3 means 3 updates in 10 steps
# Arguments that other settings of a run decide.
_TAKEN = {
    "seed": "give it as the run's seed",
    "device": "give it as the run's device",
    "train_freq": "give the run's replay_ratio",
    "gradient_steps": "give the run's replay_ratio",
}


class SettingError(UsageError):
    """A setting of an algorithm that cannot work.

    Attributes:
        name: The setting.
    """

    def __init__(self, name: str, reason: str) -> None:
        self.name = name
        super().__init__(f"setting {name!r}: {reason}")


class Networks(BaseModel):
    """Sizes of encoder and nets."""

    model_config = _STRICT

    hidden: tuple[PositiveInt, ...]
    image_features: PositiveInt


class OffPolicy(BaseModel):
    """Arguments that all off-policy algorithms share, with the names of Stable-Baselines3."""

    model_config = ConfigDict(frozen=True, extra="allow")

    learning_rate: float = Field(gt=0)
    batch_size: PositiveInt
    gamma: float = Field(gt=0, le=1)
    replay_ratio: PositiveFloat
    learning_starts: int = Field(ge=0)
    buffer_size: PositiveInt

    def for_steps(self, steps: int) -> dict[str, Setting]:
        """For a run of so many steps: no larger buffer, a warm-up of a fifth at most."""
        return self.model_dump() | {
            "buffer_size": min(self.buffer_size, steps),
            "learning_starts": min(self.learning_starts, steps // _WARM_UP_SHARE),
        }


class OnPolicy(BaseModel):
    """Arguments that all on-policy algorithms share; `n_steps` is of all environments together."""

    model_config = ConfigDict(frozen=True, extra="allow")

    n_steps: PositiveInt
    batch_size: PositiveInt

    def for_steps(self, steps: int) -> dict[str, Setting]:
        """For a run of so many steps: no longer rollouts."""
        return self.model_dump() | {"n_steps": min(self.n_steps, steps)}


class Algorithm(BaseModel):
    """An entry of the catalogue.

    Attributes:
        import_path: "module:Class".
        kind: Which shared arguments it takes.
        action_noise: Standard deviation of Gaussian noise on actions; 0 for none.
        is_taught: Whether it learns from what a planner would do.
        settings: Its own arguments, before those that it shares.
    """

    model_config = _STRICT

    import_path: str = Field(alias="class")
    kind: Literal["off_policy", "on_policy"]
    action_noise: float = Field(default=0.0, ge=0)
    is_taught: bool = False
    settings: dict[str, Setting] = Field(default_factory=dict)

    @property
    def has_ensemble(self) -> bool:
        """Whether it is one of `sb3_bayes_dsac`, whose policies have options of their own."""
        return self.import_path.startswith("sb3_bayes_dsac:")

    def load(self) -> Any:
        """The Stable-Baselines3 algorithm."""
        module, name = self.import_path.split(":")
        return getattr(importlib.import_module(module), name)


class Catalogue(BaseModel):
    """Content of `algorithms.toml`."""

    model_config = _STRICT

    networks: Networks
    off_policy: OffPolicy
    on_policy: OnPolicy
    algorithms: dict[str, Algorithm]

    def algorithm(self, name: str) -> Algorithm:
        """Look an algorithm up.

        Raises:
            UnknownNameError: If there is none of that name.
        """
        if name not in self.algorithms:
            raise UnknownNameError("algorithm", name, self.algorithms)
        return self.algorithms[name]

    def arguments(
        self,
        name: str,
        *,
        steps: int,
        n_envs: int,
        replay_ratio: float | None,
        settings: Mapping[str, Setting],
    ) -> dict[str, Setting]:
        """Arguments of an algorithm for a run.

        Raises:
            UnknownNameError: If there is no such algorithm.
            SettingError: If a setting is out of its range, or is not the algorithm's.
        """
        entry = self.algorithm(name)
        for key in settings:
            if key in _TAKEN:
                raise SettingError(key, _TAKEN[key])
        shared = self.off_policy if entry.kind == "off_policy" else self.on_policy
        merged = _validated(shared, entry.settings).for_steps(steps) | dict(settings)
        complete = _validated(shared, merged).model_dump()
        if entry.kind == "on_policy":
            if replay_ratio is not None:
                raise SettingError("replay_ratio", f"{name} has no replay buffer: leave it out")
            return complete | {"n_steps": max(complete["n_steps"] // n_envs, 1)}
        return _with_ratio(complete, replay_ratio, n_envs)


def _with_ratio(
    arguments: dict[str, Any], replay_ratio: float | None, n_envs: int
) -> dict[str, Setting]:
    """Say the replay ratio in Stable-Baselines3's way: updates after so many joint steps."""
    ratio = arguments.pop("replay_ratio")
    updates = Fraction(replay_ratio or ratio).limit_denominator(_FINEST_RATIO) * n_envs
    if not updates:
        raise SettingError("replay_ratio", f"expected at least 1/{_FINEST_RATIO}")
    return arguments | {"train_freq": updates.denominator, "gradient_steps": updates.numerator}


def _validated(shared: OffPolicy | OnPolicy, changes: Mapping[str, Any]) -> OffPolicy | OnPolicy:
    try:
        return type(shared).model_validate(shared.model_dump() | dict(changes), strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        raise SettingError(str(first["loc"][0]), first["msg"]) from error


@cache
def catalogue() -> Catalogue:
    """The packaged catalogue; it does not change, so it is read once."""
    text = resources.files(__package__).joinpath("algorithms.toml").read_text()
    return Catalogue.model_validate(tomllib.loads(text))
