"""Whether Bayes-DSAC learns as well with matrix products in bfloat16, on processors that have them.

    python benchmarks/low_precision.py [--only medium] [--budget-minutes 60]

Pendulum-v1 with nets of 2 x 256, where the products are most of a gradient step. "medium" is what
`torch.set_float32_matmul_precision` calls it: weights and sums stay in float32, factors do not.
One file a run under benchmarks/results/low_precision/, as in `benchmarks/learning.py`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import torch as th
from study.queue import main
from study.runs import Run, Task

FOLDER = Path(__file__).parent / "results" / "low_precision"

TASK = Task("pendulum", "Pendulum-v1", steps=5_000, evaluate_every=500, episodes=10, bias_steps=500)
PRECISIONS = ("highest", "medium")
SEEDS = 5
ARGUMENTS = {"policy_kwargs": {"net_arch": [256, 256]}}


def runs() -> Iterator[Run]:
    """Both precisions of a seed before the next one; each is set when its run is asked for."""
    for seed in range(SEEDS):
        for precision in PRECISIONS:
            th.set_float32_matmul_precision(precision)
            yield Run(TASK, "bayes_dsac", seed, precision, ARGUMENTS)


if __name__ == "__main__":
    main(__doc__, runs(), FOLDER)
