"""Draw and print the runs that correct a planner, one file a run.

    cd benchmarks/results/residual
    python ../../plot_residual.py poses_*_seed?.parquet --out ../../../docs/images/corrections.png

Names are PREFIX_ALGORITHM_seedN.parquet, beside each the one with `_evaluations`. Curves are of the
training episodes, with noise: at each step the mean over the last episodes of each run, thin, then
the mean over runs, thick, and its 95 % bootstrap interval, shaded. Crosses are the final episodes
on validation instances, without noise.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from horf_cli.statistics import bootstrap_interval, mean, share
from matplotlib.axes import Axes

from horf_env.types import FloatArray

WINDOW = 25  # episodes
POINTS = 40  # of a curve


def by_algorithm(files: Iterable[Path]) -> dict[str, list[Path]]:
    """Runs of each algorithm, by seed."""
    found = defaultdict(list)
    for file in sorted(files):
        algorithm = file.stem.split("_", 1)[1].rsplit("_", 1)[0]
        found[algorithm].append(file)
    return dict(found)


def final_episodes(file: Path) -> pa.Table:
    """The longest evaluation, which is the last one, of a run."""
    rows = pq.read_table(file.with_stem(f"{file.stem}_evaluations"))
    last = rows.filter(pc.equal(rows["step"], pc.max(rows["step"])))
    numbers = np.array(last["episode"])
    begin = len(numbers) - int(np.argmax(numbers[::-1] == 0)) - 1
    return last.slice(begin)


def episodes(file: Path, name: str) -> tuple[FloatArray, FloatArray]:
    """Steps at which training episodes ended, and a number of each."""
    rows = pq.read_table(file)
    rows = rows.filter(pc.equal(rows["name"], f"episode/{name}"))
    return np.array(rows["step"], dtype=float), np.array(rows["value"], dtype=float)


def curve(file: Path, name: str, steps: FloatArray) -> FloatArray:
    """Mean over the last episodes before each of the steps."""
    ends, values = episodes(file, name)
    count = np.searchsorted(ends, steps, side="right")
    return np.array([values[max(n - WINDOW, 0) : n].mean() if n else np.nan for n in count])


def draw(axis: Axes, files: list[Path], name: str, colour: str, label: str) -> None:
    """Curves of one algorithm."""
    first = max(episodes(file, name)[0][WINDOW] for file in files)
    steps = np.linspace(first, min(episodes(file, name)[0][-1] for file in files), POINTS)
    runs = np.stack([curve(file, name, steps) for file in files], axis=1)
    axis.plot(steps, runs, color=colour, linewidth=0.5, alpha=0.5)
    axis.plot(steps, runs.mean(axis=1), color=colour, label=f"{label} ({len(files)})")
    low, high = bootstrap_interval(runs[:, :, None], mean, np.random.default_rng(0))
    axis.fill_between(steps, low, high, color=colour, alpha=0.15, linewidth=0)
    finals = [np.array(final_episodes(file)[name], dtype=float).mean() for file in files]
    axis.plot([steps[-1]] * len(finals), finals, "x", color=colour)


def collisions(final: pa.Table) -> int:
    """How many episodes ended by one."""
    return int(final["failure"].to_pylist().count("collision"))


def goals(finals: list[pa.Table]) -> str:
    """How many episodes reached the goal, with Wilson's interval."""
    successes = [reached for final in finals for reached in final["success"].to_pylist()]
    return f"{sum(successes)} of {len(successes)}, {share(sum(successes), len(successes))}"


def row(algorithm: str, file: Path) -> str:
    """Line of the table."""
    final, (_, trained) = final_episodes(file), episodes(file, "success")
    training_hits = episodes(file, "collision")[1]
    cells = [
        f"{algorithm}, {file.stem.rsplit('_', 1)[1]}",
        goals([final]),
        str(collisions(final)),
        f"{np.array(final['return'], dtype=float).mean():.1f}",
        f"{100 * trained.mean():.0f} % / {100 * training_hits.mean():.1f} % of {len(trained)}",
    ]
    return f"| {' | '.join(cells)} |"


def total(algorithm: str, files: list[Path]) -> str:
    """Line of several runs of an algorithm, its return with a bootstrap interval over seeds."""
    finals = [final_episodes(file) for file in files]
    returns = np.stack([np.array(final["return"], dtype=float) for final in finals])
    (low,), (high,) = bootstrap_interval(returns[None], mean, np.random.default_rng(0))
    cells = [
        f"{algorithm}, {len(files)} seeds",
        goals(finals),
        str(sum(map(collisions, finals))),
        f"{returns.mean():.1f} [{low:.1f}, {high:.1f}]",
    ]
    return f"| {' | '.join(cells)} | |"


def main() -> None:
    """Draw the curves and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    runs = by_algorithm(arguments.files)
    figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7, 6), layout="constrained")
    for axis, name in zip(axes, ("return", "success"), strict=True):
        for k, (algorithm, files) in enumerate(runs.items()):
            draw(axis, files, name, f"C{k}", algorithm)
        axis.set_ylabel(f"{name}, last {WINDOW} episodes")
    axes[0].legend()
    axes[1].set_xlabel("correction")
    figure.savefig(arguments.out, dpi=120)
    for algorithm, files in runs.items():
        print("\n".join(row(algorithm, file) for file in files))
        if len(files) > 1:
            print(total(algorithm, files))


if __name__ == "__main__":
    main()
