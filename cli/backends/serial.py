"""Jobs one after the other in this process: what one local worker does."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence

from .backend import ATTEMPTS, Job, Outcome, Result, one_line


class SerialBackend:
    """See `Backend`."""

    def run(
        self, function: Callable[[Job], Result], jobs: Sequence[Job]
    ) -> Generator[Outcome[Result], None, None]:
        """See `Backend`."""
        for index, job in enumerate(jobs):
            outcome: Outcome[Result] = _attempt(function, job, index)
            for _ in range(ATTEMPTS - 1):
                if outcome.error:
                    outcome = _attempt(function, job, index)
            yield outcome


def _attempt(function: Callable[[Job], Result], job: Job, index: int) -> Outcome[Result]:
    try:
        return Outcome(index, function(job))
    except Exception as error:  # of any kind: it is the job's result, and the others go on
        return Outcome(index, error=one_line(error))
