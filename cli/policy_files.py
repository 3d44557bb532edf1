"""Policies as safetensors: weights, and settings as JSON. Reading one runs no code of others."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
import safetensors
import safetensors.torch
from gymnasium import spaces
from pydantic import BaseModel, ConfigDict, ValidationError
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.policies import BasePolicy

from sb3_bayes_dsac.common.encoders import DepthEncoder

from .algorithms import catalogue
from .environments import EnvSettings
from .exit_codes import CliError

_KEY = "horf_policy"  # of the settings in the file's metadata
_STRICT = ConfigDict(frozen=True, extra="forbid", strict=True)
# A number of each element, or one for all.
_Bound = float | list[float]


class BoxSettings(BaseModel):
    """A Box space in JSON."""

    model_config = _STRICT

    shape: tuple[int, ...]
    dtype: Literal["uint8", "float32"]
    low: _Bound
    high: _Bound

    @classmethod
    def of(cls, space: spaces.Space[Any]) -> BoxSettings:
        """Describe a Box."""
        assert isinstance(space, spaces.Box)
        return cls(
            shape=space.shape,
            dtype=str(space.dtype),  # type: ignore[arg-type]
            low=_bound(space.low),
            high=_bound(space.high),
        )

    def space(self) -> spaces.Box:
        """The Box."""
        low, high = (
            np.resize(bound, self.shape).astype(self.dtype) for bound in (self.low, self.high)
        )
        return spaces.Box(low, high, self.shape, np.dtype(self.dtype).type)


class PolicySettings(BaseModel):
    """What a policy is, besides its weights.

    Attributes:
        version: Of this format.
        algo: Algorithm that trained it.
        step: Environment steps that it has learned from.
        env: The environment that it was trained in.
        networks: Arguments of the policy's class, without the encoder's class, as JSON.
        observation: Parts of the observation.
        action: The action.
    """

    model_config = _STRICT

    version: Literal[1] = 1
    algo: str
    step: int
    env: EnvSettings
    networks: dict[str, Any]
    observation: dict[str, BoxSettings]
    action: BoxSettings


def policy_bytes(model: BaseAlgorithm, *, algo: str, env: EnvSettings) -> bytes:
    """A model's policy as the content of a file.

    Args:
        model: The model.
        algo: Name of its algorithm.
        env: The environment that it was trained in.
    """
    assert isinstance(model.observation_space, spaces.Dict)
    kwargs = {k: v for k, v in model.policy_kwargs.items() if k != "features_extractor_class"}
    settings = PolicySettings(
        algo=algo,
        step=model.num_timesteps,
        env=env,
        networks=kwargs,
        observation={k: BoxSettings.of(s) for k, s in model.observation_space.spaces.items()},
        action=BoxSettings.of(model.action_space),
    )
    # Copies: nets share encoders, and a file of safetensors holds each tensor once or twice, but
    # no sharing. Loading into nets that share is the same either way.
    weights = {k: v.detach().cpu().clone() for k, v in model.policy.state_dict().items()}
    return safetensors.torch.save(weights, {_KEY: settings.model_dump_json()})


def read_policy(path: Path) -> tuple[PolicySettings, BasePolicy]:
    """Read a policy on the CPU.

    Raises:
        CliError: If the file is no policy, or does not fit its own settings.
        UnknownNameError: If this version does not have its algorithm.
    """
    try:
        with safetensors.safe_open(path, "pt") as file:
            text = (file.metadata() or {})[_KEY]
        settings = PolicySettings.model_validate_json(text)
        policy = _empty(settings)
        policy.load_state_dict(safetensors.torch.load_file(path))
    except (OSError, safetensors.SafetensorError, KeyError, TypeError, RuntimeError) as error:
        raise CliError(f"{path}: no policy of `horf export` ({error})") from error
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(map(str, first["loc"])) or "whole file"
        raise CliError(f"{path}: metadata, field {field!r}: {first['msg']}") from error
    policy.set_training_mode(False)
    return settings, policy


def _empty(settings: PolicySettings) -> BasePolicy:
    """The policy with weights that mean nothing."""
    algorithm = catalogue().algorithm(settings.algo).load()
    policy: BasePolicy = algorithm.policy_aliases["MultiInputPolicy"](
        spaces.Dict({key: box.space() for key, box in settings.observation.items()}),
        settings.action.space(),
        lambda _: 0.0,
        features_extractor_class=DepthEncoder,
        **settings.networks,
    )
    return policy


def _bound(values: np.ndarray) -> _Bound:
    flat = values.astype(float).ravel().tolist()
    return flat[0] if len(set(flat)) == 1 else flat
