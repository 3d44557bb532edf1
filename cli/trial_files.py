"""Trials as a file: one row a trial, CSV or Parquet by the file's suffix."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import pyarrow
import pyarrow.csv
import pyarrow.parquet

from horf_env.errors import UnknownNameError

from .episodes import Trial

_WRITERS = {".csv": pyarrow.csv.write_csv, ".parquet": pyarrow.parquet.write_table}


def check_target(path: Path) -> None:
    """Refuse a file that could not be written later, before hours of work.

    Raises:
        UnknownNameError: If its suffix is not known.
        FileExistsError: If it exists.
        FileNotFoundError: If its folder does not.
    """
    if path.suffix not in _WRITERS:
        raise UnknownNameError("file type", path.suffix, _WRITERS)
    if path.exists():
        raise FileExistsError(f"{path} exists: give another name")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"no folder {path.parent}")


def write_trials(path: Path, trials: Sequence[Trial]) -> None:
    """Write a new file.

    Raises:
        OSError: If it cannot be written.
    """
    table = pyarrow.Table.from_pylist([asdict(trial) for trial in trials])
    unfinished = path.with_name(f".{path.name}.part")
    _WRITERS[path.suffix](table, unfinished)
    os.replace(unfinished, path)
