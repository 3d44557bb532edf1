"""Kill a training run with SIGKILL at random moments, resume it each time, compare the end.

python benchmarks/kill_resume.py --kills 20 --seed 0 --folder kill_resume

The same settings are run once without interruption. Everything that is no wall time has to be
equal: weights, best weights, every row of metrics and evaluations, counters. Episodes are short, so
that kills also fall into resets, evaluations, checkpoints and the repetition of episodes.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import safetensors.torch
import torch as th
from circumstances import circumstances
from horf_cli.checkpoints import checkpoints
from horf_cli.metrics import read_evaluations, read_metrics
from horf_cli.runs import RunFolder

PROGRAM = "import horf_env.env; horf_env.env.MAX_STEPS = 40; from horf_cli.main import main; main()"
SETTINGS = {
    "algo": "bayes_dsac",
    "env.scene": "room",
    "batch_size": "32",
    "protocol.every": "60",
    "protocol.episodes": "1",
    "protocol.final_episodes": "2",
    "storage.checkpoint_every": "10",
}
WALL = ["wall_time", "planning_time", "total_time", "planning_p50", "planning_p99"]


def horf(*arguments: str) -> subprocess.Popen[bytes]:
    """Start `horf train` with short episodes."""
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "train", *arguments],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def begin(root: Path, steps: int) -> tuple[subprocess.Popen[bytes], Path, float]:
    """Start a run; returns it, its folder, and the seconds until its first checkpoint."""
    words = [word for key, value in SETTINGS.items() for word in ("-p", f"{key}={value}")]
    started = time.perf_counter()
    process = horf(*words, "--steps", str(steps), "--out", str(root))
    while not (found := list(root.glob("*/*/*/checkpoints/0*"))):
        time.sleep(0.01)
        assert process.poll() is None, "the run did not begin"
    return process, found[0].parent.parent, time.perf_counter() - started


def kill_and_resume(
    process: subprocess.Popen[bytes], run: Path, kills: int, seconds: float, rng: random.Random
) -> dict[str, object]:
    """Kill a run so many times: in turns while it works, and while it starts.

    Args:
        process: The run, at work.
        run: Its folder.
        kills: How many times.
        seconds: Work goes on so long at most after the first checkpoint of a session.
        rng: Draws the moments.
    """
    moments: list[dict[str, object]] = []
    session = time.perf_counter()
    while len(moments) < kills:
        working = len(moments) % 2 == 0
        if working and moments:
            _wait_for_checkpoint(process, run)
        # A start takes some seconds: imports, environments, the repeated episode.
        if _ends_within(process, rng.uniform(0.0, seconds if working else 10.0)):
            break  # finished before all kills
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        after = round(time.perf_counter() - session, 2)
        newest = checkpoints(run / "checkpoints")[0]
        moments.append({"after_s": after, "at_work": working, "checkpoint_at_step": newest.step})
        session, process = time.perf_counter(), horf("--resume", str(run), "--exact")
    return {"folder": str(run), "exit_code": process.wait(), "kills": moments}


def _wait_for_checkpoint(process: subprocess.Popen[bytes], run: Path) -> None:
    """Until this session has written one, or has ended."""
    before = checkpoints(run / "checkpoints")[0].number
    while process.poll() is None and checkpoints(run / "checkpoints")[0].number == before:
        time.sleep(0.01)


def _ends_within(process: subprocess.Popen[bytes], seconds: float) -> bool:
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        return False
    return True


def rows(table: pa.Table, names: list[str]) -> list[dict[str, Any]]:
    """Rows without wall times."""
    kept = [name for name in table.column_names if name not in names]
    counted: list[dict[str, Any]] = table.select(kept).to_pylist()
    return counted


def compare(a: Path, b: Path) -> dict[str, bool]:
    """What is equal in two runs."""
    metrics = [read_metrics(run) for run in (a, b)]
    counted = [t.filter(pc.invert(pc.starts_with(t["name"], "time/"))) for t in metrics]
    evaluations = [read_evaluations(run) for run in (a, b)]
    newest = [checkpoints(run / "checkpoints")[0] for run in (a, b)]
    found = {
        "metrics": rows(counted[0], WALL) == rows(counted[1], WALL),
        "evaluations": rows(evaluations[0], WALL) == rows(evaluations[1], WALL),
        "steps": len({RunFolder(run).read().steps_done for run in (a, b)}) == 1,
    }
    for name in ("policy.safetensors", "best.safetensors"):
        left, right = (safetensors.torch.load_file(point.verified(name)) for point in newest)
        found[name] = all(th.equal(left[key], right[key]) for key in left | right)
    return found


def main() -> None:
    """Run both, print JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--steps", type=int, default=400)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--folder", type=Path, required=True, help="new folder for both runs")
    arguments = parser.parse_args()
    arguments.folder.mkdir()
    started = time.perf_counter()
    process, straight, startup = begin(arguments.folder / "straight", arguments.steps)
    assert process.wait() == 0
    seconds = time.perf_counter() - started
    within = 2.0 * (seconds - startup) / arguments.kills  # so that the run outlives all kills
    process, run, _ = begin(arguments.folder / "killed", arguments.steps)
    rng = random.Random(arguments.seed)
    killed = kill_and_resume(process, run, arguments.kills, within, rng)
    table = read_metrics(run)
    report = {
        "settings": SETTINGS,
        "steps": arguments.steps,
        "seconds_to_first_checkpoint": round(startup, 1),
        "seconds_without_kills": round(seconds, 1),
        "killed": killed,
        "status": RunFolder(run).read().status,
        "rows": table.num_rows,
        "equal": compare(straight, run),
        **circumstances(),
    }
    print(json.dumps(report, indent=2))


if __name__ == "__main__":
    main()
