"""When and how a run's rows and checkpoints are written."""

from __future__ import annotations

import io
import pickle
import time

from stable_baselines3.common.base_class import BaseAlgorithm

from .checkpoints import BEST, BUFFER, MODEL, POLICY, STATE, Writers, write_checkpoint
from .clock import Clock
from .config import TrainConfig
from .policy_files import policy_bytes
from .run_log import RunLog
from .run_state import Generators, RunState, Standing
from .runs import RunFolder
from .training_envs import TimedEnvs

_FLUSH_SECONDS = 20.0  # rows wait so long at most, so that they can be read while the run goes on
_CHECKPOINT_SECONDS = 600.0  # what a power cut costs at most, however slow the steps are


class Saver:
    """Writes what a run leaves behind.

    Args:
        config: The run.
        folder: Of the run.
        log: Its rows.
        clock: Its seconds.
        step: Environment steps so far.
    """

    def __init__(
        self, config: TrainConfig, folder: RunFolder, *, log: RunLog, clock: Clock, step: int
    ) -> None:
        self._config, self._folder, self._log, self._clock = config, folder, log, clock
        self._step, self._saved = step, time.perf_counter()
        self._flushed = self._saved

    def is_checkpoint_due(self, step: int) -> bool:
        """Whether enough steps or time have passed since the last checkpoint."""
        every, done = self._config.storage.checkpoint_every, step - self._step
        slow = time.perf_counter() - self._saved > _CHECKPOINT_SECONDS
        return (every > 0 and done >= every) or (slow and done > 0)

    def flush_if_due(self) -> None:
        """Write rows if they have waited long."""
        if time.perf_counter() - self._flushed > _FLUSH_SECONDS:
            self.flush()

    def flush(self) -> None:
        """Write rows.

        Raises:
            StorageError: If they cannot be written.
        """
        with self._clock.measure("storage"):
            self._log.flush()
        self._flushed = time.perf_counter()

    def save(self, model: BaseAlgorithm, envs: TimedEnvs, standing: Standing) -> None:
        """Write rows and a checkpoint.

        Raises:
            StorageError: If something cannot be written; the checkpoints before stay.
        """
        self.flush()
        state = RunState(
            generators=Generators.of(model),
            episodes=envs.episode_states(),
            pending=self._log.pending,
            times=self._clock.read(),
            standing=standing,
            metrics_parts=self._log.metrics.parts,
            evaluation_parts=self._log.evaluations.parts,
        )
        with self._clock.measure("storage"):
            write_checkpoint(
                self._folder.checkpoints,
                model.num_timesteps,
                self._writers(model, state),
                keep=self._config.storage.keep,
            )
        self._step, self._saved = model.num_timesteps, time.perf_counter()

    def policy(self, model: BaseAlgorithm) -> bytes:
        """The model's policy as the content of a file."""
        return policy_bytes(model, algo=self._config.algo, env=self._config.env)

    def _writers(self, model: BaseAlgorithm, state: RunState) -> Writers:
        # In memory first: torch answers a full disk with an error that does not say so.
        zipped = io.BytesIO()
        model.save(zipped)
        contents = {MODEL: zipped.getvalue(), POLICY: self.policy(model)}
        if state.standing.policy is not None:
            contents[BEST] = state.standing.policy
        buffer = getattr(model, "replay_buffer", None)
        objects = {STATE: state} | ({} if buffer is None else {BUFFER: buffer})
        return {
            **{name: lambda file, c=content: file.write(c) for name, content in contents.items()},
            **{
                name: lambda file, o=thing: pickle.dump(o, file, pickle.HIGHEST_PROTOCOL)
                for name, thing in objects.items()
            },
        }
