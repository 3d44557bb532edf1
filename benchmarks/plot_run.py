"""Draw the learning curve of a run: return and success of its training episodes and evaluations.

python benchmarks/plot_run.py runs/room/bayes_dsac/seed0-... --out docs/images/curve.png
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

WINDOW = 10  # episodes in the moving mean


def read(path: Path, comment_lines: int = 0) -> dict[str, list[str]]:
    """Columns of a CSV file."""
    with path.open() as file:
        for _ in range(comment_lines):
            next(file)
        rows = list(csv.DictReader(file))
    return {name: [row[name] for row in rows] for name in rows[0]}


def main() -> None:
    """Draw the run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    episodes = read(arguments.run / "monitor.csv", comment_lines=1)
    evaluations = read(arguments.run / "evaluations.csv")
    end = np.cumsum(np.array(episodes["l"], dtype=float))
    curves = {
        "return": (episodes["r"], evaluations["episode_return"]),
        "success": (
            [float(s == "True") for s in episodes["is_success"]],
            [float(s == "True") for s in evaluations["success"]],
        ),
    }
    figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7, 5), layout="constrained")
    for axis, (name, (training, evaluation)) in zip(axes, curves.items(), strict=True):
        values = np.array(training, dtype=float)
        mean = np.convolve(values, np.ones(WINDOW) / WINDOW, mode="valid")
        axis.plot(end, values, ".", color="0.7", label="training episode")
        axis.plot(end[WINDOW - 1 :], mean, color="tab:blue", label=f"mean of {WINDOW} episodes")
        steps, points = np.array(evaluations["step"], dtype=float), np.array(evaluation, float)
        axis.plot(steps, points, "x", color="tab:orange", label="evaluation episode")
        axis.set_ylabel(name)
    axes[0].legend()
    axes[1].set_ylim(-0.05, 1.05)
    axes[1].set_xlabel("environment step")
    figure.savefig(arguments.out, dpi=120)


if __name__ == "__main__":
    main()
