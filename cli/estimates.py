"""How long training runs will take on this machine, from measured speed."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import pyarrow.compute as pc

from .comparison import TrainJob
from .config import Protocol, TrainConfig
from .exit_codes import CliError
from .metrics import read_metrics
from .runs import RunFolder
from .training import train

_PROBE_STEPS = 200
_LEARNING_SHARE = 0.8  # of a short run's steps: the first fifth is warm-up


def seconds_per_step(
    jobs: Sequence[TrainJob], note: Callable[[str], None]
) -> dict[TrainJob, float]:
    """Seconds a step of each job, evaluations included.

    Taken from an earlier run of the same kind under the same root; where there is none, a run of
    200 steps is made and thrown away.

    Args:
        jobs: The jobs.
        note: Told what is measured now.
    """
    speeds: dict[str, float] = {}
    for job in jobs:
        kind = _kind(job.config)
        if kind not in speeds:
            speeds[kind] = _earlier(job) or _probe(job, note)
    return {job: speeds[_kind(job.config)] for job in jobs}


def _kind(config: TrainConfig) -> str:
    """What runs of the same speed share: all but length, seed and evaluations."""
    same = {"steps": 1, "seed": 0, "protocol": Protocol()}
    return config.model_copy(update=same).content_hash()


def _earlier(job: TrainJob) -> float | None:
    """From the earlier run of this kind that came farthest."""
    folder = job.root / job.config.env.scene_name / job.config.algo
    best_step, speed = 0, None
    for path in folder.glob("seed*/manifest.json"):
        try:
            config = RunFolder(path.parent).read().config
        except CliError:
            continue
        metrics = read_metrics(path.parent)
        if metrics.num_rows and _kind(config) == _kind(job.config):
            step = pc.max(metrics["step"]).as_py()
            if step > max(best_step, _PROBE_STEPS):
                best_step, speed = step, pc.max(metrics["wall_time"]).as_py() / step
    return speed


def _probe(job: TrainJob, note: Callable[[str], None]) -> float:
    note(f"measuring {job.config.algo}: {_PROBE_STEPS} steps")
    wanted = job.config
    protocol = Protocol(every=_PROBE_STEPS, episodes=1, final_episodes=1)
    config = wanted.model_copy(update={"steps": _PROBE_STEPS, "protocol": protocol})
    with tempfile.TemporaryDirectory() as folder:
        train(config, Path(folder, "probe"))
        rows = read_metrics(Path(folder, "probe")).to_pylist()
    times = {row["name"]: row["value"] for row in rows if row["name"].startswith("time/")}
    learning = (times["time/environment"] + times["time/update"] / _LEARNING_SHARE) / _PROBE_STEPS
    evaluations = wanted.protocol.episodes * (wanted.steps // wanted.protocol.every)
    episodes = evaluations + wanted.protocol.final_episodes
    return float(learning + times["time/evaluation"] * episodes / wanted.steps)
