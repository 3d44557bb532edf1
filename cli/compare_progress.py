"""How a comparison goes on: a bar over the steps of all runs, and a line for each that ends."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from types import TracebackType
from typing import Self

import pyarrow.compute as pc
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from .comparison import JobState, TrainJob, state
from .metrics import read_metrics

_POLL_SECONDS = 20.0  # runs write their rows about as often


class CompareProgress:
    """Tells how far all runs are, within a `with` block."""

    def __init__(self, console: Console, jobs: Sequence[TrainJob]) -> None:
        """Look at what there is.

        Args:
            console: Where to tell it.
            jobs: All of the comparison.
        """
        self._console, self._jobs = console, jobs
        self._steps = {job: _steps(state(job)) for job in jobs}
        self._open = {job for job in jobs if not state(job).finished}
        self._first, self._begin = sum(self._steps.values()), time.monotonic()
        self._total = sum(job.config.steps for job in jobs)
        self._done = threading.Event()
        self._poller = threading.Thread(target=self._poll, daemon=True)
        self._bar = Progress(
            TextColumn("steps"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            console=console,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task("steps", total=self._total, completed=self._first)

    def __enter__(self) -> Self:
        """Begin to look."""
        ready = len(self._jobs) - len(self._open)
        self._console.print(f"{len(self._jobs)} runs, {ready} of them finished before")
        self._bar.start()
        self._poller.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End."""
        self._done.set()
        self._poller.join()
        self._bar.stop()

    def ended(self, found: JobState) -> None:
        """A run has ended."""
        self._open.discard(found.job)
        self._steps[found.job] = _steps(found)
        self._show()
        ready = len(self._jobs) - len(self._open)
        path = found.run.path if found.run else "no folder"
        self._console.print(
            f"{ready} of {len(self._jobs)}: {found.job.name}: {found.error or 'finished'}, {path}"
            f"{self._time_left()}",
            markup=False,
        )

    def _time_left(self) -> str:
        done = sum(self._steps.values())
        if not self._open or done <= self._first:
            return ""
        seconds = (time.monotonic() - self._begin) * (self._total - done) / (done - self._first)
        return f", about {seconds / 60.0:.0f} min left"

    def _poll(self) -> None:
        while not self._done.wait(_POLL_SECONDS):
            for job in list(self._open):
                self._steps[job] = _steps(state(job))
            self._show()

    def _show(self) -> None:
        self._bar.update(self._task, completed=sum(self._steps.values()))


def _steps(found: JobState) -> int:
    """Environment steps that a run has done, as far as it has written rows."""
    if found.finished:
        return found.job.config.steps
    if found.run is None:
        return 0
    return pc.max(read_metrics(found.run.path)["step"]).as_py() or 0
