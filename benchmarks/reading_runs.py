"""Time to read the metrics of many runs for a report: 100 runs of 100,000 steps.

python benchmarks/reading_runs.py --out benchmarks/results/reading_runs.json

The runs are made up, with as many parts and rows as such a run has: a part at each of its 100
checkpoints, 25 rows in each, and an evaluation of two episodes every 6000 steps. The rival reads
the same files with pyarrow's `read_table`.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import pyarrow.parquet as pq
from circumstances import circumstances, write_json
from horf_cli.config import TrainConfig
from horf_cli.metrics import EVALUATIONS, METRICS, PartWriter
from horf_cli.run_results import read_run
from horf_cli.runs import Manifest, RunFolder

_STEPS, _CHECKPOINT, _EVALUATION = 100_000, 1000, 6000
_ROWS = 25
_EPISODE = {
    "protocol": "paper",
    "episode": 0,
    "instance": 0,
    "return": -1.0,
    "length": 1000,
    "success": False,
    "failure": "timeout",
}


def make_run(root: Path, seed: int) -> Path:
    """A finished run with made-up numbers."""
    config = TrainConfig(seed=seed, steps=_STEPS)
    run = RunFolder.create(root, config)
    run.write(Manifest.of(config))
    metrics = PartWriter(run.path / METRICS)
    for step in range(_CHECKPOINT, _STEPS + 1, _CHECKPOINT):
        place = {"step": step, "wall_time": 0.02 * step}
        metrics.add([{**place, "name": f"train/{k}", "value": float(k)} for k in range(_ROWS)])
        metrics.flush()
    evaluations = PartWriter(run.path / EVALUATIONS)
    for step in range(_EVALUATION, _STEPS, _EVALUATION):
        evaluations.add([{"step": step, "wall_time": 0.02 * step, **_EPISODE}] * 2)
        evaluations.flush()
    run.finish("finished", _STEPS)
    return run.path


def read_tables(run: Path) -> None:
    """The rival: each part with `read_table`."""
    for folder in (METRICS, EVALUATIONS):
        for part in (run / folder).iterdir():
            pq.read_table(part)


def seconds(read: Callable[[Path], object], runs: list[Path]) -> float:
    """Processor time to read all runs [s]."""
    begin = time.process_time()
    for run in runs:
        read(run)
    return time.process_time() - begin


def main() -> None:
    """Measure both, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        runs = [make_run(Path(folder), seed) for seed in range(arguments.runs)]
        ours, rival = seconds(read_run, runs), seconds(read_tables, runs)
    result = {"runs": arguments.runs, "seconds": ours, "read_table_seconds": rival}
    write_json({**result, "ratio": ours / rival, **circumstances()}, arguments.out)
    print(f"{arguments.runs} runs: {ours:.1f} s, {ours / rival:.2f} of read_table's time")


if __name__ == "__main__":
    main()
