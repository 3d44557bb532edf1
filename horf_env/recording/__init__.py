"""Rerun recordings of episodes: writing them, and reading what they hold."""

from horf_env.recording.recorder import EpisodeRecorder
from horf_env.recording.summary import RecordingError, RecordingSummary, summarise

__all__ = ["EpisodeRecorder", "RecordingError", "RecordingSummary", "summarise"]
