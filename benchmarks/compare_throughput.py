"""Throughput of `horf compare` with several workers against one: the same runs, both ways.

python benchmarks/compare_throughput.py --out benchmarks/results/compare_throughput.json

On a machine with nothing else to do; the aim for two cores is 1.7.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from circumstances import circumstances, write_json
from horf_cli.backends.local import LocalBackend
from horf_cli.comparison import plan, run_jobs
from horf_cli.config import Protocol, TrainConfig
from horf_cli.environments import EnvSettings


def seconds(workers: int, seeds: int, steps: int) -> float:
    """Wall time of SAC runs in the room, one a seed, by so many workers."""
    config = TrainConfig(
        steps=steps,
        env=EnvSettings(scene="room"),
        protocol=Protocol(every=steps, episodes=1, final_episodes=1),
    )
    with tempfile.TemporaryDirectory() as folder:
        jobs = plan(config, algos=["sac"], ratios=[None], seeds=range(seeds), root=Path(folder))
        begin = time.perf_counter()
        states = run_jobs(jobs, LocalBackend(workers), lambda _: None)
        elapsed = time.perf_counter() - begin
    if failed := [state.error for state in states if state.error]:
        raise SystemExit(f"runs failed: {failed}")
    return elapsed


def main() -> None:
    """Measure one worker and several, alternating."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--repetitions", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    times: dict[int, list[float]] = {1: [], arguments.workers: []}
    for _ in range(arguments.repetitions):
        for workers, found in times.items():
            found.append(seconds(workers, arguments.seeds, arguments.steps))
    result = {
        "steps": arguments.steps,
        "seeds": arguments.seeds,
        "seconds": times,
        "speedup": min(times[1]) / min(times[arguments.workers]),
        **circumstances(),
    }
    write_json(result, arguments.out)
    print(f"{arguments.workers} workers: {result['speedup']:.2f} times the throughput of one")


# Worker processes import this file again.
if __name__ == "__main__":
    main()
