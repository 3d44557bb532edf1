"""The numbers of an episode as named curves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np
import rerun as rr

from horf_env.recording import names
from horf_env.recording.motion import timelines
from horf_env.recording.samples import ActionSample, Sample
from horf_env.robot import BODIES
from horf_env.task import RewardTerms
from horf_env.types import FloatArray

# Colours that colour-blind people tell apart (Okabe and Ito), then their darker relatives.
_COLOURS = (
    (0, 114, 178),
    (230, 159, 0),
    (0, 158, 115),
    (204, 121, 167),
    (86, 180, 233),
    (213, 94, 0),
    (160, 150, 20),
    (120, 120, 120),
    (90, 60, 150),
)


@dataclass(frozen=True)
class Series:
    """Curves that share a plot; their last value belongs to the last step of the episode.

    Attributes:
        entity: Where they are stored.
        labels: Name of each of the k curves, with its unit.
        values: Shape (n, k).
    """

    entity: str
    labels: Sequence[str]
    values: FloatArray


def send_series(stream: rr.RecordingStream, samples: Sequence[Sample]) -> None:
    """Write all curves that these samples have."""
    clearance = np.array([[sample.min_distance] for sample in samples])
    actions = [sample.action for sample in samples if sample.action is not None]
    _send(stream, Series(names.CLEARANCE, ["clearance [m]"], clearance), samples)
    if actions:
        for series in (*_twists(actions), _rewards(actions), *_of_the_layer(actions)):
            _send(stream, series, samples)


def _send(stream: rr.RecordingStream, series: Series, samples: Sequence[Sample]) -> None:
    steps = range(len(samples) - len(series.values), len(samples))
    width = len(series.labels)
    style = rr.SeriesLines(names=series.labels, colors=_COLOURS[:width])
    stream.log(series.entity, style, static=True)
    stream.send_columns(
        series.entity,
        timelines(steps, [samples[step].time for step in steps]),
        rr.Scalars.columns(scalars=series.values.ravel()).partition([width] * len(steps)),
    )


def _twists(actions: Sequence[ActionSample]) -> Iterator[Series]:
    wanted = np.array([action.twist_wanted for action in actions])
    achieved = np.array([action.twist_achieved for action in actions])
    for entity, part, unit in (
        (names.LINEAR_TWIST, slice(0, 3), "m/s"),
        (names.ANGULAR_TWIST, slice(3, 6), "rad/s"),
    ):
        labels = [f"{kind} {axis} [{unit}]" for kind in ("wanted", "achieved") for axis in "xyz"]
        yield Series(entity, labels, np.hstack([wanted[:, part], achieved[:, part]]))


def _rewards(actions: Sequence[ActionSample]) -> Series:
    terms = [field.name for field in fields(RewardTerms)]
    rows = [[*(getattr(a.reward, term) for term in terms), a.reward.total] for a in actions]
    return Series(names.REWARD, [*terms, "total"], np.array(rows, dtype=float))


def _of_the_layer(actions: Sequence[ActionSample]) -> Iterator[Series]:
    """What only some action layers have."""
    distances = [a.body_distances for a in actions if a.body_distances is not None]
    slacks = [[a.slack] for a in actions if a.slack is not None]
    times = [[1e3 * a.solve_time] for a in actions if a.solve_time is not None]
    if distances:
        labels = [f"{body.frame} [m]" for body in BODIES]
        yield Series(names.BODY_DISTANCES, labels, np.array(distances))
    if slacks:
        yield Series(names.QP_SLACK, ["row slack [m/s]"], np.array(slacks))
        yield Series(names.QP_TIME, ["solve time [ms]"], np.array(times))
