"""A training run from its settings to its last checkpoint, at once or in several sessions."""

from __future__ import annotations

import pickle
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import pyarrow.compute as pc
import torch as th
from stable_baselines3.common.base_class import BaseAlgorithm

from sb3_bayes_dsac.errors import BayesDsacError

from .algorithms import catalogue
from .atomic_files import StorageError
from .callbacks import Attendant
from .checkpoints import (
    BUFFER,
    MODEL,
    STATE,
    Checkpoint,
    DamagedCheckpointError,
    checkpoints,
    forget_after,
    forget_training,
)
from .config import TrainConfig
from .evaluator import Evaluator
from .exit_codes import CliError, one_line
from .interruption import Interruption
from .metrics import read_evaluations
from .models import buffer_megabytes, new_model
from .progress import Listener, Silence
from .run_log import Clock, RunLog
from .run_state import RunState, Times
from .runs import Manifest, Resumption, RunFolder, Status
from .training_envs import EpisodeNotReproducedError, TimedEnvs, training_envs


@dataclass(frozen=True)
class RunResult:
    """What came of a run.

    Attributes:
        folder: Where everything is.
        status: "finished", or "interrupted" by Ctrl-C.
        steps: Environment steps done.
        episodes: Validation episodes at the end; 0 if it was interrupted.
        successes: How many of them reached the goal.
        mean_return: Of them; None without any.
    """

    folder: Path
    status: Status
    steps: int
    episodes: int
    successes: int
    mean_return: float | None


@dataclass(frozen=True)
class _Loaded:
    """A checkpoint that was read."""

    checkpoint: Checkpoint
    model: BaseAlgorithm
    state: RunState


def train(
    config: TrainConfig,
    folder: Path,
    *,
    resume: bool = False,
    exact: bool = False,
    progress: Listener | None = None,
) -> RunResult:
    """Train, evaluate, store.

    Args:
        config: What to do.
        folder: Of this run; made if needed.
        resume: Whether to go on with a run that is in there. Without one it begins.
        exact: Whether to refuse to resume if the running episode cannot be repeated bit by bit.
        progress: Who is told how it goes on.

    Raises:
        UnknownNameError: If a name in the settings is not valid.
        CliError: If the folder holds another run or another process is at work there, if training
            diverges, or if files cannot be written (`StorageError`).
        MemoryError: If the replay buffer does not fit.
    """
    run, listener = RunFolder(folder), progress or Silence()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(folder, error) from error
    with run.locked():
        if run.manifest.exists():
            _check_resumable(run, config, resume=resume)
            if run.read().status == "finished":
                return _result(run)
        else:
            run.write(Manifest.of(config))
        _guarded(run, config, listener, exact=exact)
    return _result(run)


def _check_resumable(run: RunFolder, config: TrainConfig, *, resume: bool) -> None:
    if not resume:
        raise CliError(f"{run.path} holds a run: resume it, or give another folder")
    if run.read().config_hash != config.content_hash():
        raise CliError(
            f"{run.path} holds a run with other settings, or the defaults of its algorithm have "
            "changed since; start a new one"
        )


def _guarded(run: RunFolder, config: TrainConfig, listener: Listener, *, exact: bool) -> None:
    """Run a session; the manifest tells how it ended."""
    with ExitStack() as stack:
        session = _Session(run, config, listener, stack)
        try:
            session.prepare(exact=exact)
            session.learn()
        except KeyboardInterrupt:
            run.finish("interrupted", session.steps)
        except Exception as error:
            with suppress(StorageError):  # the first error tells more
                run.finish("failed", session.steps, f"{type(error).__name__}: {one_line(error)}")
            if isinstance(error, BayesDsacError):  # of the algorithm, on purpose
                raise CliError(f"{run.path}: training failed: {one_line(error)}") from error
            raise
        else:
            run.finish("finished", session.steps)
            forget_training(run.checkpoints)


