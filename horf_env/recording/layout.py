"""How the viewer arranges a recording."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun.blueprint as rrb

from horf_env.recording import names
from horf_env.recording.samples import Sample
from horf_env.scenes.scene import Vector3

_EYE_DIRECTION = np.array([-0.45, -0.65, 0.9])  # from what it looks at; steep enough for walls
_EYE_DISTANCE = 1.1  # parts of the extent of what is to be seen
_LEAST_EXTENT = 6.0  # m


def blueprint(samples: Sequence[Sample], goal: Vector3) -> rrb.Blueprint:
    """3D view on the left; depth image and curves on the right.

    Args:
        samples: The episode, so that the eye looks at where the robot goes.
        goal: Position of the goal [m], which is in sight as well.
    """
    plots = rrb.Vertical(
        rrb.Spatial2DView(origin=names.CAMERA, name="Depth camera"),
        rrb.Tabs(
            rrb.TimeSeriesView(origin=names.BODY_DISTANCES, name="Body distances"),
            rrb.TimeSeriesView(origin=names.CLEARANCE, name="True clearance"),
        ),
        rrb.Tabs(
            rrb.TimeSeriesView(origin=names.LINEAR_TWIST, name="Linear twist"),
            rrb.TimeSeriesView(origin=names.ANGULAR_TWIST, name="Angular twist"),
        ),
        rrb.Tabs(
            rrb.TimeSeriesView(origin=names.REWARD, name="Reward"),
            rrb.TimeSeriesView(origin=names.QP_SLACK, name="QP slack"),
            rrb.TimeSeriesView(origin=names.QP_TIME, name="QP solve time"),
        ),
        row_shares=[3, 2, 2, 2],
    )
    return rrb.Blueprint(
        rrb.Horizontal(_world_view(samples, goal), plots, column_shares=[3, 2]),
        rrb.TimePanel(
            state="collapsed",
            timeline=names.TIME_TIMELINE,
            play_state="playing",
            loop_mode="all",
        ),
        collapse_panels=True,
    )


def _world_view(samples: Sequence[Sample], goal: Vector3) -> rrb.Spatial3DView:
    seen = np.array([*(sample.link_poses[0, :3, 3] for sample in samples), goal])
    lower, upper = seen.min(axis=0), seen.max(axis=0)
    target = 0.5 * (lower + upper)
    distance = _EYE_DISTANCE * max(float(np.linalg.norm(upper - lower)), _LEAST_EXTENT)
    return rrb.Spatial3DView(
        origin=names.WORLD,
        # The depth image has a view of its own; here it would be a second cloud.
        contents=["+ $origin/**", f"- {names.DEPTH}"],
        name="World",
        background=[245, 246, 248],
        line_grid=False,
        eye_controls=rrb.EyeControls3D(
            position=target + distance * _EYE_DIRECTION, look_target=target
        ),
    )
