"""Trained policies as methods beside the planners."""

from __future__ import annotations

import json
import warnings
import zipfile
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm

from horf_env.residual import ADVICE, Residual
from horf_env.types import N_VELOCITIES, FloatArray

from .algorithms import catalogue
from .checkpoints import BEST, POLICY, DamagedCheckpointError, checkpoints
from .environments import Env, EnvSettings
from .exit_codes import CliError
from .metrics import DamagedFileWarning
from .policy_files import policy_bytes, read_policy
from .runs import RunFolder


class Predictor(Protocol):
    """A model or policy of Stable-Baselines3."""

    def predict(self, observation: Any, *, deterministic: bool) -> Any:
        """Action and state."""


class PolicyPlanner:
    """A policy that acts without noise; see `horf_env.planners.Planner`.

    Attributes:
        action_layer: See `horf_env.planners.Planner`.
        trained_in: The environment of its training.
    """

    def __init__(self, model: Predictor, env: EnvSettings) -> None:
        self._model, self.trained_in, self.action_layer = model, env, env.action_layer

    def reset(self, env: Env) -> None:
        """Nothing to forget: the depth frames of the observation are the memory."""

    def act(self, observation: dict[str, np.ndarray]) -> FloatArray:
        """Mean action of the policy."""
        action: FloatArray = self._model.predict(observation, deterministic=True)[0]
        return action


class CorrectingPlanner(PolicyPlanner):
    """A planner and a policy that corrects it, together."""

    def __init__(self, model: Predictor, env: EnvSettings) -> None:
        super().__init__(model, env)
        self._residual = Residual(env.base_planner)

    def reset(self, env: Env) -> None:
        """Tell the planner that is corrected."""
        self._residual.reset(env)

    def act(self, observation: dict[str, np.ndarray]) -> FloatArray:
        """The planner's action, with the mean correction of the policy where it gets no further."""
        advised = self._residual.advised(observation)
        if self._residual.due:
            self._residual.correct(super().act(advised))
        return self._residual.action()


def policy_planner(model: Predictor, env: EnvSettings) -> PolicyPlanner:
    """What a model of an environment does, as whole actions.

    Args:
        model: A model or policy.
        env: The environment that it is, or was, trained in.
    """
    kind = CorrectingPlanner if env.action_mode == "residual" else PolicyPlanner
    return kind(model, env)


def load_policy(path: Path, *, trust: bool = False) -> PolicyPlanner:
    """Load a policy on the CPU. Nothing is unpickled, unless a zip is trusted.

    Args:
        path: Run folder (the policy of its best evaluation, or the last one before the first
            evaluation), a file of `horf export`, or a model.zip of Stable-Baselines3.
        trust: Whether a zip may be loaded: it is unpickled, and may run any code.

    Raises:
        CliError: If it is none of these, or a zip is not trusted.
    """
    if path.suffix == ".zip":
        _, model = _from_zip(path, trust=trust)
        return policy_planner(model, _env_settings(model))
    settings, policy = read_policy(policy_file(path))
    return policy_planner(policy, settings.env)


def policy_file(path: Path) -> Path:
    """The file itself, or the newest sound policy of a run folder.

    Raises:
        CliError: If the folder is no run, or has no checkpoint yet.
    """
    if not path.is_dir():
        return path
    run = RunFolder(path)
    run.read()
    for checkpoint in checkpoints(run.checkpoints):
        try:
            return checkpoint.verified(BEST if BEST in checkpoint else POLICY)
        except DamagedCheckpointError as error:
            text = f"{error}: the one before is used"
            warnings.warn(text, DamagedFileWarning, stacklevel=2)
    raise CliError(f"{path}: no sound checkpoint in there; the first comes after an evaluation")


def exported(path: Path, *, trust: bool = False) -> bytes:
    """A policy as the content of a file that `load_policy` reads without unpickling.

    Args:
        path: As for `load_policy`.
        trust: As for `load_policy`.

    Raises:
        CliError: If there is no policy, or a zip is not trusted.
    """
    if path.suffix != ".zip":
        file = policy_file(path)
        read_policy(file)
        return file.read_bytes()
    algo, model = _from_zip(path, trust=trust)
    return policy_bytes(model, algo=algo, env=_env_settings(model))


def _from_zip(path: Path, *, trust: bool) -> tuple[str, BaseAlgorithm]:
    """Name of the algorithm, and the model."""
    if not trust:
        raise CliError(
            f"{path}: loading a zip of Stable-Baselines3 unpickles it, which may run any code. "
            "Ask for the file of `horf export`, or make it with --trust if the zip is your own"
        )
    try:
        algo = _algorithm_of(path)
        model = catalogue().algorithm(algo).load().load(path, device="cpu")
    except (OSError, ValueError, KeyError, RuntimeError, zipfile.BadZipFile) as error:
        raise CliError(f"{path}: no model of Stable-Baselines3 ({error})") from error
    return algo, model


def _algorithm_of(path: Path) -> str:
    """Name of the algorithm whose kind of policy a zip says to hold; reads text only."""
    with zipfile.ZipFile(path) as archive:
        module = json.loads(archive.read("data"))["policy_class"]["__module__"]
    for name, entry in catalogue().algorithms.items():
        if entry.load().policy_aliases["MultiInputPolicy"].__module__ == module:
            return name
    raise CliError(f"{path}: no algorithm of `horf train` has policies of {module}")


def _env_settings(model: BaseAlgorithm) -> EnvSettings:
    """What a zip's spaces tell: nine numbers are velocities, six a twist or its correction."""
    spaces = getattr(model.observation_space, "spaces", {})
    is_velocity = model.action_space.shape == (N_VELOCITIES,)
    layer = "joint_velocity" if is_velocity else "sdf_qp"
    return EnvSettings(
        action_layer=layer,
        image=spaces["depth"].shape[:0:-1] if "depth" in spaces else None,
        map_view="map" in spaces,
        guide="guide" in spaces,
        action_mode="residual" if ADVICE in spaces else "direct",
    )
