"""Draw the learning curve of a run: return and success of its training episodes and evaluations.

python benchmarks/plot_run.py runs/room/bayes_dsac/seed0-... --out docs/images/curve.png
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pyarrow.compute as pc
from horf_cli.metrics import read_evaluations, read_metrics

WINDOW = 10  # episodes in the moving mean


def main() -> None:
    """Draw the run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    metrics, evaluations = read_metrics(arguments.run), read_evaluations(arguments.run)
    figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7, 5), layout="constrained")
    for axis, name in zip(axes, ("return", "success"), strict=True):
        episodes = metrics.filter(pc.equal(metrics["name"], f"episode/{name}"))
        end, values = np.array(episodes["step"]), np.array(episodes["value"])
        mean = np.convolve(values, np.ones(WINDOW) / WINDOW, mode="valid")
        axis.plot(end, values, ".", color="0.7", label="training episode")
        axis.plot(end[WINDOW - 1 :], mean, color="tab:blue", label=f"mean of {WINDOW} episodes")
        steps, points = np.array(evaluations["step"]), np.array(evaluations[name], dtype=float)
        axis.plot(steps, points, "x", color="tab:orange", label="evaluation episode")
        axis.set_ylabel(name)
    axes[0].legend()
    axes[1].set_ylim(-0.05, 1.05)
    axes[1].set_xlabel("environment step")
    figure.savefig(arguments.out, dpi=120)


if __name__ == "__main__":
    main()
