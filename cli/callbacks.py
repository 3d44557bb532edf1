"""What happens beside learning: rows, evaluations, checkpoints, progress, Ctrl-C."""

from __future__ import annotations

import pickle
import time
from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from .checkpoints import BEST, BUFFER, MODEL, POLICY, STATE, Checkpoint, Writers, write_checkpoint
from .config import TrainConfig
from .episodes import Trial
from .evaluator import Evaluator
from .exit_codes import CliError
from .interruption import Interruption
from .policy_files import policy_bytes
from .progress import Listener, Snapshot
from .run_log import Clock, RunLog
from .run_state import Generators, RunState
from .runs import RunFolder
from .training_envs import TimedEnvs

_PROGRESS_SECONDS = 0.5  # between two snapshots
_FLUSH_SECONDS = 20.0  # rows wait so long at most, so that they can be read while the run goes on
_CHECKPOINT_SECONDS = 600.0  # what a power cut costs at most, however slow the steps are


class TrainingDivergedError(CliError):
    """A value of the update is not finite."""


class Attendant(BaseCallback):
    """Attends a run.

    Whatever must not be half done happens at the beginning of a rollout: there model, buffer,
    environments and counters fit together.

    Attributes:
        best: Success rate and return of the best evaluation.
        best_policy: Its policy, as the content of a file; None before the first.
        next_evaluation: Step of it.
    """

    def __init__(
        self,
        config: TrainConfig,
        folder: RunFolder,
        *,
        log: RunLog,
        clock: Clock,
        evaluator: Evaluator,
        interruption: Interruption,
        listener: Listener,
    ) -> None:
        super().__init__()
        self._config, self._folder, self._log, self._clock = config, folder, log, clock
        self._evaluator, self._interruption, self._listener = evaluator, interruption, listener
        self.best = (-1.0, -np.inf)
        self.best_policy: bytes | None = None
        self.next_evaluation = config.protocol.every
        self._update_begin: float | None = None
        self._last_snapshot = self._last_flush = self._last_saved = time.perf_counter()
        self._begin = time.perf_counter()

    def restore(self, state: RunState, checkpoint: Checkpoint) -> None:
        """Go on from a checkpoint."""
        self.best, self.next_evaluation = state.best, state.next_evaluation
        if BEST in checkpoint:
            self.best_policy = checkpoint.verified(BEST).read_bytes()

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
        self._log.flush()

    def _on_training_start(self) -> None:
        self._first_step = self._saved_step = self.num_timesteps
        self._begin = time.perf_counter()

    def _on_step(self) -> bool:
        self._log.add_episodes(self.num_timesteps, self.locals["infos"])
        now = time.perf_counter()
        if now - self._last_snapshot > _PROGRESS_SECONDS:
            self._last_snapshot = now
            self._listener.update(self._snapshot())
        return True

    def _on_rollout_end(self) -> None:
        self._update_begin = time.perf_counter()

    def _on_rollout_start(self) -> None:
        if self._update_begin is not None:
            self._clock.add("update", time.perf_counter() - self._update_begin)
            self._update_begin = None
        self._check_finite()
        evaluated = False
        try:
            if self.num_timesteps >= self.next_evaluation:
                self._paper_evaluation()
                evaluated = True
            self._interruption.check()
        except KeyboardInterrupt:
            self._save()
            raise
        if evaluated or self._is_checkpoint_due():
            self._save()
        elif time.perf_counter() - self._last_flush > _FLUSH_SECONDS:
            self._flush()

    def _check_finite(self) -> None:
        for name, value in self.logger.name_to_value.items():
            if name.startswith("train/") and not np.isfinite(value):
                raise TrainingDivergedError(
                    f"{name} is {value} at step {self.num_timesteps}: try a smaller learning_rate; "
                    "the checkpoints before are sound"
                )

    def _is_checkpoint_due(self) -> bool:
        every = self._config.storage.checkpoint_every
        steps = self.num_timesteps - self._saved_step
        slow = time.perf_counter() - self._last_saved > _CHECKPOINT_SECONDS
        return bool(every and steps >= every) or (slow and steps > 0)

    def _paper_evaluation(self) -> None:
        step, protocol = self.num_timesteps, self._config.protocol
        trials = self._evaluate(protocol.episodes, f"step{step:08d}")
        self.next_evaluation = (step // protocol.every + 1) * protocol.every
        self._log.add_evaluation(step, "paper", trials)
        score = _score(trials)
        if score > self.best:
            self.best, self.best_policy = score, self._policy()
        self.logger.record("eval/success_rate", score[0])
        self.logger.record("eval/return", score[1])
        self._record_times()
        self.logger.dump(step)
        outcomes = ", ".join(trial.outcome for trial in trials)
        self._listener.note(
            f"evaluation at step {step}: success {score[0]:.0%}, return {score[1]:.1f}, "
            f"outcomes {outcomes}"
        )

    def _evaluate(self, episodes: int, name: str) -> list[Trial]:
        with self._clock.measure("evaluation"):
            return self._evaluator.run(self.model, episodes, name)

    def _record_times(self) -> None:
        envs, times = self._envs, self._clock.read()
        self.logger.record("time/total", times.total)
        self.logger.record("time/environment", times.environment + envs.seconds)
        self.logger.record("time/update", times.update)
        self.logger.record("time/evaluation", times.evaluation)
        self.logger.record("time/storage", times.storage)

    def _flush(self) -> None:
        with self._clock.measure("storage"):
            self._log.flush()
        self._last_flush = time.perf_counter()

    def _save(self) -> None:
        """Write rows and a checkpoint."""
        self._flush()
        with self._clock.measure("storage"):
            write_checkpoint(
                self._folder.checkpoints,
                self.num_timesteps,
                self._writers(),
                keep=self._config.storage.keep,
            )
        self._saved_step, self._last_saved = self.num_timesteps, time.perf_counter()

    def _writers(self) -> Writers:
        state, policy = self._state(), self._policy()
        files: dict[str, Any] = {
            MODEL: self.model.save,
            POLICY: lambda file: file.write(policy),
            STATE: lambda file: pickle.dump(state, file),
        }
        if self.best_policy is not None:
            best = self.best_policy
            files[BEST] = lambda file: file.write(best)
        buffer = getattr(self.model, "replay_buffer", None)
        if buffer is not None:
            files[BUFFER] = lambda file: pickle.dump(buffer, file, pickle.HIGHEST_PROTOCOL)
        return files

    def _state(self) -> RunState:
        self._clock.add("environment", self._envs.take_seconds())
        return RunState(
            generators=Generators.of(self.model),
            episodes=self._envs.episode_states(),
            pending=self._log.pending,
            times=self._clock.read(),
            next_evaluation=self.next_evaluation,
            best=self.best,
            metrics_parts=self._log.metrics.parts,
            evaluation_parts=self._log.evaluations.parts,
        )

    @property
    def _envs(self) -> TimedEnvs:
        return cast(TimedEnvs, self.training_env)

    def _policy(self) -> bytes:
        return policy_bytes(self.model, algo=self._config.algo, env=self._config.env)

    def _snapshot(self) -> Snapshot:
        times, step = self._clock.read(), self.num_timesteps
        rate = (step - self._first_step) / (time.perf_counter() - self._begin)
        episodes, successes = self.model.ep_info_buffer, self.model.ep_success_buffer
        return Snapshot(
            step=step,
            steps=self._config.steps,
            rate=rate,
            eta=(self._config.steps - step) / max(rate, 1e-9),
            mean_return=float(np.mean([e["r"] for e in episodes])) if episodes else None,
            success=float(np.mean(successes)) if successes else None,
            environment=(times.environment + self._envs.seconds) / times.total,
            update=times.update / times.total,
        )


def _score(trials: Sequence[Trial]) -> tuple[float, float]:
    """Success rate and mean return: the better evaluation is the larger pair."""
    return (
        float(np.mean([trial.success for trial in trials])),
        float(np.mean([trial.episode_return for trial in trials])),
    )
