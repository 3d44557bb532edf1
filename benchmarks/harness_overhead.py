"""What the harness adds to a training run: rows, progress, checkpoints, recordings, bookkeeping.

python benchmarks/harness_overhead.py --out benchmarks/results/harness_overhead.json

The rival is Stable-Baselines3's `learn` alone, with the same model, environments, arguments and
evaluation episodes, and nothing stored. Both run in one process in turns; the ratio of the medians
of CPU time counts. Where the harness spends it is measured by the harness itself.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from pathlib import Path

import pyarrow.compute as pc
import torch as th
from circumstances import circumstances, write_json
from horf_cli.config import TrainConfig
from horf_cli.config_files import make_config
from horf_cli.environments import make_env
from horf_cli.episodes import run_episode
from horf_cli.metrics import read_metrics
from horf_cli.models import new_model
from horf_cli.policies import PolicyPlanner
from horf_cli.training import train
from horf_cli.training_envs import training_envs
from stable_baselines3.common.callbacks import BaseCallback


class BareEvaluation(BaseCallback):
    """The same evaluation episodes, and no more."""

    def __init__(self, config: TrainConfig) -> None:
        super().__init__()
        self._config, self._env, self._next = config, make_env(config.env), config.protocol.every

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        if self.num_timesteps >= self._next:
            self._next += self._config.protocol.every
            self.evaluate(self._config.protocol.episodes)

    def evaluate(self, episodes: int) -> None:
        """Drive validation instances."""
        planner = PolicyPlanner(self.model, self._config.env)
        for instance in range(episodes):
            run_episode(
                self._env,
                planner,
                method="bare",
                scene=self._config.env.scene,
                instance=instance,
                split="validation",
            )


def bare(config: TrainConfig) -> None:
    """Learn without the harness."""
    th.set_num_threads(config.threads)
    envs = training_envs(config)
    model = new_model(config, envs)
    evaluation = BareEvaluation(config)
    model.learn(config.steps, evaluation)
    evaluation._on_rollout_start()
    evaluation.evaluate(config.protocol.final_episodes)
    envs.close()


def harness(config: TrainConfig) -> dict[str, float]:
    """Learn with the harness; returns the seconds by part that it noted last."""
    with tempfile.TemporaryDirectory() as folder:
        train(config, Path(folder))
        table = read_metrics(Path(folder))
        times = table.filter(pc.starts_with(table["name"], "time/"))
        return dict(zip(times["name"].to_pylist(), times["value"].to_pylist(), strict=True))


def main() -> None:
    """Measure in turns."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=3000)
    parser.add_argument("--every", type=int, default=1500, help="steps between evaluations")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    config = make_config(
        options={
            "steps": arguments.steps,
            "env.scene": "room",
            "protocol.every": arguments.every,
            "protocol.final_episodes": 2,
        }
    )
    seconds: dict[str, list[float]] = {"bare": [], "harness": []}
    parts: dict[str, float] = {}
    bare(config.model_copy(update={"steps": 50}))  # compiles and loads everything
    for _ in range(arguments.repeats):
        for name, run in (("bare", bare), ("harness", harness)):
            begin = time.process_time()
            parts = run(config) or parts
            seconds[name].append(time.process_time() - begin)
    medians = {name: statistics.median(values) for name, values in seconds.items()}
    result = {
        "config": config.model_dump(mode="json"),
        "cpu_seconds": seconds,
        "overhead": medians["harness"] / medians["bare"] - 1.0,
        "parts_of_last_run": parts,
        **circumstances(),
    }
    write_json(result, arguments.out)
    print(f"overhead of the harness: {100.0 * result['overhead']:.1f} %")


if __name__ == "__main__":
    main()
