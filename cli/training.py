"""A training run from its settings to its last checkpoint, at once or in several sessions."""

from __future__ import annotations

from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

import pyarrow.compute as pc

from sb3_bayes_dsac.errors import BayesDsacError

from .atomic_files import StorageError
from .checkpoints import forget_training
from .config import TrainConfig
from .exit_codes import CliError, one_line
from .metrics import read_evaluations
from .progress import Listener, Silence
from .provenance import git_revision, machine, versions
from .runs import Manifest, RunFolder, Status
from .session import Session


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
        exact: Whether to refuse to resume unless what follows is bit-equal to a run that was never
            interrupted: the same code, packages and machine, and a running episode that can be
            repeated bit by bit.
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
            manifest = run.read()
            _check_resumable(run, manifest, config, resume=resume)
            if manifest.status == "finished":
                return _result(run)
            if exact:
                _check_same(run, manifest)
            run.resume()
        else:
            run.write(Manifest.of(config))
        _guarded(run, config, listener, exact=exact)
    return _result(run)


def _check_resumable(
    run: RunFolder, manifest: Manifest, config: TrainConfig, *, resume: bool
) -> None:
    if not resume:
        raise CliError(f"{run.path} holds a run: resume it, or give another folder")
    if manifest.config_hash != config.content_hash():
        raise CliError(
            f"{run.path} holds a run with other settings, or the defaults of its algorithm have "
            "changed since; start a new one"
        )


def _check_same(run: RunFolder, manifest: Manifest) -> None:
    """Refuse to go on exactly with other code or on another machine."""
    then = {**manifest.versions, **manifest.machine, "revision": manifest.git_revision}
    now = {**versions(), **machine(), "revision": git_revision()}
    for name, value in then.items():
        if now.get(name) != value:
            raise CliError(
                f"{run.path}: not exact, {name} was {value} and is {now.get(name)}; "
                "resume without --exact"
            )


def _guarded(run: RunFolder, config: TrainConfig, listener: Listener, *, exact: bool) -> None:
    """Run a session; the manifest tells how it ended."""
    with ExitStack() as stack:
        session = Session(run, config, listener, stack)
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
