"""Which loss should train a shared image encoder: the critics', the actor's, or both?

Bayes-DSAC learns `horf/Reach-v0` in the scene "room" from the depth stack; all runs differ in
`encoder_gradient` and seed alone. Each run adds its rows to a parquet file when it is done, and
runs that are there already are skipped, so the script may be stopped and started again.

    python benchmarks/encoder_gradient.py [--steps 30000] [--seeds 0 1 2]
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import torch as th
from horf_cli.provenance import git_revision, machine
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.monitor import Monitor

import horf_env  # noqa: F401  registers the environment
from sb3_bayes_dsac import BayesDSAC
from sb3_bayes_dsac.common.policies import ENCODER_GRADIENTS

SCENE = "room"
# Evaluations spread over a run.
EVALUATIONS = 3


class Evaluation(BaseCallback):
    """Success, collisions and return on the scene's validation instances, at equal distances."""

    def __init__(self, every: int, episodes: int) -> None:
        super().__init__()
        self.every, self.episodes = every, episodes
        self.rows: list[dict[str, Any]] = []
        self.env = gym.make("horf/Reach-v0", scene=SCENE)

    def _on_step(self) -> bool:
        if self.num_timesteps % self.every == 0:
            self.rows.append({"step": self.num_timesteps} | self.measure())
        return True

    def measure(self) -> dict[str, float]:
        """Means over the instances, with deterministic actions."""
        outcomes = np.array([self.episode(k) for k in range(self.episodes)])
        names = ("success", "collision", "return")
        return dict(zip(names, outcomes.mean(axis=0).tolist(), strict=True))

    def episode(self, instance: int) -> tuple[float, float, float]:
        """Success, collision and return of one instance."""
        options = {"instance": instance, "split": "validation"}
        observation, _ = self.env.reset(seed=0, options=options)
        info: dict[str, Any] = {}
        total, over = 0.0, False
        while not over:
            action, _ = self.model.predict(observation, deterministic=True)
            observation, reward, terminated, truncated, info = self.env.step(action)
            total += float(reward)
            over = terminated or truncated
        return float(info["is_success"]), float(info["is_collision"]), total


def run(gradient: str, seed: int, steps: int, episodes: int) -> list[dict[str, Any]]:
    """Train once; one row an evaluation."""
    evaluation = Evaluation(steps // EVALUATIONS, episodes)
    model = BayesDSAC(
        "MultiInputPolicy",
        Monitor(gym.make("horf/Reach-v0", scene=SCENE)),
        buffer_size=min(steps, 50_000),
        learning_starts=min(2_000, steps // 10),
        gamma=0.98,
        train_freq=2,
        policy_kwargs={"encoder_gradient": gradient},
        seed=seed,
        device="cpu",
    )
    begin = time.process_time()
    model.learn(steps, callback=evaluation)
    same = {
        "encoder_gradient": gradient,
        "seed": seed,
        "steps": steps,
        "episodes": episodes,
        "cpu_s": time.process_time() - begin,
        "revision": git_revision(),
        "cpu": machine()["cpu"],
    }
    return [same | row for row in evaluation.rows]


def main() -> None:
    """Train what is missing and add it to the file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=30_000)
    parser.add_argument("--episodes", type=int, default=5, help="validation instances")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--gradients", nargs="+", default=list(ENCODER_GRADIENTS))
    out = Path("benchmarks/results/encoder_gradient.parquet")
    parser.add_argument("--out", type=Path, default=out)
    arguments = parser.parse_args()
    th.set_num_threads(1)
    rows: list[dict[str, Any]] = (
        pq.read_table(arguments.out).to_pylist() if arguments.out.exists() else []
    )
    done = {(row["encoder_gradient"], row["seed"], row["steps"]) for row in rows}
    for seed in arguments.seeds:
        for gradient in arguments.gradients:
            if (gradient, seed, arguments.steps) in done:
                continue
            rows += run(gradient, seed, arguments.steps, arguments.episodes)
            arguments.out.parent.mkdir(parents=True, exist_ok=True)
            pq.write_table(pa.Table.from_pylist(rows), arguments.out)
            print(rows[-1], flush=True)


if __name__ == "__main__":
    main()
