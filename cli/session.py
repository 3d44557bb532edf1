"""One process's part of a training run: from nothing or a checkpoint to the end."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any, cast

import torch as th
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from .attendant import Attendant
from .checkpoints import forget_after
from .clock import Clock
from .config import TrainConfig
from .evaluator import Evaluator
from .guidance import guide
from .interruption import Interruption
from .loading import Loaded, newest
from .models import buffer_megabytes, new_model
from .progress import Listener
from .run_log import RunLog
from .run_state import Standing, Times
from .runs import RunFolder
from .saver import Saver
from .training_envs import EpisodeNotReproducedError, TimedEnvs, training_envs


class Session:
    """One process's part of a run."""

    def __init__(
        self, run: RunFolder, config: TrainConfig, listener: Listener, stack: ExitStack
    ) -> None:
        self._run, self._config, self._listener, self._stack = run, config, listener, stack
        self._model: BaseAlgorithm | None = None

    @property
    def steps(self) -> int:
        """Environment steps done."""
        return self._model.num_timesteps if self._model else self._run.read().steps_done

    def prepare(self, *, exact: bool) -> None:
        """Make or load everything.

        Args:
            exact: Whether the running episode has to be repeated bit by bit.
        """
        config, run = self._config, self._run
        th.set_num_threads(config.threads)
        envs = training_envs(config)
        self._stack.callback(envs.close)
        loaded = newest(run, config, envs, self._listener)
        forget_after(run.checkpoints, loaded.checkpoint if loaded else None)
        self._is_new = loaded is None
        self._model = model = loaded.model if loaded else new_model(config, envs)
        state = loaded.state if loaded else None
        clock = Clock(state.times if state else Times())
        parts = (state.metrics_parts, state.evaluation_parts) if state else (0, 0)
        log = RunLog(run, clock, step=model.num_timesteps, parts=parts)
        self._stack.callback(log.logger.close)
        model.set_logger(log.logger)
        standing = state.standing if state else Standing(config.protocol.every)
        self._attend(log, clock, standing)
        _announce(model, self._listener)
        if loaded:
            self._restore(loaded, envs, log, exact=exact)
        elif config.guided_steps:
            self._guide(cast(OffPolicyAlgorithm, model))

    def learn(self) -> None:
        """Learn to the end and evaluate."""
        assert self._model is not None
        # Logged after each episode: these are few and long. SB3 adds the steps that it is given
        # to those that were done.
        self._model.learn(
            self._config.steps - self.steps,
            self._attendant,
            log_interval=1,
            reset_num_timesteps=self._is_new,
        )
        self._attendant.finish()

    def _attend(self, log: RunLog, clock: Clock, standing: Standing) -> None:
        config, run = self._config, self._run
        self._interruption = interruption = self._stack.enter_context(Interruption())
        evaluator = Evaluator(config, run, interruption.check)
        self._stack.callback(evaluator.close)
        self._attendant = Attendant(
            config,
            standing,
            log=log,
            clock=clock,
            evaluator=evaluator,
            saver=Saver(config, run, log=log, clock=clock, step=self.steps),
            interruption=interruption,
            listener=self._listener,
        )

    def _guide(self, model: OffPolicyAlgorithm) -> None:
        shown = guide(model, self._config, self._interruption.check)
        self._listener.note(
            f"demonstrations: {shown.successes} of {shown.episodes} goals in {shown.steps} steps"
        )

    def _restore(self, loaded: Loaded, envs: TimedEnvs, log: RunLog, *, exact: bool) -> None:
        model, state = loaded.model, loaded.state
        last = cast("dict[str, Any]", model._last_obs)
        if not envs.repeat(state.episodes, last):
            if exact:
                raise EpisodeNotReproducedError
            self._listener.note("the running episode could not be repeated: it starts anew")
            model._last_obs = envs.reset()  # type: ignore[assignment]
        log.restore(state.pending)
        self._listener.note(f"resumed at step {model.num_timesteps}")
        state.generators.restore(model)


def _announce(model: BaseAlgorithm, listener: Listener) -> None:
    megabytes = buffer_megabytes(model)
    if megabytes is not None:
        listener.note(f"replay buffer: {megabytes:.0f} MB when full")
