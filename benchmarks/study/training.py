"""One run: learning with a look at the policy at equal distances."""

from __future__ import annotations

import time
from typing import Any, cast

import gymnasium as gym
import numpy as np
import torch as th
from numpy.typing import NDArray
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.logger import configure
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from sb3_bayes_dsac.common.q_bias import estimate_q_bias

from .hyperparameters import new_model
from .records import DIAGNOSTICS
from .runs import Run

# Every evaluation of every run begins its episodes alike, apart from those of the training.
EVALUATION_SEED = 10_000
BIAS_EPISODES = 2

Row = dict[str, Any]


def train(run: Run) -> tuple[list[Row], str]:
    """Do a run.

    Returns:
        One row an evaluation, the last one after the last update; and "completed", or what stopped
        the run. A run that its numbers stopped is a result, too; it has the rows until then.
    """
    model, watch = new_model(run), Watch(run)
    model.set_logger(configure(None, []))
    try:
        # Nothing is dumped, so the logger keeps what the last call of train() recorded.
        model.learn(run.task.steps, watch, log_interval=None)  # type: ignore[arg-type]
    except (ValueError, ArithmeticError) as error:
        return watch.rows, f"stopped at step {model.num_timesteps}: {error}"
    watch.look()
    return watch.rows, "completed"


class Watch(BaseCallback):
    """Evaluates the policy every so many steps, outside of the time that counts.

    Attributes:
        rows: What it saw.
    """

    def __init__(self, run: Run) -> None:
        super().__init__()
        self.rows: list[Row] = []
        self._task = run.task
        # All episodes at once: the policy is asked for one batch of actions a step.
        self._env = make_vec_env(run.task.env_id, run.task.episodes)
        self._bias_env = gym.make(run.task.env_id, max_episode_steps=run.task.bias_steps)
        self._begin = self._clocks()
        self._idle = np.zeros(2)

    def _on_step(self) -> bool:
        due = self.num_timesteps % self._task.evaluate_every == 0
        # The last look is not here, before the last update, but at the end.
        if due and self.num_timesteps < self._task.steps:
            self.look()
        return True

    def look(self) -> None:
        """Add a row; neither the clocks nor the random numbers of the training notice."""
        before = self._clocks()
        wall, cpu = before - self._begin - self._idle
        logged = self.model.logger.name_to_value
        with th.random.fork_rng():
            th.manual_seed(EVALUATION_SEED)
            row = {"returns": self._returns(), **self._bias()}
        row |= {"step": self.model.num_timesteps, "wall_s": wall, "cpu_s": cpu}
        row |= {name: logged.get(f"train/{name}") for name in DIAGNOSTICS}
        self.rows.append(row)
        self._idle += self._clocks() - before

    def _returns(self) -> list[float]:
        """Returns of some episodes without exploration noise."""
        self._env.seed(EVALUATION_SEED)
        rewards, _ = evaluate_policy(
            self.model, self._env, self._task.episodes, return_episode_rewards=True
        )
        return cast("list[float]", rewards)  # one an episode, as asked for

    def _bias(self) -> Row:
        """Bias of Q, for algorithms that have one."""
        if not isinstance(self.model, OffPolicyAlgorithm):
            return {}
        bias = estimate_q_bias(
            self.model, self._bias_env, n_episodes=BIAS_EPISODES, seed=EVALUATION_SEED
        )
        return {"q_bias": bias.mean, "q_bias_std": bias.std, "soft_return": bias.return_mean}

    @staticmethod
    def _clocks() -> NDArray[np.float64]:
        """Wall clock and processor time in s."""
        return np.array([time.perf_counter(), time.process_time()])
