"""Where a result comes from: versions, machine, revision."""

from __future__ import annotations

import os
import platform
import re
import subprocess
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from packaging.requirements import Requirement

_DISTRIBUTION = "horf"
_CPU_INFO = Path("/proc/cpuinfo")
_GIT_TIMEOUT = 10.0  # s


def requirements() -> list[Requirement]:
    """What this package needs at run time, without extras."""
    found = [Requirement(text) for text in requires(_DISTRIBUTION) or []]
    return [r for r in found if r.marker is None or r.marker.evaluate({"extra": ""})]


def versions() -> dict[str, str]:
    """Version of Python, of this package and of all that it needs; "missing" if not installed."""
    names = [_DISTRIBUTION, *(requirement.name for requirement in requirements())]
    return {"python": platform.python_version(), **{name: _version(name) for name in names}}


def git_revision() -> str | None:
    """Commit of the code, with "+" if files differ from it; None outside of a git tree."""
    commit = _git("rev-parse", "HEAD")
    if commit is None:
        return None
    return f"{commit}+" if _git("status", "--porcelain", "--untracked-files=no") else commit


def machine() -> dict[str, str | int]:
    """Processor, cores and system."""
    return {"cpu": _cpu(), "cores": os.cpu_count() or 1, "platform": platform.platform()}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "missing"


def _git(*arguments: str) -> str | None:
    command = ["git", "-C", str(Path(__file__).resolve().parent), *arguments]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, check=True, timeout=_GIT_TIMEOUT
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()


def _cpu() -> str:
    try:
        found = re.search(r"model name\s*:\s*(.+)", _CPU_INFO.read_text())
    except OSError:
        found = None
    return found.group(1) if found else platform.processor() or platform.machine()
