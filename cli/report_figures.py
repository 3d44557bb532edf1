"""Figures of a report, as SVG text."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from horf_env.types import FloatArray

from .report_numbers import Improvement, interval
from .run_results import Group, Points, RunData, on_grid
from .statistics import interquartile_mean, mean

# Colours that colour-blind people tell apart (Okabe and Ito), one an algorithm or group.
_COLOURS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#a0960e", "#787878")
_MANY = 5  # runs; with more, single runs are not drawn
_AXES = {"step": "environment steps", "hours": "wall time [h]"}
_PANEL = (4.8, 2.7)  # inches

Statistic = Callable[[FloatArray], FloatArray]


def curves(groups: Sequence[Group]) -> str | None:
    """Evaluations while learning, over steps and over wall time; None if there are none."""
    rows: list[tuple[str, str, Statistic]] = [
        ("success rate, mean", "success", mean),
        ("return, mean", "return", mean),
        ("return, IQM", "return", interquartile_mean),
    ]
    return _grid(groups, rows, lambda run, column: run.evaluation_points(column))


def training_curves(groups: Sequence[Group]) -> str | None:
    """Episodes of training, with exploration noise; None if there are none."""
    rows: list[tuple[str, str, Statistic]] = [
        ("success rate, mean", "episode/success", mean),
        ("return, IQM", "episode/return", interquartile_mean),
    ]
    return _grid(groups, rows, lambda run, name: run.training_points(name))


def final_returns(groups: Sequence[Group]) -> str | None:
    """Return at the end of each run, with the IQM and its interval; None if no run has ended."""
    groups = [group for group in groups if group.ended]
    if not groups:
        return None
    figure, axes = _figure(1, 1, height=0.6 + 0.45 * len(groups))
    for k, group in enumerate(groups):
        values = np.array([run.final_return for run in group.ended])
        _dots(axes[0, 0], values, k, _COLOURS[k % len(_COLOURS)])
    _name_rows(axes[0, 0], [group.label for group in groups])
    axes[0, 0].set_xlabel("return of the last evaluation: runs, IQM, 95 % interval")
    return _svg(figure)


def improvements(found: Sequence[Improvement]) -> str | None:
    """Probability of improvement of each pair; None without pairs."""
    if not found:
        return None
    figure, axes = _figure(1, 1, height=0.7 + 0.32 * len(found))
    ax = axes[0, 0]
    for k, pair in enumerate(found):
        ax.plot([pair.low, pair.high], [k, k], color=_COLOURS[0], linewidth=2)
        ax.plot(pair.probability, k, "o", color=_COLOURS[0])
    ax.axvline(0.5, color="#999999", linewidth=0.8)
    _name_rows(ax, [f"{pair.better} > {pair.worse}" for pair in found])
    ax.set(xlim=(0.0, 1.0), xlabel="probability of a larger return")
    return _svg(figure)


def replay_ratios(groups: Sequence[Group]) -> str | None:
    """Return at the end over the replay ratio; None unless an algorithm has several."""
    algos = dict.fromkeys(group.algo for group in groups)
    several = {
        algo: [g for g in groups if g.algo == algo and g.ended and g.ratio is not None]
        for algo in algos
    }
    several = {algo: found for algo, found in several.items() if len(found) > 1}
    if not several:
        return None
    figure, axes = _figure(1, 1)
    for k, (algo, found) in enumerate(several.items()):
        found = sorted(found, key=lambda group: group.ratio or 0.0)
        ratios = [group.ratio or 0.0 for group in found]
        values = [np.array([run.final_return for run in group.ended]) for group in found]
        spans = np.array([interval(v, interquartile_mean) for v in values])
        colour = _COLOURS[k % len(_COLOURS)]
        axes[0, 0].fill_between(ratios, spans[:, 1], spans[:, 2], color=colour, alpha=0.2)
        axes[0, 0].plot(ratios, spans[:, 0], "o-", color=colour, label=algo)
    axes[0, 0].set(xscale="log", xlabel="gradient steps an environment step", ylabel="return, IQM")
    axes[0, 0].legend(frameon=False)
    return _svg(figure)


def q_biases(groups: Sequence[Group]) -> str | None:
    """Bias of Q at the end of each run; None if none was measured."""
    found = [
        (group.label, values)
        for group in groups
        if (values := [run.bias for run in group.runs if run.bias is not None])
    ]
    if not found:
        return None
    figure, axes = _figure(1, 1, height=0.6 + 0.45 * len(found))
    for k, (_, values) in enumerate(found):
        _dots(axes[0, 0], np.array(values), k, _COLOURS[k % len(_COLOURS)])
    axes[0, 0].axvline(0.0, color="#999999", linewidth=0.8)
    _name_rows(axes[0, 0], [label for label, _ in found])
    axes[0, 0].set_xlabel("(predicted - Monte-Carlo return) / |mean return|: runs, IQM, interval")
    return _svg(figure)


def _grid(
    groups: Sequence[Group],
    rows: Sequence[tuple[str, str, Statistic]],
    points: Callable[[RunData, str], Points],
) -> str | None:
    """A row of panels a quantity, a column an axis."""
    figure, axes = _figure(len(rows), len(_AXES))
    drawn = 0
    for (label, name, statistic), line in zip(rows, axes, strict=True):
        for axis, ax in zip(_AXES, line, strict=True):
            for k, group in enumerate(groups):
                found = [p for run in group.runs if len((p := points(run, name)).step)]
                if found:
                    _curve(ax, found, axis, statistic, group.label, k)
                    drawn += 1
            ax.set(xlabel=_AXES[axis], ylabel=label)
            ax.xaxis.set_major_locator(MaxNLocator(5))
            if "success" in name:
                ax.set_ylim(-0.03, 1.03)
    if not drawn:
        return None
    figure.legend(
        *axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4, frameon=False
    )
    return _svg(figure)


def _curve(
    ax: Axes, found: Sequence[Points], axis: str, statistic: Statistic, label: str, k: int
) -> None:
    """A statistic of several runs; the runs one by one where they have no place in common.

    That happens with few evaluations over wall time: one run has ended before another begins.
    """
    grid, values = on_grid(found, axis)
    if len(grid):
        _band(ax, grid, values, statistic, label, k)
        return
    for run, points in enumerate(found):
        colour, name = _COLOURS[k % len(_COLOURS)], label if run == 0 else None
        ax.plot(getattr(points, axis), points.value, "o-", color=colour, linewidth=0.6, label=name)


def _band(
    ax: Axes, x: FloatArray, values: FloatArray, statistic: Statistic, label: str, k: int
) -> None:
    """A statistic of several runs, its interval, and the runs themselves if they are few."""
    colour = _COLOURS[k % len(_COLOURS)]
    marker = "o" if len(x) == 1 else None
    line, low, high = interval(values, statistic)
    if values.shape[1] <= _MANY:
        ax.plot(x, values[:, :, 0], color=colour, linewidth=0.6, alpha=0.5)
    ax.fill_between(x, low, high, color=colour, alpha=0.18, linewidth=0)
    ax.plot(x, line, color=colour, linewidth=1.8, label=label, marker=marker)


def _dots(ax: Axes, values: FloatArray, row: int, colour: str) -> None:
    middle, low, high = interval(values, interquartile_mean)
    ax.plot([low, high], [row, row], color=colour, linewidth=6, alpha=0.3, solid_capstyle="butt")
    ax.plot(values, np.full(len(values), row), "o", color=colour, markersize=4)
    ax.plot(middle, row, "|", color=colour, markersize=16, markeredgewidth=2.5)


def _name_rows(ax: Axes, names: Sequence[str]) -> None:
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.5, -0.5)


def _figure(rows: int, columns: int, *, height: float = _PANEL[1]) -> tuple[Figure, np.ndarray]:
    figure = Figure((2 * _PANEL[0], rows * height + 0.4), layout="constrained")
    FigureCanvasSVG(figure)
    axes = figure.subplots(rows, columns, squeeze=False)
    for ax in axes.flat:
        ax.grid(visible=True, color="#e5e5e5", linewidth=0.6)
        ax.set_axisbelow(True)
        ax.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _svg(figure: Figure) -> str:
    buffer = io.StringIO()
    # The same figure from the same data: no date, and ids from a fixed seed.
    with mpl.rc_context({"svg.hashsalt": "horf"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()
