"""Jobs as Ray tasks: on this machine, or on a cluster whose nodes share the output folder."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from ..exit_codes import CliError
from .backend import ATTEMPTS, Job, Outcome, Result, one_line

_CONNECT_TIME = 5.0  # s


class RayBackend:
    """See `Backend`. The cluster decides how many jobs run at a time: one a CPU."""

    def __init__(self, workers: int, address: str | None) -> None:
        """Make it.

        Args:
            workers: CPUs of a cluster on this machine.
            address: Of a cluster that runs already; None to start one that ends with the jobs.
        """
        self._workers, self._address = workers, address

    def run(
        self, function: Callable[[Job], Result], jobs: Sequence[Job]
    ) -> Generator[Outcome[Result], None, None]:
        """See `Backend`.

        Raises:
            CliError: If Ray is not installed, or there is no cluster at the address.
        """
        with self._cluster() as ray:
            task = ray.remote(num_cpus=1, max_retries=ATTEMPTS - 1, retry_exceptions=True)(function)
            running = {task.remote(job): index for index, job in enumerate(jobs)}
            try:
                while running:
                    (ready,), _ = ray.wait(list(running))
                    yield _outcome(ray, ready, running.pop(ready))
            finally:
                for reference in running:
                    ray.cancel(reference, force=True)

    @contextmanager
    def _cluster(self) -> Iterator[Any]:
        options: dict[str, Any] = {"address": self._address}
        _check_reachable(self._address)
        # Ray reads its environment when it is imported. It would tell its makers that it is used.
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        if self._address is None:
            # Ray's way for laptops that it calls after macOS: listen on 127.0.0.1 only.
            os.environ.setdefault("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")
            options = {"address": "local", "num_cpus": self._workers, "include_dashboard": False}
        try:
            import ray

            ray.init(log_to_driver=False, logging_level="error", **options)
        except ImportError as error:
            raise CliError('no Ray here: pip install "horf[ray]"') from error
        except ConnectionError as error:
            raise CliError(f"no Ray cluster at {self._address}: {one_line(error)}") from error
        try:
            yield ray
        finally:
            ray.shutdown()


def _check_reachable(address: str | None) -> None:
    """Look first: Ray tries for minutes to reach a cluster that is not there."""
    host, _, port = (address or "").rpartition(":")
    if host and port.isdigit() and "/" not in host:
        try:
            socket.create_connection((host, int(port)), timeout=_CONNECT_TIME).close()
        except OSError as error:
            raise CliError(f"no Ray cluster at {address}: {one_line(error)}") from error


def _outcome(ray: Any, reference: Any, index: int) -> Outcome[Any]:
    try:
        return Outcome(index, ray.get(reference))
    except ray.exceptions.RayError as error:
        cause = getattr(error, "cause", None)
        return Outcome(index, error=one_line(cause or error))
