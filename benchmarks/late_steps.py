"""Cost of a gradient step late in training, beside the same step of a new model.

Weights that get no gradient any more leave Adam averages among the subnormal floats, where each
operation is slow; `FusedAdam` forgets them. SB3's SAC and Bayes-DSAC, with PyTorch's Adam and with
`FusedAdam`, learn Pendulum-v1, and then all take steps in turns: one thread, medians of processor
time and of paired ratios.

    python benchmarks/late_steps.py [--steps 1500] [--rounds 15] [--out FILE]
"""

from __future__ import annotations

import argparse
import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch as th
from circumstances import circumstances, write_json
from horf_cli.provenance import versions
from stable_baselines3 import SAC
from stable_baselines3.common.logger import configure
from update_speed import BATCH, milliseconds

from sb3_bayes_dsac import BayesDSAC

REPLAY_RATIO = 20
SEED = 0
NETS: dict[str, Any] = {"net_arch": [256, 256]}
RIVALS: dict[str, tuple[type[Any], dict[str, Any]]] = {
    "sac": (SAC, NETS),
    "bayes_dsac_pytorchs_adam": (BayesDSAC, NETS | {"optimizer_class": th.optim.Adam}),
    "bayes_dsac": (BayesDSAC, NETS),
}


def trained(cls: type[Any], policy_kwargs: dict[str, Any], steps: int) -> Any:
    """A model after so many steps of Pendulum-v1, the first hundred of them random."""
    model = cls(
        "MlpPolicy",
        "Pendulum-v1",
        policy_kwargs=policy_kwargs,
        batch_size=BATCH,
        buffer_size=10_000,
        gradient_steps=REPLAY_RATIO,
        seed=SEED,
        device="cpu",
    )
    model.set_logger(configure(None, []))
    return model.learn(steps)


def subnormal_share(model: Any) -> float:
    """Share of the averages of critics and actor that are subnormal."""
    states = (*model.critic.optimizer.state.values(), *model.actor.optimizer.state.values())
    averages = th.cat([s[key].flatten() for s in states for key in ("exp_avg", "exp_avg_sq")])
    small = averages.abs() < th.finfo(averages.dtype).smallest_normal
    return float((small & (averages != 0.0)).float().mean())


def measure(models: dict[str, Any], rounds: int) -> dict[str, np.ndarray[Any, Any]]:
    """Milliseconds of a gradient step of each model, one number a round."""
    times: dict[str, list[float]] = {name: [] for name in models}
    for _ in range(rounds):
        for name, model in models.items():
            work = partial(model.train, REPLAY_RATIO, BATCH)
            times[name].append(milliseconds(work, REPLAY_RATIO))
    return {name: np.array(row) for name, row in times.items()}


def compare(steps: int, rounds: int) -> dict[str, dict[str, float]]:
    """For each rival its late step, alone and against its first ones and SAC's late step."""
    models = {
        f"{name}_{age}": trained(*rival, n)
        for name, rival in RIVALS.items()
        for age, n in (("new", 110), ("late", steps))
    }
    shares = {name: subnormal_share(models[f"{name}_late"]) for name in RIVALS}
    times = measure(models, rounds)
    late = {name: times[f"{name}_late"] for name in RIVALS}
    return {
        name: {
            "late_ms": float(np.median(late[name])),
            "late_over_new": float(np.median(late[name] / times[f"{name}_new"])),
            "late_over_sac_late": float(np.median(late[name] / late["sac"])),
            "subnormal_share": shares[name],
        }
        for name in RIVALS
    }


def main() -> None:
    """Train, measure, and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=1_500)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/late_steps.json"))
    arguments = parser.parse_args()
    th.set_num_threads(1)
    result = {
        **circumstances(),
        "versions": versions(),
        "threads": th.get_num_threads(),
        "seed": SEED,
        "environment_steps": arguments.steps,
        "replay_ratio": REPLAY_RATIO,
        "rounds": arguments.rounds,
        "rivals": compare(arguments.steps, arguments.rounds),
    }
    write_json(result, arguments.out)
    print(json.dumps(result, indent=2))


if __name__ == "__main__":
    main()
