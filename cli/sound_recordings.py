"""Recordings that can be shown: found, verified, repaired if a process was killed meanwhile."""

from __future__ import annotations

import subprocess
import warnings
from collections.abc import Callable
from pathlib import Path

from .exit_codes import CliError
from .viewer import rerun_program

Note = Callable[[str], object]


def sound_recording(path: Path, scratch: Path, note: Note) -> Path:
    """The recording itself, or the newest sound one in a folder.

    Args:
        path: A file, or a folder such as that of a run.
        scratch: Folder for a repaired copy.
        note: Told what was repaired or left out.

    Raises:
        CliError: If there is none.
    """
    if path.is_file():
        return _sound(path, scratch, note)
    if not path.is_dir():
        raise CliError(f"{path}: no such file")
    newest_first = sorted(path.rglob("*.rrd"), key=lambda f: (f.stat().st_mtime, f.name))[::-1]
    for file in newest_first:
        try:
            return _sound(file, scratch, note)
        except CliError as error:
            note(f"{error}: the one before is used")
    raise CliError(f"{path}: no {'sound ' if newest_first else ''}recording (*.rrd) in there")


def _sound(path: Path, scratch: Path, note: Note) -> Path:
    reason = _verify(path)
    if reason is None:
        return path
    repaired = scratch / f"repaired-{len(list(scratch.iterdir()))}-{path.name}"
    _run("optimize", path, "-o", repaired)
    if not repaired.exists() or not _has_data(repaired) or _verify(repaired) is not None:
        raise CliError(reason if str(path) in reason else f"{path}: {reason}")
    note(f"{path}: incomplete, a repaired copy is shown; its end may be missing")
    return repaired


def _verify(path: Path) -> str | None:
    """What is wrong with a file, or None."""
    done = _run("verify", path)
    if done.returncode == 0:
        return None
    return next(iter(done.stderr.strip().splitlines()), "not a complete recording")


def _has_data(path: Path) -> bool:
    """Whether there is anything in a recording: what is none is "repaired" to an empty one."""
    from rerun.chunk import RrdReader

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return next(iter(RrdReader(path).stream()), None) is not None
        except (RuntimeError, ValueError):
            return False


def _run(command: str, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [rerun_program(), "rrd", command, *arguments], capture_output=True, text=True, check=False
    )
