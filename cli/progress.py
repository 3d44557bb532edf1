"""How a training run tells where it is: to a bar in a terminal, as lines, or to nobody."""

from __future__ import annotations

from dataclasses import dataclass
from types import TracebackType
from typing import Protocol, Self

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

_LINES_WITHOUT_BAR = 10  # progress lines of a run whose stderr is no terminal


@dataclass(frozen=True)
class Snapshot:
    """Where a run is.

    Attributes:
        step: Environment steps so far.
        steps: Environment steps in the end.
        rate: Steps a second since this process began, with everything that takes time.
        eta: Seconds that the rest takes at that rate, without the evaluation at the end.
        mean_return: Of the last training episodes; None before the first.
        success: Share of them; None before the first.
        environment: Share of the time that environments took.
        update: Share of the time that gradient steps took.
        evaluation: Share of the time that evaluation episodes took.
    """

    step: int
    steps: int
    rate: float
    eta: float
    mean_return: float | None
    success: float | None
    environment: float
    update: float
    evaluation: float

    @property
    def outcome(self) -> str:
        """Return and success in words, "" before the first episode."""
        if self.mean_return is None or self.success is None:
            return ""
        return f"return {self.mean_return:.1f}, success {self.success:.0%}"

    @property
    def shares(self) -> str:
        """Where the time goes, in words."""
        parts = {
            "environment": self.environment,
            "update": self.update,
            "evaluation": self.evaluation,
        }
        rest = max(1.0 - sum(parts.values()), 0.0)
        return ", ".join(f"{name} {part:.0%}" for name, part in [*parts.items(), ("rest", rest)])


class Listener(Protocol):
    """Is told how a run goes on."""

    def update(self, snapshot: Snapshot) -> None:
        """About twice a second."""

    def note(self, text: str) -> None:
        """Something worth a line."""


class Silence:
    """Tells nobody."""

    def update(self, snapshot: Snapshot) -> None:
        """Nothing."""

    def note(self, text: str) -> None:
        """Nothing."""


class ConsoleListener:
    """A bar, or some lines where there is no terminal; within a `with` block."""

    def __init__(self, console: Console, name: str) -> None:
        self._console = console
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[text]}"),
            console=console,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task(name, total=None, text="")
        self._next_line = 0

    def __enter__(self) -> Self:
        """Show the bar."""
        self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Leave the bar as it is."""
        self._bar.stop()

    def update(self, snapshot: Snapshot) -> None:
        """Move the bar, or write a line for each tenth of the run."""
        text = f"{snapshot.rate:.1f} steps/s ({snapshot.shares})"
        if snapshot.outcome:
            text = f"{text}, {snapshot.outcome}"
        self._bar.update(self._task, completed=snapshot.step, total=snapshot.steps, text=text)
        if not self._console.is_terminal and snapshot.step >= self._next_line:
            line = max(snapshot.steps // _LINES_WITHOUT_BAR, 1)
            self._next_line = (snapshot.step // line + 1) * line
            eta = f"{snapshot.eta:.0f} s to go"
            self._console.print(f"step {snapshot.step} of {snapshot.steps}, {eta}, {text}")

    def note(self, text: str) -> None:
        """A line above the bar."""
        self._console.print(text)
