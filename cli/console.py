"""Where text goes: results to stdout, everything else to stderr."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console

_FILE_WIDTH = 160  # characters; tables in files and pipes are not squeezed into 80


def results() -> Console:
    """For results; made anew each time, so that it follows a redirected stdout."""
    console = Console(highlight=False, soft_wrap=True)
    return console if console.is_terminal else Console(highlight=False, width=_FILE_WIDTH)


def notes() -> Console:
    """For progress and logs; on stderr."""
    return Console(stderr=True, highlight=False, soft_wrap=True)


def print_json(data: Mapping[str, Any] | Sequence[Any]) -> None:
    """Write data to stdout as JSON."""
    print(json.dumps(data, indent=2, allow_nan=False))
