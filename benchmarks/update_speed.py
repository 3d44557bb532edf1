"""Cost of one gradient step beside SB3's SAC and other peers: one thread, one process, alternating.

Medians of processor time and the medians of paired ratios count, not the absolute times. The floor
is the arithmetic of our step over the measured rate of a matrix product of its shape. Peers that
are not installed are skipped with a note: SBX (`pip install sbx-rl`) and the fork of SB3 by the
authors of DSAC.

    python benchmarks/update_speed.py [--rounds 15] [--precision medium] [--compile] [--out FILE]
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch as th
from circumstances import circumstances, write_json
from gymnasium import spaces
from horf_cli.provenance import versions
from stable_baselines3.common.logger import configure
from torch.utils.flop_counter import FlopCounterMode

from sb3_bayes_dsac.common.encoders import DepthEncoder

# SBX runs on XLA, which is told to use one thread before it starts.
os.environ.setdefault(
    "XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
)
os.environ.setdefault("JAX_PLATFORMS", "cpu")
BATCH = 256
SEED = 0
# Name -> class of each rival; those that are not installed are skipped with a note.
RIVALS = {
    "sac": "stable_baselines3:SAC",
    "bayes_dsac": "sb3_bayes_dsac:BayesDSAC",
    "dsac_t": "sb3_bayes_dsac:DSACT",
    "redq": "sb3_bayes_dsac:REDQ",
    "tqc": "sb3_contrib:TQC",
    "sbx_sac": "sbx:SAC",
    "sb3_fork_dsac_t": "stable_baselines3.dsact:DSACT",
}
# Those that `--precision` and `--compile` are for; all others stay as they are by default.
OURS = ("bayes_dsac", "dsac_t", "redq")
VECTORS = spaces.Box(-1, 1, (60,))
DEPTH = spaces.Dict(
    {"depth": spaces.Box(0, 255, (5, 48, 64), np.uint8), "state": spaces.Box(-1, 1, (32,))}
)


@dataclass(frozen=True)
class Case:
    """One table: what is observed, gradient steps per call of `train`, and who takes part."""

    observations: spaces.Space[Any]
    replay_ratio: int
    rivals: tuple[str, ...]


CASES = {
    "vectors_rr20": Case(VECTORS, 20, tuple(RIVALS)),
    "vectors_rr1": Case(VECTORS, 1, tuple(name for name in RIVALS if name != "redq")),
    "depth_rr20": Case(DEPTH, 20, ("sac", "bayes_dsac", "dsac_t")),
    "depth_rr1": Case(DEPTH, 1, ("sac", "bayes_dsac", "dsac_t")),
}


class Still(gym.Env[Any, Any]):
    """An environment that only states its spaces."""

    action_space = spaces.Box(-1, 1, (6,))

    def __init__(self, observations: spaces.Space[Any]) -> None:
        self.observation_space = observations

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        """A random observation."""
        return self.observation_space.sample(), {}

    def step(self, action: Any) -> Any:
        """No reward."""
        return self.observation_space.sample(), 0.0, False, False, {}


def load(target: str) -> type[Any] | None:
    """The class behind "module:name", or None if its package is not installed."""
    module, name = target.split(":")
    try:
        cls: type[Any] = getattr(importlib.import_module(module), name)
    except ImportError:
        return None
    return cls


def peer_versions() -> dict[str, str]:
    """Versions of the optional peers."""
    found = {}
    for name in ("sbx-rl", "jax"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "missing"
    return found


def make(cls: type[Any], case: Case, **options: Any) -> Any:
    """A model with a buffer full of random transitions and a silent logger."""
    depth = isinstance(case.observations, spaces.Dict)
    kwargs: dict[str, Any] = {"net_arch": [256, 256]}
    if depth:
        kwargs["features_extractor_class"] = DepthEncoder
    model = cls(
        "MultiInputPolicy" if depth else "MlpPolicy",
        Still(case.observations),
        policy_kwargs=kwargs,
        buffer_size=2_000 if depth else 10_000,
        batch_size=BATCH,
        gradient_steps=case.replay_ratio,
        learning_starts=0,
        seed=SEED,
        device="cpu",
        **options,
    )
    fill(model.replay_buffer, np.random.default_rng(SEED))
    model.set_logger(configure(None, []))
    return model


def fill(buffer: Any, rng: np.random.Generator) -> None:
    """Random observations, actions and rewards in every place of a replay buffer."""
    parts = [buffer.observations, buffer.next_observations]
    for part in parts:
        for array in part.values() if isinstance(part, dict) else [part]:
            images = array.dtype == np.uint8
            array[:] = rng.integers(0, 256, array.shape) if images else rng.normal(size=array.shape)
    buffer.actions[:] = rng.uniform(-1, 1, buffer.actions.shape)
    buffer.rewards[:] = rng.normal(size=buffer.rewards.shape)
    buffer.full = True


def milliseconds(work: Callable[[], object], steps: int) -> float:
    """Processor time of one step."""
    begin = time.process_time()
    work()
    return 1e3 * (time.process_time() - begin) / steps


def compare(
    case: Case, rounds: int, calls: int, precision: str, options: dict[str, Any]
) -> dict[str, Any]:
    """Milliseconds of a gradient step of each rival, and ratios to SAC within a round.

    `precision` is that of the products of our own algorithms, for torch's
    `set_float32_matmul_precision`; `options` are arguments of their constructors.
    """
    classes = {name: load(RIVALS[name]) for name in case.rivals}
    models = {
        name: make(cls, case, **(options if name in OURS else {}))
        for name, cls in classes.items()
        if cls
    }
    steps = calls * case.replay_ratio

    def work(name: str) -> None:
        th.set_float32_matmul_precision(precision if name in OURS else "highest")
        for _ in range(calls):
            models[name].train(case.replay_ratio, BATCH)

    for name in models:
        work(name)
    times: dict[str, list[float]] = {name: [] for name in models}
    for _ in range(rounds):
        for name in models:
            times[name].append(milliseconds(partial(work, name), steps))
    sac = np.array(times["sac"])
    return {
        "median_ms": {name: float(np.median(t)) for name, t in times.items()},
        "ratio_to_sac": {name: float(np.median(np.array(t) / sac)) for name, t in times.items()},
        "skipped": sorted(name for name, cls in classes.items() if cls is None),
    }


def matrix_rate(repeats: int = 300) -> float:
    """FLOP/s of the product of a hidden layer: two critics, a batch, 256 x 256."""
    x, w = th.randn(2, BATCH, 256), th.randn(2, 256, 256)
    out = th.empty(2, BATCH, 256)
    times = [milliseconds(lambda: th.bmm(x, w, out=out), 1) for _ in range(repeats)]
    return float(2 * 2 * BATCH * 256**2 / (1e-3 * np.median(times)))


def floor(case: Case, rate: float) -> dict[str, float]:
    """Arithmetic of a step of Bayes-DSAC, mean over actor's and other steps, and its time."""
    cls = load(RIVALS["bayes_dsac"])
    assert cls is not None
    model = make(cls, case)
    with FlopCounterMode(display=False) as counter:
        model.train(20, BATCH)
    flops = counter.get_total_flops() / 20
    return {"mflop": flops / 1e6, "floor_ms": 1e3 * flops / rate}