class _Session:
    """One process's part of a run."""

    def __init__(
        self, run: RunFolder, config: TrainConfig, listener: Listener, stack: ExitStack
    ) -> None:
        self._run, self._config, self._listener, self._stack = run, config, listener, stack
        self._model: BaseAlgorithm | None = None

    @property
    def steps(self) -> int:
        """Environment steps done."""
        return self._model.num_timesteps if self._model else 0

    def prepare(self, *, exact: bool) -> None:
        """Make or load everything."""
        config, run = self._config, self._run
        th.set_num_threads(config.threads)
        envs = training_envs(config)
        self._stack.callback(envs.close)
        loaded = _newest(run, config, envs, self._listener)
        forget_after(run.checkpoints, loaded.checkpoint if loaded else None)
        self._model = model = loaded.model if loaded else new_model(config, envs)
        state = loaded.state if loaded else None
        clock = Clock(state.times if state else Times())
        parts = (state.metrics_parts, state.evaluation_parts) if state else (0, 0)
        log = RunLog(run, clock, step=model.num_timesteps, parts=parts)
        self._stack.callback(log.logger.close)
        model.set_logger(log.logger)
        interruption = self._stack.enter_context(Interruption())
        evaluator = Evaluator(config, run, interruption.check)
        self._stack.callback(evaluator.close)
        self._attendant = Attendant(
            config,
            run,
            log=log,
            clock=clock,
            evaluator=evaluator,
            interruption=interruption,
            listener=self._listener,
        )
        _announce(model, self._listener)
        if loaded:
            self._restore(loaded, envs, log, exact=exact)
        elif run.read().status != "running":
            _note_resumption(run, 0)

    def learn(self) -> None:
        """Learn to the end and evaluate."""
        assert self._model is not None
        # Logged after each episode: these are few and long. SB3 adds the steps that it is given
        # to those that were done.
        self._model.learn(
            self._config.steps - self.steps,
            self._attendant,
            log_interval=1,
            reset_num_timesteps=self.steps == 0,
        )
        self._attendant.finish()

    def _restore(self, loaded: _Loaded, envs: TimedEnvs, log: RunLog, *, exact: bool) -> None:
        model, state = loaded.model, loaded.state
        last = cast("dict[str, Any]", model._last_obs)
        if not envs.repeat(state.episodes, last):
            if exact:
                raise EpisodeNotReproducedError
            self._listener.note("the running episode could not be repeated: it starts anew")
            model._last_obs = envs.reset()  # type: ignore[assignment]
        log.restore(state.pending)
        self._attendant.restore(state, loaded.checkpoint)
        _note_resumption(self._run, model.num_timesteps)
        self._listener.note(f"resumed at step {model.num_timesteps}")
        state.generators.restore(model)


def _newest(
    run: RunFolder, config: TrainConfig, envs: TimedEnvs, listener: Listener
) -> _Loaded | None:
    """The newest sound checkpoint, or None for a run that has to begin again."""
    for checkpoint in checkpoints(run.checkpoints):
        try:
            return _load(checkpoint, config, envs)
        except DamagedCheckpointError as error:
            listener.note(f"{error}: the one before is used")
    return None


def _load(checkpoint: Checkpoint, config: TrainConfig, envs: TimedEnvs) -> _Loaded:
    """Read a checkpoint; all checksums are checked before anything is unpickled."""
    buffered = catalogue().algorithm(config.algo).kind == "off_policy"
    needed = [MODEL, STATE, *([BUFFER] if buffered else [])]
    paths = {name: checkpoint.verified(name) for name in needed}
    algorithm = catalogue().algorithm(config.algo).load()
    # buffer_size=1: SB3 would allocate a whole buffer, which is replaced at once.
    size = {"buffer_size": 1} if buffered else {}
    model = algorithm.load(paths[MODEL], env=envs, device=config.device, force_reset=False, **size)
    if buffered:
        model.buffer_size = config.arguments()["buffer_size"]
        model.load_replay_buffer(paths[BUFFER])
    with paths[STATE].open("rb") as file:
        state = pickle.load(file)
    return _Loaded(checkpoint, model, state)


def _note_resumption(run: RunFolder, step: int) -> None:
    manifest = run.read()
    resumed = [*manifest.resumed, Resumption(step=step)]
    update = {"resumed": resumed, "status": "running", "ended": None, "error": ""}
    run.write(manifest.model_copy(update=update))


def _announce(model: BaseAlgorithm, listener: Listener) -> None:
    megabytes = buffer_megabytes(model)
    if megabytes is not None:
        listener.note(f"replay buffer: {megabytes:.0f} MB when full")


def _result(run: RunFolder) -> RunResult:
    manifest, table = run.read(), read_evaluations(run.path)
    final = table.filter(pc.equal(table["protocol"], "validation"))
    return RunResult(
        folder=run.path,
        status=manifest.status,
        steps=manifest.steps_done,
        episodes=final.num_rows,
        successes=pc.sum(final["success"]).as_py() or 0,
        mean_return=pc.mean(final["return"]).as_py(),
    )
