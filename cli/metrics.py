"""Metrics of a run as Parquet: written part by part, readable while the run goes on.

A part is a file that appears complete or not at all. Numbers of parts only grow, and a checkpoint
knows how many there were: what a killed run wrote after its last checkpoint can be taken back.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from .atomic_files import write_atomically

METRICS = "metrics"
EVALUATIONS = "evaluations"
_METRICS_SCHEMA = pa.schema(
    [
        ("step", pa.int64()),
        ("wall_time", pa.float64()),
        ("name", pa.string()),
        ("value", pa.float64()),
    ]
)
_EVALUATIONS_SCHEMA = pa.schema(
    [
        ("step", pa.int64()),
        ("wall_time", pa.float64()),
        ("protocol", pa.string()),
        ("episode", pa.int64()),
        ("instance", pa.int64()),
        ("return", pa.float64()),
        ("length", pa.int64()),
        ("success", pa.bool_()),
        ("failure", pa.string()),
    ]
)
_SCHEMAS = {METRICS: _METRICS_SCHEMA, EVALUATIONS: _EVALUATIONS_SCHEMA}


class DamagedFileWarning(UserWarning):
    """A file that cannot be read was left out."""


class PartWriter:
    """Collects rows and writes them as numbered parts.

    Args:
        folder: Folder of the parts; made if needed.
        parts: How many count; later ones are deleted.
    """

    def __init__(self, folder: Path, parts: int = 0) -> None:
        self._folder, self.parts, self._rows = folder, parts, list[dict[str, Any]]()
        folder.mkdir(exist_ok=True)
        for path in _parts(folder):
            if _number(path) > parts:
                path.unlink()

    def add(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Keep rows for the next part."""
        self._rows.extend(dict(row) for row in rows)

    def discard(self) -> None:
        """Forget the rows that are in no part yet."""
        self._rows.clear()

    def flush(self) -> None:
        """Write a part, if there are rows.

        Raises:
            StorageError: If it cannot be written; the rows stay for another attempt.
        """
        if not self._rows:
            return
        path = self._folder / f"part-{self.parts + 1:06d}.parquet"
        table = _table(self._rows, _SCHEMAS[self._folder.name])
        write_atomically(path, lambda file: pq.write_table(table, file))
        self.parts += 1
        self.discard()


def read_metrics(run: Path) -> pa.Table:
    """Metrics of a run in long form.

    Args:
        run: Folder of the run, which may be going on or have been killed.

    Returns:
        Columns step (environment steps), wall_time [s of training over all resumes], name
        ("rollout/success_rate", "train/critic_loss", ...) and value. A part that cannot be read is
        left out with a `DamagedFileWarning`.
    """
    return _read(run, METRICS)


def read_evaluations(run: Path) -> pa.Table:
    """Evaluation episodes of a run, one row each.

    Args:
        run: Folder of the run, which may be going on or have been killed.

    Returns:
        Columns step, wall_time [s], protocol ("paper" while it learns, "validation" at the end),
        episode (number within its evaluation), instance, return, length [steps], success, failure,
        and what else `Trial` holds. Damaged parts are left out with a `DamagedFileWarning`.
    """
    return _read(run, EVALUATIONS)


def _read(run: Path, name: str) -> pa.Table:
    tables = [_SCHEMAS[name].empty_table()]
    for path in _parts(run / name):
        try:
            # Half the time of read_table, which looks for a data set first; threads cost more than
            # such a small file.
            with pq.ParquetFile(path, pre_buffer=False) as file:
                tables.append(file.read(use_threads=False))
        except (OSError, pa.ArrowInvalid) as error:
            warnings.warn(f"{path}: damaged, left out ({error})", DamagedFileWarning, stacklevel=3)
    return pa.concat_tables(tables, promote_options="permissive")


def _table(rows: Sequence[dict[str, Any]], schema: pa.Schema) -> pa.Table:
    """Rows as a table; columns that the schema does not name are of the type of their values."""
    table = pa.Table.from_pylist(rows)
    for index, field in enumerate(table.schema):
        if field.name in schema.names:
            wanted = schema.field(field.name)
            table = table.set_column(index, wanted, table.column(index).cast(wanted.type))
    return table


def _parts(folder: Path) -> list[Path]:
    return sorted(folder.glob("part-*.parquet"))


def _number(path: Path) -> int:
    return int(path.stem.removeprefix("part-"))
