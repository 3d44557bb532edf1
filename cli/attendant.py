"""What happens beside learning: rows, evaluations, checkpoints, progress, Ctrl-C."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import cast

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from .clock import Clock
from .config import TrainConfig
from .episodes import Trial
from .evaluator import Evaluator
from .exit_codes import CliError
from .interruption import Interruption
from .pace import Pace
from .progress import Listener
from .run_log import RunLog
from .run_state import Generators, Standing
from .saver import Saver
from .training_envs import TimedEnvs


class TrainingDivergedError(CliError):
    """A value of the update is not finite."""


class Attendant(BaseCallback):
    """Attends a run.

    Whatever must not be half done happens at the beginning of a rollout: there model, buffer,
    environments and counters fit together.

    Args:
        config: The run.
        standing: What evaluations have brought so far.
        log: Takes rows.
        clock: The run's seconds.
        evaluator: Drives evaluation episodes.
        saver: Writes rows and checkpoints.
        interruption: Knows whether Ctrl-C was pressed.
        listener: Is told how it goes on.
    """

    def __init__(
        self,
        config: TrainConfig,
        standing: Standing,
        *,
        log: RunLog,
        clock: Clock,
        evaluator: Evaluator,
        saver: Saver,
        interruption: Interruption,
        listener: Listener,
    ) -> None:
        super().__init__()
        self._config, self._standing, self._log, self._clock = config, standing, log, clock
        self._evaluator, self._saver = evaluator, saver
        self._interruption, self._listener = interruption, listener
        self._update_begin: float | None = None

    def finish(self) -> None:
        """After the last update: evaluate, write everything.

        Raises:
            KeyboardInterrupt: If Ctrl-C was pressed; a checkpoint was written before.
        """
        self._on_rollout_start()
        self.logger.dump(self.num_timesteps)
        self._save()
        trials = self._evaluate(self._config.protocol.final_episodes, "final")
        self._log.add_evaluation(self.num_timesteps, "validation", trials)
        self._saver.flush()

    def _on_training_start(self) -> None:
        self._pace = Pace(self._config.steps, self.num_timesteps)

    def _on_step(self) -> bool:
        self._log.add_episodes(self.num_timesteps, self.locals["infos"])
        if self._pace.is_due():
            times = self._clock.read(self._envs.seconds)
            self._listener.update(self._pace.snapshot(self.model, times))
        return True

    def _on_rollout_end(self) -> None:
        self._update_begin = time.perf_counter()

    def _on_rollout_start(self) -> None:
        if self._update_begin is not None:
            self._clock.add("update", time.perf_counter() - self._update_begin)
            self._update_begin = None
        self._check_finite()
        evaluated = self.num_timesteps >= self._standing.next_evaluation
        try:
            if evaluated:
                self._paper_evaluation()
            self._interruption.check()
        except KeyboardInterrupt:
            self._save()
            raise
        if evaluated or self._saver.is_checkpoint_due(self.num_timesteps):
            self._save()
        else:
            self._saver.flush_if_due()

    def _check_finite(self) -> None:
        for name, value in self.logger.name_to_value.items():
            if name.startswith("train/") and not np.isfinite(value):
                raise TrainingDivergedError(
                    f"{name} is {value} at step {self.num_timesteps}: try a smaller learning_rate; "
                    "the checkpoints before are sound"
                )

    def _paper_evaluation(self) -> None:
        step, protocol = self.num_timesteps, self._config.protocol
        trials = self._evaluate(protocol.episodes, f"step{step:08d}")
        self._log.add_evaluation(step, "paper", trials)
        score = _score(trials)
        following = (step // protocol.every + 1) * protocol.every
        self._standing = self._standing.after(
            score, lambda: self._saver.policy(self.model), following
        )
        self.logger.record("eval/success_rate", score[0])
        self.logger.record("eval/return", score[1])
        for name, seconds in self._clock.read(self._envs.seconds).named().items():
            self.logger.record(f"time/{name}", seconds)
        self.logger.dump(step)
        outcomes = ", ".join(trial.outcome for trial in trials)
        self._listener.note(
            f"evaluation at step {step}: success {score[0]:.0%}, return {score[1]:.1f}, "
            f"outcomes {outcomes}"
        )

    def _evaluate(self, episodes: int, name: str) -> list[Trial]:
        """Run episodes without a trace in the random numbers that training uses."""
        generators = Generators.of(self.model)
        with self._clock.measure("evaluation"):
            trials = self._evaluator.run(self.model, episodes, name)
        generators.restore(self.model)
        return trials

    def _save(self) -> None:
        self._clock.add("environment", self._envs.take_seconds())
        self._saver.save(self.model, self._envs, self._standing)

    @property
    def _envs(self) -> TimedEnvs:
        return cast(TimedEnvs, self.training_env)


def _score(trials: Sequence[Trial]) -> tuple[float, float]:
    """Success rate and mean return: the better evaluation is the larger pair."""
    return (
        float(np.mean([trial.success for trial in trials])),
        float(np.mean([trial.episode_return for trial in trials])),
    )
