"""Memory and speed of the buffer of frame stacks against SB3's `DictReplayBuffer`.

Both get the same stream and are sampled alternately in one process on one thread; ratios of
processor times count, not the absolute times.

    OMP_NUM_THREADS=1 python benchmarks/buffer.py [--transitions 100000] [--out FILE.json]
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch as th
from circumstances import circumstances, write_json
from gymnasium import spaces
from stable_baselines3.common.buffers import DictReplayBuffer
from stable_baselines3.common.save_util import load_from_pkl, save_to_pkl

from sb3_bayes_dsac.common.buffers import FrameStackReplayBuffer

# What `horf/Reach-v0` observes, and the length of its episodes.
STACK = (5, 48, 64)
VECTORS = {"state": 19, "deviation": 6}
EPISODE = 1000
BATCH = 256
SAMPLES = 300
SEED = 0
BUFFERS = {"dict": DictReplayBuffer, "frame_stack": FrameStackReplayBuffer}


def space() -> spaces.Dict:
    """Depth stack and vectors."""
    vectors = {key: spaces.Box(-np.inf, np.inf, (n,)) for key, n in VECTORS.items()}
    return spaces.Dict({"depth": spaces.Box(0, 255, STACK, np.uint8), **vectors})


def stream(n: int) -> Iterator[tuple[Any, ...]]:
    """Arguments of `add`: random frames, so that nothing can be compressed."""
    rng = np.random.default_rng(SEED)
    for k in range(n):
        if k % EPISODE == 0:
            stack = np.repeat(rng.integers(0, 256, (1, *STACK[1:]), np.uint8), STACK[0], axis=0)
        following = np.concatenate([stack[1:], rng.integers(0, 256, (1, *STACK[1:]), np.uint8)])
        vectors = {key: rng.normal(size=(1, size)) for key, size in VECTORS.items()}
        done = np.array([k % EPISODE == EPISODE - 1])
        obs, next_obs = ({"depth": depth[None], **vectors} for depth in (stack, following))
        yield obs, next_obs, np.zeros((1, 6)), np.zeros(1), done, [{}]
        stack = following


def cpu_time(call: Callable[[], Any]) -> float:
    """Processor time of a call in s."""
    begin = time.process_time()
    call()
    return time.process_time() - begin


def observation_bytes(buffer: DictReplayBuffer) -> int:
    """Size of everything that is stored of observations."""
    if isinstance(buffer, FrameStackReplayBuffer):
        return buffer.nbytes
    return sum(part.nbytes for part in buffer.observations.values()) * 2


def measure(transitions: int) -> dict[str, dict[str, float]]:
    """Fill, sample, save and load both buffers."""
    buffers = {
        name: cls(transitions, space(), spaces.Box(-1, 1, (6,)), "cpu")
        for name, cls in BUFFERS.items()
    }
    added = dict.fromkeys(buffers, 0.0)
    for transition in stream(transitions):
        for name, buffer in buffers.items():
            added[name] += cpu_time(partial(buffer.add, *transition))
    sampled: dict[str, list[float]] = {name: [] for name in buffers}
    for _ in range(SAMPLES):
        for name, buffer in buffers.items():
            sampled[name].append(cpu_time(partial(buffer.sample, BATCH)))
    ratios = np.array(sampled["frame_stack"]) / np.array(sampled["dict"])
    return {
        name: {
            "observations_gb": observation_bytes(buffer) / 1e9,
            "add_us": 1e6 * added[name] / transitions,
            "sample_ms": 1e3 * float(np.median(sampled[name])),
            **storage(buffer),
        }
        for name, buffer in buffers.items()
    } | {"frame_stack_over_dict": {"sample": float(np.median(ratios))}}


def storage(buffer: DictReplayBuffer) -> dict[str, float]:
    """Time to save and load, and the size of the file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "buffer.pkl"
        save = cpu_time(lambda: save_to_pkl(path, buffer))
        load = cpu_time(lambda: load_from_pkl(path))
        return {"save_s": save, "load_s": load, "file_gb": path.stat().st_size / 1e9}


def main() -> None:
    """Measure and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--transitions", type=int, default=100_000)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/buffer.json"))
    arguments = parser.parse_args()
    th.set_num_threads(1)
    result = {
        **circumstances(),
        "transitions": arguments.transitions,
        "batch": BATCH,
        **measure(arguments.transitions),
    }
    write_json(result, arguments.out)
    print(json.dumps(result, indent=2))


if __name__ == "__main__":
    main()
