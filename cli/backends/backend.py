"""What every backend does: it runs a function for many jobs and says what came of each."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

Job = TypeVar("Job")
Result = TypeVar("Result")

ATTEMPTS = 2
"""How often a job is tried at most: once again after an error or the death of its worker."""


@dataclass(frozen=True)
class Outcome(Generic[Result]):
    """What came of a job.

    Attributes:
        index: Place of the job in the list that was given.
        result: What the function returned; None if the job failed.
        error: Why its last attempt failed, in one line; "" if it did not.
    """

    index: int
    result: Result | None = None
    error: str = ""


class Backend(Protocol):
    """Runs jobs, in any order."""

    def run(
        self, function: Callable[[Job], Result], jobs: Sequence[Job]
    ) -> Generator[Outcome[Result], None, None]:
        """Run a function for each job, and yield outcomes as they come.

        A job whose function raises, or whose worker dies, is tried `ATTEMPTS` times in all. When
        the generator is closed, as by Ctrl-C, what runs is interrupted and waited for.

        Args:
            function: Of a module, so that other processes can import it.
            jobs: Arguments that can be pickled.
        """


def one_line(error: BaseException) -> str:
    """Kind and text of an error without line breaks."""
    return " ".join(f"{type(error).__name__}: {error}".split())
