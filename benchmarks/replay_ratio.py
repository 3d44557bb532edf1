"""What many gradient steps per environment step do to Bayes-DSAC, DSAC-T and REDQ.

    python benchmarks/replay_ratio.py [--only rr20] [--budget-minutes 60]

Replay ratios 1, 5 and 20, with and without layer norm, on Pendulum-v1 with small nets. One file a
run under benchmarks/results/replay_ratio/, as in `benchmarks/learning.py`.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from pathlib import Path

from study.queue import main
from study.runs import Run, Task

FOLDER = Path(__file__).parent / "results" / "replay_ratio"

TASK = Task("pendulum", "Pendulum-v1", steps=5_000, evaluate_every=500, episodes=10, bias_steps=500)
ALGORITHMS = ("bayes_dsac", "dsac_t", "redq")
REPLAY_RATIOS = (1, 5, 20)
LAYER_NORM = (False, True)
SEEDS = 3
# Small, so that the whole study is a matter of hours on one core.
NET = [64, 64]


def runs() -> Iterator[Run]:
    """Each seed of everything before the next seed, so that a part is a fair part."""
    for seed, ratio, layer_norm, algorithm in product(
        range(SEEDS), REPLAY_RATIOS, LAYER_NORM, ALGORITHMS
    ):
        variant = f"rr{ratio}{'-ln' if layer_norm else ''}"
        yield Run(TASK, algorithm, seed, variant, arguments(algorithm, ratio, layer_norm))


def arguments(algorithm: str, ratio: int, layer_norm: bool) -> dict[str, object]:
    """What differs from the hyperparameters of the zoo."""
    return {
        "gradient_steps": ratio,
        "policy_kwargs": {"net_arch": NET, "layer_norm": layer_norm},
    }


if __name__ == "__main__":
    main(__doc__, runs(), FOLDER)
