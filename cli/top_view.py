"""A scene and a motion seen from above, drawn with matplotlib."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Polygon
from scipy.spatial import ConvexHull

from horf_env.robot import RobotState, collision_parts
from horf_env.scenes import Scene
from horf_env.types import FloatArray

BASE_COLOUR = "#0072b2"
EE_COLOUR = "#e69f00"
GOAL_COLOUR = "#d55e00"
_EDGE_COLOUR = "#4a4038"
_LOW_COLOUR, _HIGH_COLOUR = "#f0e8da", "#8d7b66"
_HEIGHTS = LinearSegmentedColormap.from_list("height", [_LOW_COLOUR, _HIGH_COLOUR])
_FLOATING_ABOVE = 0.05  # m; what starts higher than this does not stand on the floor
_TALL = 2.0  # m; the darkest colour
_ROBOT_EVERY = 20  # steps between two outlines of the base: 1 s
_ARROW = 0.7  # m; twice the half length of the base
_MARGIN = 0.3  # m around everything


def draw_scene(axes: Axes, scene: Scene) -> None:
    """Obstacles, the taller the darker, hatched if they do not stand on the floor; the goal."""
    for bottom, top, patch in sorted(_obstacles(scene), key=lambda item: item[1]):
        patch.set(facecolor=_HEIGHTS(min(top / _TALL, 1.0)), edgecolor=_EDGE_COLOUR, linewidth=0.6)
        if bottom > _FLOATING_ABOVE:
            patch.set(hatch="////", alpha=0.75, linestyle="--")
        axes.add_patch(patch)
    x, y, _ = scene.goal.position
    axes.plot(x, y, marker="*", markersize=15, color=GOAL_COLOUR, mec="white", zorder=5)
    lower, upper = extent(scene)
    axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]), aspect="equal")
    axes.set(xlabel="x [m]", ylabel="y [m]")


def draw_start(axes: Axes, scene: Scene) -> None:
    """Where the robot starts, with its heading."""
    x, y, theta = scene.start.base
    T = np.eye(4)
    T[:2, :2] = [[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]]
    T[:2, 3] = x, y
    axes.add_patch(_outline(T, _footprint(), facecolor=BASE_COLOUR, alpha=0.6))
    nose = (x + _ARROW * np.cos(theta), y + _ARROW * np.sin(theta))
    axes.annotate("", nose, (x, y), arrowprops={"arrowstyle": "->", "color": BASE_COLOUR})


def draw_motion(axes: Axes, states: Sequence[RobotState]) -> None:
    """Ways of base and end effector, the base once a second, the arm at both ends."""
    footprint = _footprint()
    for state in states[:-1:_ROBOT_EVERY]:
        axes.add_patch(_outline(state.T_world_base, footprint, facecolor=BASE_COLOUR, alpha=0.12))
    for state in (states[0], states[-1]):
        axes.add_patch(_outline(state.T_world_base, footprint, facecolor=BASE_COLOUR, alpha=0.6))
        arm = np.vstack([state.link_poses[1:, :2, 3], state.T_world_ee[:2, 3]])
        axes.plot(*arm.T, color="#333333", linewidth=2.5, solid_capstyle="round", zorder=4)
    paper = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none"}
    x, y = states[0].T_world_base[:2, 3]
    axes.text(x, y - 0.45, "start", ha="center", va="top", fontsize=9, bbox=paper, zorder=6)
    for poses, colour in (
        ([state.T_world_base for state in states], BASE_COLOUR),
        ([state.T_world_ee for state in states], EE_COLOUR),
    ):
        axes.plot(*np.array(poses)[:, :2, 3].T, color=colour, linewidth=1.8, zorder=3)


def legend_entries() -> list[Patch | Line2D]:
    """What the colours of a motion mean."""
    return [
        Line2D([], [], color=BASE_COLOUR, label="base, once a second"),
        Line2D([], [], color=EE_COLOUR, label="end effector"),
        Line2D([], [], color=GOAL_COLOUR, marker="*", linestyle="", markersize=11, label="goal"),
        Patch(facecolor=_HIGH_COLOUR, edgecolor=_EDGE_COLOUR, label="obstacle (darker: taller)"),
        Patch(
            facecolor=_LOW_COLOUR, edgecolor=_EDGE_COLOUR, hatch="////", label="not on the floor"
        ),
    ]


def extent(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corner of what is drawn, shape (2,) each, m."""
    corners = [patch.get_extents().get_points() for _, _, patch in _obstacles(scene)]
    points = np.vstack([*corners, [scene.start.base[:2], scene.goal.position[:2]]])
    return points.min(axis=0) - _MARGIN, points.max(axis=0) + _MARGIN


def _obstacles(scene: Scene) -> Iterator[tuple[float, float, Patch]]:
    """Height of the bottom and of the top, and the outline, of each obstacle."""
    for box in scene.boxes:
        c, s = np.cos(box.yaw), np.sin(box.yaw)
        (a, b, half_height), centre = box.half_extents, np.array(box.center[:2])
        corners = np.array([[a, b], [-a, b], [-a, -b], [a, -b]]) @ [[c, s], [-s, c]] + centre
        yield box.center[2] - half_height, box.center[2] + half_height, Polygon(corners)
    for cylinder in scene.cylinders:
        x, y, z = cylinder.center
        half_height = cylinder.half_height
        yield z - half_height, z + half_height, Circle((x, y), cylinder.radius)
    for sphere in scene.spheres:
        x, y, z = sphere.center
        yield z - sphere.radius, z + sphere.radius, Circle((x, y), sphere.radius)


@cache
def _footprint() -> FloatArray:
    """Outline of the base in its own frame, shape (n, 2), m; reading meshes takes a while."""
    points = np.vstack([part.vertices for part in collision_parts()[0]])[:, :2]
    outline: FloatArray = points[ConvexHull(points).vertices]
    return outline


def _outline(T: FloatArray, footprint: FloatArray, *, facecolor: str, alpha: float) -> Polygon:
    corners = footprint @ T[:2, :2].T + T[:2, 3]
    return Polygon(corners, facecolor=facecolor, edgecolor=BASE_COLOUR, alpha=alpha, zorder=2)
