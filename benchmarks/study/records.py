"""Records of runs: one parquet file a run, written at once when the run is over."""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from .runs import Run

# Mean over the last call of train() of what the algorithm logs; null if it does not log it.
DIAGNOSTICS = ("q_mean", "q_gap", "sigma_mean", "sigma_fused", "clipped_share", "ent_coef")

SCHEMA = pa.schema(
    [
        ("task", pa.string()),
        ("algorithm", pa.string()),
        ("variant", pa.string()),
        ("seed", pa.int64()),
        ("step", pa.int64()),  # environment steps so far
        ("returns", pa.list_(pa.float64())),  # of the evaluation's episodes, not discounted
        ("q_bias", pa.float64()),  # predicted minus observed discounted soft return, mean
        ("q_bias_std", pa.float64()),  # its deviation over state-action pairs
        ("soft_return", pa.float64()),  # mean of the observed one
        ("wall_s", pa.float64()),  # of learning, evaluation not counted
        ("cpu_s", pa.float64()),
        *((name, pa.float64()) for name in DIAGNOSTICS),
    ]
)


def path_of(folder: Path, run: Run) -> Path:
    """File of a run."""
    return folder / f"{run.name}.parquet"


def write(folder: Path, run: Run, rows: list[dict[str, Any]], provenance: dict[str, Any]) -> None:
    """Store a run; under its name there is a complete file or none.

    Args:
        folder: Where the records of the study are.
        run: The run.
        rows: One dictionary an evaluation, with the columns of `SCHEMA` that are not the run's.
        provenance: How the run ended, machine, versions, revision; goes into the file's metadata.

    Raises:
        OSError: If it cannot be written.
    """
    keys = {
        "task": run.task.name,
        "algorithm": run.algorithm,
        "variant": run.variant,
        "seed": run.seed,
    }
    table = pa.Table.from_pylist([keys | row for row in rows], SCHEMA)
    metadata = {"run": json.dumps({**asdict(run), **provenance}, default=str)}
    path = path_of(folder, run)
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.part")
    pq.write_table(table.replace_schema_metadata(metadata), unfinished)
    os.replace(unfinished, path)


def read(folder: Path) -> list[tuple[dict[str, Any], list[dict[str, Any]]]]:
    """All runs of a study: what is known of each, and its rows in the order of steps."""
    files = sorted(folder.glob("*.parquet"))
    tables = [pq.read_table(file) for file in files]
    return [(json.loads(t.schema.metadata[b"run"]), t.to_pylist()) for t in tables]
