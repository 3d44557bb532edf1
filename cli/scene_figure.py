"""The picture of a scene family: its first test instances from above."""

from __future__ import annotations

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from horf_env.scenes import test_instance

from .top_view import draw_scene, draw_start, extent, legend_entries

_INSTANCES = 6
_ROWS_OF_WIDE, _ROWS = 6, 2  # a scene more than twice as wide as high gets a row of its own
_WIDTH = 11.0  # inches
_TITLE_HEIGHT = 0.6  # inches a row
_DPI = 110


def save_family_figure(path: Path, family: str) -> None:
    """Draw the first test instances of a family.

    Args:
        path: PNG file to write.
        family: Name of the family.
    """
    scenes = [test_instance(family, k) for k in range(_INSTANCES)]
    lower, upper = extent(scenes[0])
    width, height = upper - lower
    rows = _ROWS_OF_WIDE if width > 2.0 * height else _ROWS
    columns = _INSTANCES // rows
    row_height = _WIDTH / columns * height / width + _TITLE_HEIGHT
    figure = Figure(figsize=(_WIDTH, rows * row_height + _TITLE_HEIGHT), layout="constrained")
    FigureCanvasAgg(figure)
    for k, (axes, scene) in enumerate(
        zip(figure.subplots(rows, columns).flat, scenes, strict=True)
    ):
        draw_scene(axes, scene)
        draw_start(axes, scene)
        axes.set_title(f"{family} {k}", fontsize=9)
        axes.set(xlabel="", ylabel="")
    figure.legend(handles=legend_entries()[2:], loc="outside lower center", ncols=3, frameon=False)
    figure.savefig(path, dpi=_DPI)
