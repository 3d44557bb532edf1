"""Recordings of trials."""

from __future__ import annotations

from pathlib import Path

from horf_env.recording import EpisodeRecorder

from .environments import Env, reach_env
from .episodes import Trial


def save_recording(
    recorder: EpisodeRecorder, env: Env, trial: Trial, *, split: str, path: Path
) -> None:
    """Write the episode that has just ended.

    Args:
        recorder: Has seen all of it.
        env: Where it took place, not reset since.
        trial: Its result.
        split: Set of its instance.
        path: File to write.
    """
    inner = reach_env(env)
    recorder.save(
        path,
        scene=inner.scene,
        camera=inner.camera,
        properties={
            "method": trial.method,
            "scene": trial.scene,
            "split": split,
            "instance": trial.instance,
            "seed": trial.instance,
            "outcome": trial.outcome,
        },
    )
