"""Algorithms by name: their hyperparameters from `algorithms.toml`, and models made with them."""

from __future__ import annotations

import importlib
import tomllib
from functools import cache
from importlib import resources
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PositiveInt

from horf_env.errors import UnknownNameError

_STRICT = ConfigDict(frozen=True, extra="forbid")
# Part of a run during which actions are random, at most: a short run shall learn something too.
_WARM_UP_SHARE = 5


class Networks(BaseModel):
    """Sizes of encoder and nets."""

    model_config = _STRICT

    hidden: tuple[PositiveInt, ...]
    image_features: PositiveInt


class OffPolicy(BaseModel):
    """Arguments that all off-policy algorithms share, with the names of Stable-Baselines3."""

    model_config = _STRICT

    learning_rate: float = Field(gt=0)
    batch_size: PositiveInt
    gamma: float = Field(gt=0, le=1)
    train_freq: PositiveInt
    gradient_steps: PositiveInt
    learning_starts: int = Field(ge=0)
    buffer_size: PositiveInt

    def for_steps(self, steps: int) -> OffPolicy:
        """The same for a run of so many steps: no larger buffer, a warm-up of a fifth at most."""
        return self.model_copy(
            update={
                "buffer_size": min(self.buffer_size, steps),
                "learning_starts": min(self.learning_starts, steps // _WARM_UP_SHARE),
            }
        )


class OnPolicy(BaseModel):
    """Arguments that all on-policy algorithms share."""

    model_config = _STRICT

    n_steps: PositiveInt

    def for_steps(self, steps: int) -> OnPolicy:
        """The same for a run of so many steps: no longer rollouts."""
        return self.model_copy(update={"n_steps": min(self.n_steps, steps)})


class Algorithm(BaseModel):
    """An entry of the catalogue.

    Attributes:
        import_path: "module:Class".
        kind: Which shared arguments it takes.
        action_noise: Standard deviation of Gaussian noise on actions; 0 for none.
    """

    model_config = _STRICT

    import_path: str = Field(alias="class")
    kind: Literal["off_policy", "on_policy"]
    action_noise: float = Field(default=0.0, ge=0)

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

    def arguments(self, name: str, steps: int) -> OffPolicy | OnPolicy:
        """Arguments of an algorithm for a run of so many steps."""
        kind = self.algorithm(name).kind
        return (self.off_policy if kind == "off_policy" else self.on_policy).for_steps(steps)


@cache
def catalogue() -> Catalogue:
    """The packaged catalogue; it does not change, so it is read once."""
    text = resources.files(__package__).joinpath("algorithms.toml").read_text()
    return Catalogue.model_validate(tomllib.loads(text))
