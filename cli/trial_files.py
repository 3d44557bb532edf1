"""Trials as Parquet files: one row a trial."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import pyarrow
import pyarrow.parquet

from .console import notes
from .episodes import Trial


def write_trials(path: Path, trials: Sequence[Trial]) -> None:
    """Write a file; under its name there is a complete one at any time.

    Raises:
        OSError: If it cannot be written.
    """
    table = pyarrow.Table.from_pylist([asdict(trial) for trial in trials])
    unfinished = path.with_name(f".{path.name}.part")
    pyarrow.parquet.write_table(table, unfinished)
    os.replace(unfinished, path)


def read_trials(path: Path) -> list[Trial] | None:
    """Trials of a file; None if there is none, or if it is damaged, which is told on stderr."""
    if not path.exists():
        return None
    try:
        return [Trial(**row) for row in pyarrow.parquet.read_table(path).to_pylist()]
    except (pyarrow.ArrowException, OSError, TypeError) as error:
        notes().print(f"{path} is damaged, its trials are run again ({error})", markup=False)
        return None
