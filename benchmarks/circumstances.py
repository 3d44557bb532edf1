"""What every result of a benchmark says about itself, and how it is written."""

from __future__ import annotations

import datetime
import json
from pathlib import Path
from typing import Any

from horf_cli.provenance import git_revision, machine, versions


def circumstances() -> dict[str, Any]:
    """Date, machine, versions and revision of the code."""
    return {
        "date": datetime.date.today().isoformat(),
        "machine": machine(),
        "versions": versions(),
        "revision": git_revision(),
    }


def write_json(result: dict[str, Any], path: Path) -> None:
    """Write a result; its folder is made.

    Raises:
        OSError: If it cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(result, indent=2) + "\n")
