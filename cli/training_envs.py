"""The environments that a policy learns in: timed, and able to come back to where they were."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from .algorithms import catalogue
from .config import TrainConfig
from .environments import Env, make_env
from .exit_codes import CliError
from .hand_over import HandOver
from .lesson import Lesson


class EpisodeNotReproducedError(CliError):
    """The environment did not come back to where it was."""

    def __init__(self) -> None:
        super().__init__(
            "the environment did not repeat its running episode bit by bit; "
            "was the run made by another version or on another machine? "
            "Resume without --exact: the episode then starts anew"
        )


@dataclass(frozen=True)
class EpisodeState:
    """From what a running episode can be repeated.

    Attributes:
        generator: State of the environment's generator before the reset.
        seed: Seed of the reset, if it had one.
        actions: All since then.
    """

    generator: Mapping[str, Any]
    seed: int | None
    actions: tuple[np.ndarray, ...]


class RepeatableEpisode(gym.Wrapper[Any, Any, Any, Any]):
    """Remembers how its episode came about, and can bring another copy of itself there.

    An environment with a physics server has no state that could be copied. Its episodes are
    reproducible, so the generator before the reset and the actions are as good, and 30 kB at most.
    """

    def __init__(self, env: Env) -> None:
        super().__init__(env)
        self._begin: Mapping[str, Any] = {}
        self._seed: int | None = None
        self._actions: list[np.ndarray] = []

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Start an episode; options are not for training."""
        self._begin, self._seed = self.unwrapped.np_random.bit_generator.state, seed
        self._actions = []
        return self.env.reset(seed=seed, options=options)

    def step(self, action: Any) -> Any:
        """One step, remembered."""
        self._actions.append(np.array(action))
        return self.env.step(action)

    def episode_state(self) -> EpisodeState:
        """What `repeat` needs."""
        return EpisodeState(self._begin, self._seed, tuple(self._actions))

    def repeat(self, state: EpisodeState) -> Any:
        """Bring the episode to where another one was; costs as much as its steps did.

        Returns:
            The last observation.
        """
        self.unwrapped.np_random.bit_generator.state = state.generator
        observation, _ = self.reset(seed=state.seed)
        for action in state.actions:
            observation, *_ = self.step(action)
        return observation


class TimedEnvs(VecEnvWrapper):
    """Measures the time of all steps.

    Attributes:
        seconds: Since the last `take_seconds`.
    """

    def __init__(self, venv: VecEnv) -> None:
        super().__init__(venv)
        self.seconds = 0.0
        self._begin = 0.0

    def reset(self) -> VecEnvObs:
        """Start episodes."""
        return self.venv.reset()

    def step_async(self, actions: np.ndarray) -> None:
        """Begin a step."""
        self._begin = time.perf_counter()
        self.venv.step_async(actions)

    def step_wait(self) -> VecEnvStepReturn:
        """End it."""
        result = self.venv.step_wait()
        self.seconds += time.perf_counter() - self._begin
        return result

    def take_seconds(self) -> float:
        """Seconds since the last call of this."""
        taken, self.seconds = self.seconds, 0.0
        return taken

    def episode_states(self) -> list[EpisodeState]:
        """How the running episodes came about."""
        return list(self.env_method("episode_state"))

    def repeat(self, states: list[EpisodeState], last: dict[str, np.ndarray]) -> bool:
        """Bring all episodes to where they were.

        Args:
            states: Of all environments.
            last: The observations to be met, stacked.

        Returns:
            Whether they were met bit by bit.
        """
        found = [
            self.env_method("repeat", state, indices=[index])[0]
            for index, state in enumerate(states)
        ]
        return all(
            np.array_equal(last[key][index], part)
            for index, observation in enumerate(found)
            for key, part in observation.items()
        )


def training_envs(config: TrainConfig) -> TimedEnvs:
    """The environments of a run: in this process if it is one, else in a process each.

    Raises:
        UnknownNameError: If a name in the settings is not valid.
        SceneFileError: If the scene file cannot be used.
    """
    if config.n_envs == 1:
        return TimedEnvs(DummyVecEnv([partial(_make, config)]))
    # Spawned and not forked: a forked copy of PyBullet or torch may hang.
    makers: list[Callable[[], Env]] = [partial(_make_in_child, config)] * config.n_envs
    return TimedEnvs(SubprocVecEnv(makers, start_method="spawn"))


def _make(config: TrainConfig) -> Env:
    env = make_env(config.env)
    if catalogue().algorithm(config.algo).is_taught:
        env = Lesson(env)
    if config.hand_over:
        env = HandOver(env, config.hand_over)
    return RepeatableEpisode(Monitor(env))


def _make_in_child(config: TrainConfig) -> Env:
    # Ctrl-C in a terminal reaches all processes; the parent ends this one after a checkpoint.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return _make(config)
