"""What a recording holds, read back without a viewer."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rerun.chunk import Chunk, RrdReader

from horf_env.errors import HorfEnvError
from horf_env.recording import names
from horf_env.types import FloatArray

_NANOSECONDS = 1e9

Properties = dict[str, str | int | float | bool]


class RecordingError(HorfEnvError):
    """A file that cannot be read as a recording.

    Attributes:
        path: The file.
        reason: What is wrong with it.
    """

    def __init__(self, path: Path, reason: str) -> None:
        self.path = path
        self.reason = reason
        super().__init__(f"{path}: {reason}")


@dataclass(frozen=True)
class RecordingSummary:
    """What a recording holds.

    Attributes:
        path: The file.
        properties: What was said about the episode when it was saved; `outcome` is "success" or
            how it failed.
        timelines: First and last value of each timeline, steps or s.
        entities: Paths of all entities with data.
        steps: Steps after the reset.
        duration: Simulated time [s].
        min_distance: Least clearance in the episode [m]; nan if the recording has none.
    """

    path: Path
    properties: Properties
    timelines: dict[str, tuple[float, float]]
    entities: tuple[str, ...]
    steps: int
    duration: float
    min_distance: float

    @property
    def success(self) -> bool:
        """Whether the episode ended at the goal."""
        return self.properties.get("outcome") == "success"


def summarise(path: Path) -> RecordingSummary:
    """Read what a recording of an episode holds.

    Raises:
        RecordingError: If the file cannot be read, or holds no episode of this package.
    """
    chunks = _chunks(path)
    properties = _properties(chunks)
    clearance = _column(chunks, names.CLEARANCE, "Scalars:scalars")
    if properties is None:
        raise RecordingError(path, "a Rerun recording, but not of an episode of this package")
    timelines = _timelines(chunks)
    return RecordingSummary(
        path=path,
        properties=properties,
        timelines=timelines,
        entities=tuple(sorted({chunk.entity_path for chunk in chunks})),
        steps=round(timelines.get(names.STEP_TIMELINE, (0.0, 0.0))[1]),
        duration=timelines.get(names.TIME_TIMELINE, (0.0, 0.0))[1],
        min_distance=float(clearance.min()) if clearance.size else float("nan"),
    )


def _chunks(path: Path) -> list[Chunk]:
    try:
        with warnings.catch_warnings():
            # A truncated file warns here before it fails below, with the better text.
            warnings.simplefilter("ignore")
            return list(RrdReader(path).stream())
    except (RuntimeError, ValueError) as error:
        raise RecordingError(path, str(error)) from error


def _properties(chunks: list[Chunk]) -> Properties | None:
    entity = f"/__properties/{names.EPISODE_PROPERTIES}"
    for chunk in chunks:
        if chunk.entity_path == entity:
            (row,) = chunk.to_record_batch().to_pylist()
            return {name: value[0] for name, value in row.items() if isinstance(value, list)}
    return None


def _column(chunks: list[Chunk], entity: str, component: str) -> FloatArray:
    """All values of a component with one number a row."""
    columns = [
        chunk.to_record_batch().column(component).flatten().to_numpy()
        for chunk in chunks
        if chunk.entity_path == entity and not chunk.is_static
    ]
    return np.concatenate(columns) if columns else np.empty(0)


def _timelines(chunks: list[Chunk]) -> dict[str, tuple[float, float]]:
    ranges: dict[str, tuple[float, float]] = {}
    for chunk in chunks:
        for name in chunk.timeline_names:
            values = chunk.to_record_batch().column(name).cast("int64").to_numpy() / _unit(name)
            first, last = ranges.get(name, (np.inf, -np.inf))
            ranges[name] = (min(first, float(values.min())), max(last, float(values.max())))
    return ranges


def _unit(timeline: str) -> float:
    """Ticks of a timeline's integers in one step or second."""
    return _NANOSECONDS if timeline == names.TIME_TIMELINE else 1.0
