"""Jobs in processes of this machine: one process a job.

Not `concurrent.futures`: there the death of one worker fails all jobs that wait.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from .backend import ATTEMPTS, Job, Outcome, Result, one_line

_GRACE = 60.0  # s to write a checkpoint after an interruption
_THREADS = "OMP_NUM_THREADS"


@dataclass(frozen=True)
class _Worker:
    index: int
    attempt: int
    process: BaseProcess
    connection: Connection


class LocalBackend:
    """See `Backend`. Processes are spawned: a forked copy of PyBullet or torch may hang."""

    def __init__(self, workers: int) -> None:
        """Make it.

        Args:
            workers: Processes at a time.
        """
        self._workers = workers

    def run(
        self, function: Callable[[Job], Result], jobs: Sequence[Job]
    ) -> Generator[Outcome[Result], None, None]:
        """See `Backend`."""
        waiting = deque((index, 1) for index in range(len(jobs)))
        running: list[_Worker] = []
        try:
            while waiting or running:
                while waiting and len(running) < self._workers:
                    index, attempt = waiting.popleft()
                    running.append(_start(function, jobs[index], index, attempt))
                ready = wait([worker.connection for worker in running])
                for worker in [w for w in running if w.connection in ready]:
                    running.remove(worker)
                    outcome: Outcome[Result] = _outcome(worker)
                    if outcome.error and worker.attempt < ATTEMPTS:
                        waiting.append((worker.index, worker.attempt + 1))
                    else:
                        yield outcome
        finally:
            _stop(running)


def _start(function: Callable[[Job], Result], job: Job, index: int, attempt: int) -> _Worker:
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(sender, function, job))
    with _for_children():
        process.start()
    sender.close()  # the child has its own: its death is the end of the pipe
    return _Worker(index, attempt, process, receiver)


@contextmanager
def _for_children() -> Iterator[None]:
    """One thread each for numerical libraries; Ctrl-C is held back until a child has started."""
    threads = os.environ.get(_THREADS)
    os.environ[_THREADS] = "1"
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        os.environ.pop(_THREADS)
        if threads is not None:
            os.environ[_THREADS] = threads


def _outcome(worker: _Worker) -> Outcome[Result]:
    try:
        result, error = worker.connection.recv()
    except EOFError:
        worker.process.join()
        return Outcome(worker.index, error=f"its process died, exit code {worker.process.exitcode}")
    worker.process.join()
    return Outcome(worker.index, result, error)


def _work(connection: Connection, function: Callable[[Job], Result], job: Job) -> None:
    """Body of a child."""
    # A session of its own: Ctrl-C in the terminal is for the parent, which passes it on once.
    os.setsid()
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        connection.send((function(job), ""))
    except KeyboardInterrupt:
        return
    except Exception as error:  # of any kind: it is the job's result, and the others go on
        connection.send((None, one_line(error)))


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _stop(workers: Sequence[_Worker]) -> None:
    """Interrupt workers, wait for their checkpoints, and kill what is still there."""
    try:
        for worker in workers:
            if worker.process.pid is not None and worker.process.is_alive():
                os.kill(worker.process.pid, signal.SIGINT)
        end = time.monotonic() + _GRACE
        for worker in workers:
            worker.process.join(max(0.0, end - time.monotonic()))
    finally:
        for worker in workers:
            worker.process.kill()
            worker.process.join()
