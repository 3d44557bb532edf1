"""Ctrl-C at a moment at which a checkpoint can be written."""

from __future__ import annotations

import signal
from types import FrameType, TracebackType
from typing import Self


class Interruption:
    """Inside of the `with` block, the first Ctrl-C waits until `check` is called.

    A second one does not wait. Works in the main thread, where Python delivers signals.
    """

    def __init__(self) -> None:
        self._requested = False

    def __enter__(self) -> Self:
        """Take the signal over."""
        self._previous = signal.signal(signal.SIGINT, self._remember)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Give the signal back."""
        signal.signal(signal.SIGINT, self._previous)

    def check(self, *_: object) -> None:
        """Raise what was held back; takes any arguments, so that it can be an observer.

        Raises:
            KeyboardInterrupt: If Ctrl-C was pressed.
        """
        if self._requested:
            raise KeyboardInterrupt

    def _remember(self, _signal: int, _frame: FrameType | None) -> None:
        if self._requested:
            raise KeyboardInterrupt
        self._requested = True
