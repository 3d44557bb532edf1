"""The picture of an episode: path from above; robot at the start, midway and at the end."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from horf_env.robot import RobotState
from horf_env.scenes import Scene
from horf_env.simulation import PyBulletWorld, Viewpoint, WorldState

from .episodes import Trial
from .top_view import draw_motion, draw_scene, extent, legend_entries

_WIDE = 1.35  # a scene that is wider than this by its height has the pictures below it
_EYE_DISTANCE = 2.9  # m
_EYE_PITCH = -48.0  # degrees; steep enough to look over the walls behind the robot
_EYE_ASIDE = 25.0  # degrees from right behind the robot, so that the arm does not hide itself
_WIDTH = 10.0  # inches
_DPI = 130


def save_path_figure(
    path: Path, *, scene: Scene, states: Sequence[RobotState], trial: Trial
) -> None:
    """Draw an episode.

    Args:
        path: PNG file to write.
        scene: Scene of the episode.
        states: State of the robot after the reset and after each step.
        trial: Its result, for the title.
    """
    figure, map_axes, picture_axes = _layout(scene)
    draw_scene(map_axes, scene)
    draw_motion(map_axes, states)
    _draw_pictures(picture_axes, scene, states, trial)
    figure.legend(
        handles=legend_entries(), loc="outside lower center", ncols=5, frameon=False, fontsize=9
    )
    figure.suptitle(_title(trial), fontsize=12)
    figure.savefig(path, dpi=_DPI)


def _layout(scene: Scene) -> tuple[Figure, Axes, list[Axes]]:
    lower, upper = extent(scene)
    width, height = upper - lower
    figure = Figure(layout="constrained")
    FigureCanvasAgg(figure)
    if width > _WIDE * height:
        figure.set_size_inches(_WIDTH, _WIDTH * height / width + 3.6)
        grid = figure.add_gridspec(2, 3, height_ratios=[_WIDTH * height / width, 2.6])
        map_axes = figure.add_subplot(grid[0, :])
        cells = [grid[1, k] for k in range(3)]
    else:
        figure.set_size_inches(_WIDTH, 7.3)
        grid = figure.add_gridspec(3, 2, width_ratios=[6.8, 3.2])
        map_axes = figure.add_subplot(grid[:, 0])
        cells = [grid[k, 1] for k in range(3)]
    return figure, map_axes, [figure.add_subplot(cell) for cell in cells]


def _draw_pictures(
    axes: Sequence[Axes], scene: Scene, states: Sequence[RobotState], trial: Trial
) -> None:
    world = PyBulletWorld()
    world.set_scene(scene)
    last = len(states) - 1
    for axis, step in zip(axes, (0, last // 2, last), strict=True):
        world.set_state(WorldState(states[step].configuration, np.zeros(9)))
        axis.imshow(world.render_rgb(viewpoint=_viewpoint(states[step])))
        axis.set_title(f"t = {trial.execution_time * step / max(last, 1):.1f} s", fontsize=9)
        axis.set_axis_off()
    world.close()


def _viewpoint(state: RobotState) -> Viewpoint:
    heading = np.degrees(state.configuration[2])
    return Viewpoint(
        distance=_EYE_DISTANCE, yaw=float(heading - 90.0 + _EYE_ASIDE), pitch=_EYE_PITCH
    )


def _title(trial: Trial) -> str:
    return (
        f"{trial.scene} {trial.instance} - {trial.method}: {trial.outcome} after "
        f"{trial.execution_time:.1f} s, base {trial.path_length_base:.1f} m, "
        f"end effector {trial.path_length_ee:.1f} m, least clearance {trial.min_distance:.3f} m"
    )
