"""Collects the steps of an episode and writes them as one Rerun file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import rerun as rr

from horf_env.perception.camera import CameraModel
from horf_env.recording import names
from horf_env.recording.layout import blueprint
from horf_env.recording.motion import log_paths, send_bodies, send_views
from horf_env.recording.samples import Sample, View, sample, view
from horf_env.recording.series import send_series
from horf_env.recording.stage import log_camera, log_robot, log_scene
from horf_env.records import StepRecord
from horf_env.scenes.scene import Scene

_STEPS_A_VIEW = 2  # images and clouds at 10 Hz, everything else at the 20 Hz of the steps

Property = str | int | float | bool


class EpisodeRecorder:
    """Buffers one episode; nothing is written before `save`.

    Columns written at the end are about a hundred times cheaper than one log call a step and
    entity, and a run that records costs its environment no time.
    """

    def __init__(self) -> None:
        self._samples: list[Sample] = []
        self._views: list[View] = []

    def add(self, record: StepRecord) -> None:
        """Take the record that the environment made at reset or at a step, in that order."""
        step = len(self._samples)
        if step % _STEPS_A_VIEW == 0:
            self._views.append(view(record, step))
        self._samples.append(sample(record))

    def save(
        self,
        path: Path,
        *,
        scene: Scene,
        camera: CameraModel,
        properties: Mapping[str, Property],
    ) -> None:
        """Write the episode; the file appears under its name when it is complete.

        Args:
            path: File to write, usually "*.rrd"; replaced if it exists.
            scene: Scene of the episode.
            camera: Camera that took the depth images.
            properties: What to know about the episode (method, scene, seed, outcome, ...); the
                versions of this package and of Rerun are added.

        Raises:
            ValueError: If no step was added.
            OSError: If the file cannot be written.
        """
        if not self._samples:
            raise ValueError("nothing to save: add at least the record of the reset")
        unfinished = path.with_name(f".{path.name}.part")
        unfinished.touch()  # an unwritable folder is an OSError here and a mere log line in Rerun
        stream = rr.RecordingStream(names.APPLICATION)
        stream.save(unfinished, default_blueprint=blueprint(self._samples, scene.goal.position))
        self._write(stream, scene, camera, properties)
        stream.disconnect()
        os.replace(unfinished, path)

    def _write(
        self,
        stream: rr.RecordingStream,
        scene: Scene,
        camera: CameraModel,
        properties: Mapping[str, Property],
    ) -> None:
        versions = {"horf_version": version("horf"), "rerun_version": rr.__version__}
        values: dict[str, Any] = {**properties, **versions}
        stream.send_property(names.EPISODE_PROPERTIES, rr.AnyValues(**values))
        log_scene(stream, scene)
        log_robot(stream)
        log_camera(stream, camera)
        log_paths(stream, self._samples)
        send_bodies(stream, self._samples)
        send_views(stream, self._views)
        send_series(stream, self._samples)
