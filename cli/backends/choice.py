"""Backends by name."""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType

from horf_env.errors import UnknownNameError

from .backend import Backend
from .local import LocalBackend
from .ray_tasks import RayBackend
from .serial import SerialBackend

BACKENDS: MappingProxyType[str, Callable[[int, str | None], Backend]] = MappingProxyType(
    {
        "local": lambda workers, _: LocalBackend(workers) if workers > 1 else SerialBackend(),
        "ray": lambda workers, address: RayBackend(workers, address),
    }
)


def make_backend(name: str, *, workers: int, address: str | None = None) -> Backend:
    """The backend of that name.

    Args:
        name: "local" or "ray".
        workers: Jobs at a time; a Ray cluster that runs already decides this itself.
        address: Of a Ray cluster that runs already; None for one on this machine.

    Raises:
        UnknownNameError: If there is none of that name.
    """
    if name not in BACKENDS:
        raise UnknownNameError("backend", name, BACKENDS)
    return BACKENDS[name](workers, address)
