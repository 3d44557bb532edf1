"""Evaluation of a policy while it learns, on validation instances, without action noise."""

from __future__ import annotations

from collections.abc import Callable

from stable_baselines3.common.base_class import BaseAlgorithm

from horf_env.recording import EpisodeRecorder

from .config import TrainConfig
from .environments import Env, make_env
from .episodes import Observer, Trial, run_episode
from .policies import PolicyPlanner, policy_planner
from .recordings import save_recording
from .runs import RunFolder

_SPLIT = "validation"


class Evaluator:
    """Drives validation instances 0, 1, ... and records the last of them.

    Args:
        config: The run.
        folder: Of the run.
        check: Called at each step; raises to stop.
    """

    def __init__(self, config: TrainConfig, folder: RunFolder, check: Callable[..., None]) -> None:
        self._config, self._folder, self._check = config, folder, check
        # A policy that corrects a planner is a planner, whose actions are whole ones.
        direct = config.env.model_copy(update={"action_mode": "direct"})
        self._env: Env = make_env(direct)

    def run(self, model: BaseAlgorithm, episodes: int, name: str) -> list[Trial]:
        """Evaluate.

        Args:
            model: Who decides.
            episodes: How many instances.
            name: Of the recording.
        """
        planner = policy_planner(model, self._config.env)
        *others, last = range(episodes)
        trials = [self._drive(planner, instance, []) for instance in others]
        recorder = EpisodeRecorder()
        trials.append(self._drive(planner, last, [lambda env: recorder.add(env.record)]))
        path = self._folder.recordings / f"{name}.rrd"
        path.parent.mkdir(exist_ok=True)
        save_recording(recorder, self._env, trials[-1], split=_SPLIT, path=path)
        return trials

    def close(self) -> None:
        """Free the environment."""
        self._env.close()

    def _drive(self, planner: PolicyPlanner, instance: int, observers: list[Observer]) -> Trial:
        return run_episode(
            self._env,
            planner,
            method=self._config.algo,
            scene=self._config.env.scene,
            instance=instance,
            split=_SPLIT,
            observers=[self._check, *observers],
        )
