"""Draw the learning curves of a study: one panel a task and variant.

    python benchmarks/plot_learning.py benchmarks/results/learning --out docs/images/learning.png

Thick: interquartile mean over seeds, shaded: its 95 % bootstrap interval, thin: every run.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from study.summary import Group, estimate, groups

COLUMNS = 3
PANEL = (4.2, 3.2)  # inches


def draw(axis: Axes, group: Group, colour: str) -> None:
    """Curves of one group."""
    points = estimate(group.returns)
    low, high = [point.low for point in points], [point.high for point in points]
    axis.plot(group.steps, group.returns, color=colour, linewidth=0.5, alpha=0.5)
    axis.fill_between(group.steps, low, high, color=colour, alpha=0.15, linewidth=0)
    values = [point.value for point in points]
    axis.plot(
        group.steps, values, color=colour, label=f"{group.algorithm} ({group.returns.shape[1]})"
    )


def main() -> None:
    """Draw all panels."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    found = groups(arguments.folder)
    algorithms = sorted({group.algorithm for group in found})
    panels = sorted({(group.task, group.variant) for group in found})
    rows = -(-len(panels) // COLUMNS)
    columns = min(COLUMNS, len(panels))
    size = (PANEL[0] * columns, PANEL[1] * rows)
    figure, axes = plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False)
    for axis in axes.flat[len(panels) :]:
        axis.set_axis_off()
    for axis, panel in zip(np.ravel(axes), panels, strict=False):
        for group in found:
            if (group.task, group.variant) == panel:
                draw(axis, group, f"C{algorithms.index(group.algorithm)}")
        axis.set(title=" ".join(panel), xlabel="environment step", ylabel="return")
        axis.legend(fontsize="x-small")
    figure.savefig(arguments.out, dpi=110)


if __name__ == "__main__":
    main()
