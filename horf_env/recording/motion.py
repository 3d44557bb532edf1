"""What moves in a recording, written as columns: bodies, paths, depth images, clouds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr
from scipy.spatial.transform import Rotation

from horf_env.recording import names
from horf_env.recording.samples import DEPTH_UNITS_PER_METRE, Sample, View
from horf_env.robot import BODIES
from horf_env.types import FloatArray

_BASE_PATH_COLOUR = (0, 114, 178)
_EE_PATH_COLOUR = (230, 159, 0)
_CLOUD_COLOUR = (0, 158, 115)
_PATH_RADIUS = 0.015  # m
_CLOUD_RADIUS = 0.012  # m
_PATH_HEIGHT = 0.02  # m; the path of the base lies this far above the floor
_EE_AXES = 0.15  # m


def timelines(steps: Sequence[int], times: Sequence[float]) -> list[rr.TimeColumn]:
    """Both timelines, for `send_columns`."""
    return [
        rr.TimeColumn(names.STEP_TIMELINE, sequence=steps),
        rr.TimeColumn(names.TIME_TIMELINE, duration=times),
    ]


def send_bodies(stream: rr.RecordingStream, samples: Sequence[Sample]) -> None:
    """Poses of the nine bodies and of the end effector."""
    poses = np.array([sample.link_poses for sample in samples])
    for k, body in enumerate(BODIES):
        _send_poses(stream, f"{names.ROBOT}/{body.frame}", samples, poses[:, k])
    _send_poses(stream, names.EE, samples, np.array([sample.T_world_ee for sample in samples]))
    stream.log(names.EE, rr.TransformAxes3D(_EE_AXES), static=True)


def log_paths(stream: rr.RecordingStream, samples: Sequence[Sample]) -> None:
    """Ways of base and end effector, whole from the start of the recording."""
    base = np.array([sample.link_poses[0, :3, 3] for sample in samples])
    base[:, 2] += _PATH_HEIGHT
    ee = np.array([sample.T_world_ee[:3, 3] for sample in samples])
    for entity, path, colour in (
        (names.BASE_PATH, base, _BASE_PATH_COLOUR),
        (names.EE_PATH, ee, _EE_PATH_COLOUR),
    ):
        strip = rr.LineStrips3D([path], colors=colour, radii=_PATH_RADIUS)
        stream.log(entity, strip, static=True)


def send_views(stream: rr.RecordingStream, views: Sequence[View]) -> None:
    """Depth images and clouds."""
    index = timelines([view.step for view in views], [view.time for view in views])
    height, width = views[0].depth.shape
    image_format = rr.components.ImageFormat(
        width=width, height=height, channel_datatype=rr.ChannelDatatype.U16
    )
    stream.log(
        names.DEPTH,
        rr.DepthImage.from_fields(format=image_format, meter=DEPTH_UNITS_PER_METRE),
        static=True,
    )
    buffers = [view.depth.tobytes() for view in views]
    stream.send_columns(names.DEPTH, index, rr.DepthImage.columns(buffer=buffers))
    stream.log(
        names.CLOUD,
        rr.Points3D.from_fields(colors=_CLOUD_COLOUR, radii=_CLOUD_RADIUS),
        static=True,
    )
    points = rr.Points3D.columns(positions=np.concatenate([view.points for view in views]))
    lengths = [len(view.points) for view in views]
    stream.send_columns(names.CLOUD, index, points.partition(lengths))


def _send_poses(
    stream: rr.RecordingStream, entity: str, samples: Sequence[Sample], poses: FloatArray
) -> None:
    stream.send_columns(
        entity,
        timelines(range(len(samples)), [sample.time for sample in samples]),
        rr.Transform3D.columns(
            translation=poses[:, :3, 3],
            quaternion=Rotation.from_matrix(poses[:, :3, :3]).as_quat(),
        ),
    )