def main() -> None:
    """Measure all cases and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--precision", default="highest", choices=["highest", "medium"])
    parser.add_argument("--compile", action="store_true", help="ours with compile_updates=True")
    parser.add_argument("--cases", nargs="*", default=list(CASES), choices=CASES)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/update_speed.json"))
    arguments = parser.parse_args()
    th.set_num_threads(1)
    rate = matrix_rate()
    result: dict[str, Any] = {
        **circumstances(),
        "versions": versions() | peer_versions(),
        "threads": th.get_num_threads(),
        "seed": SEED,
        "rounds": arguments.rounds,
        "precision": arguments.precision,
        "compile_updates": arguments.compile,
        "matrix_gflop_s": rate / 1e9,
        "cases": {},
    }
    for name in arguments.cases:
        case = CASES[name]
        calls = max(1, 20 // case.replay_ratio)
        options = {"compile_updates": True} if arguments.compile else {}
        rows = compare(case, arguments.rounds, calls, arguments.precision, options)
        rows |= floor(case, rate)
        rows["bayes_dsac_over_floor"] = rows["median_ms"]["bayes_dsac"] / rows["floor_ms"]
        result["cases"][name] = rows
    write_json(result, arguments.out)
    print(json.dumps(result, indent=2))


if __name__ == "__main__":
    main()
