"""Learning curves of Bayes-DSAC and its rivals on tasks without a robot.

    python benchmarks/learning.py [--only pendulum] [--budget-minutes 60]

One file a run under benchmarks/results/learning/; a run that has its file is not done again, so the
study may be stopped at any time. `benchmarks/learning_table.py` prints what came out.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from study.queue import main
from study.runs import Run, Task

FOLDER = Path(__file__).parent / "results" / "learning"

PENDULUM = Task(
    "pendulum", "Pendulum-v1", steps=10_000, evaluate_every=1_000, episodes=10, bias_steps=500
)
MUJOCO = tuple(
    Task(name, env_id, steps=100_000, evaluate_every=10_000, episodes=5, bias_steps=1_000)
    for name, env_id in (("halfcheetah", "HalfCheetah-v5"), ("hopper", "Hopper-v5"))
)
PENDULUM_SEEDS = 5
MUJOCO_SEEDS = 3


def runs() -> Iterator[Run]:
    """Each seed of all algorithms before the next seed, so that a part is a fair part."""
    for seed in range(PENDULUM_SEEDS):
        for algorithm in ("bayes_dsac", "dsac_t", "sac", "td3", "tqc", "ppo"):
            yield Run(PENDULUM, algorithm, seed)
    # REDQ takes twenty gradient steps where the others take one.
    for seed in range(PENDULUM_SEEDS):
        yield Run(PENDULUM, "redq", seed)
    for seed in range(MUJOCO_SEEDS):
        for task in MUJOCO:
            for algorithm in ("bayes_dsac", "dsac_t", "sac", "tqc"):
                yield Run(task, algorithm, seed)


if __name__ == "__main__":
    main(__doc__, runs(), FOLDER)
