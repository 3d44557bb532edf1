"""The Rerun program: showing recordings."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from .exit_codes import CliError

_HOST = "127.0.0.1"
_START_TIME = 30.0  # s in which the web viewer has to answer
_POLL = 0.1  # s
_HEADLESS = ("--headless", "--window-size", "1280x720")


def rerun_program() -> Path:
    """The `rerun` program of this Python's environment, also where that is not activated.

    Raises:
        CliError: If it is not installed.
    """
    program = Path(sys.executable).with_name("rerun")
    if not program.exists():
        raise CliError(f"no {program}: run `pip install rerun-sdk`")
    return program


def has_display() -> bool:
    """Whether a window can be opened."""
    return sys.platform == "darwin" or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    )


def show_window(paths: Sequence[Path]) -> None:
    """Open the native viewer, until its window is closed; several recordings share it.

    Raises:
        CliError: If it ends with an error.
    """
    done = subprocess.run([rerun_program(), *paths], env=_quiet(), check=False)
    if done.returncode != 0:
        raise CliError(f"the viewer ended with code {done.returncode}; try --web")


@dataclass(frozen=True)
class WebViewer:
    """A running server.

    Attributes:
        url: What to open in a browser.
        ports: Ports of the viewer and of its data, both on 127.0.0.1.
        process: The server.
    """

    url: str
    ports: tuple[int, int]
    process: subprocess.Popen[bytes]


@contextmanager
def web_viewer(paths: Sequence[Path]) -> Iterator[WebViewer]:
    """Serve recordings to browsers of this machine only.

    Rerun would listen on all interfaces by itself.

    Yields:
        The server, which ends with the `with` block.

    Raises:
        CliError: If the server does not start.
    """
    web, data = _free_port(), _free_port()
    options = ["--bind", _HOST, "--web-viewer-port", str(web), "--port", str(data)]
    with _server([*map(str, paths), "--serve-web", *options], web) as server:
        source = quote(f"rerun+http://{_HOST}:{data}/proxy", safe="")
        yield WebViewer(f"http://{_HOST}:{web}?url={source}", (web, data), server)


@contextmanager
def headless_viewer() -> Iterator[str]:
    """A viewer without a window, for this machine only.

    Yields:
        Where it can be told what to draw; it ends with the `with` block.

    Raises:
        CliError: If it does not start.
    """
    port = _free_port()
    with _server([*_HEADLESS, "--bind", _HOST, "--port", str(port)], port):
        yield f"rerun+http://{_HOST}:{port}/proxy"


@contextmanager
def _server(arguments: Sequence[str], port: int) -> Iterator[subprocess.Popen[bytes]]:
    with _unwound_by_sigterm():
        # A group of its own: the program is a script that starts the server as a child.
        server = subprocess.Popen(
            [str(rerun_program()), *arguments], env=_quiet(), start_new_session=True
        )
        try:
            _wait_for(server, port)
            yield server
        finally:
            with suppress(ProcessLookupError):
                os.killpg(server.pid, signal.SIGTERM)
            server.wait()


@contextmanager
def _unwound_by_sigterm() -> Iterator[None]:
    """Let SIGTERM end the `with` block as Ctrl-C does: by itself Python leaves children behind."""
    before = signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _wait_for(server: subprocess.Popen[bytes], port: int) -> None:
    end = time.monotonic() + _START_TIME
    while time.monotonic() < end and server.poll() is None:
        try:
            socket.create_connection((_HOST, port), timeout=_POLL).close()
        except OSError:
            time.sleep(_POLL)
        else:
            return
    raise CliError(f"the viewer did not start on {_HOST}:{port}")


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind((_HOST, 0))
        port: int = probe.getsockname()[1]
        return port


def _quiet() -> dict[str, str]:
    """Environment in which Rerun tells errors only."""
    return {"RUST_LOG": "error", **os.environ}
