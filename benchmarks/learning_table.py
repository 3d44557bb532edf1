"""Table of a learning study: interquartile means over seeds with 95 % bootstrap intervals.

    python benchmarks/learning_table.py benchmarks/results/learning

Every run in the folder counts. "Final" is the mean return of the last evaluation, "curve" the mean
of all evaluations. Q bias (predicted minus observed discounted soft return, in units of return) and
sigma are medians over seeds at the end; the time is processor time of learning per environment
step, median over seeds.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from study.summary import Group, estimate, groups

LEAST_RUNS = 3  # of a bootstrap interval that says something
HEADER = ("task", "variant", "algorithm", "runs", "final", "curve", "Q bias", "sigma", "ms / step")


def cells(group: Group) -> list[str]:
    """Cells of one row."""
    curve = group.returns.mean(axis=0, keepdims=True)
    runs = str(group.returns.shape[1])
    if group.stopped:
        runs += f" ({len(group.stopped)} stopped early)"
    times = [1e3 * row["cpu_s"] / row["step"] for row in group.last]
    return [
        group.task,
        group.variant or "-",
        group.algorithm,
        runs,
        centre(group.returns[-1:]),
        centre(curve),
        number(group.last_median("q_bias")),
        number(group.last_median("sigma_mean")),
        number(sorted(times)[len(times) // 2]),
    ]


def centre(point: NDArray[np.float64]) -> str:
    """Interquartile mean of one point of all runs, shape (1, n_runs), with its interval."""
    (found,) = estimate(point)
    return str(found) if point.size >= LEAST_RUNS else f"{found.value:.0f}"


def number(value: float | None) -> str:
    """A number of three digits, or a dash."""
    return "-" if value is None else f"{value:.3g}"


def main() -> None:
    """Print the table, then what stopped runs early."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    found = groups(parser.parse_args().folder)
    for row in (HEADER, ["---"] * len(HEADER), *map(cells, found)):
        print(f"| {' | '.join(row)} |")
    for group in found:
        for reason in group.stopped:
            print(f"{group.task} {group.variant} {group.algorithm}: {reason}")


if __name__ == "__main__":
    main()
