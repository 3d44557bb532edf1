"""Scalars for the logger, of the last gradient step alone, computed when they are read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import islice
from statistics import fmean
from typing import NamedTuple

import torch as th

Report = Callable[..., Mapping[str, th.Tensor]]


class Note(NamedTuple):
    """A report that nobody has asked for yet.

    Attributes:
        report: Gives scalars, or vectors of one number a critic, by name.
        tensors: What it is given.
    """

    report: Report
    tensors: tuple[th.Tensor, ...]


class Diagnostics:
    """Keeps the newest report of each topic, and computes it when it is read.

    SB3's logger shows the last gradient step before it writes; what the steps before it would have
    said is never computed.

    Attributes:
        notes: The newest of each topic.
    """

    def __init__(self) -> None:
        self.notes: dict[str, Note] = {}

    def note(self, topic: str, report: Report, *tensors: th.Tensor) -> None:
        """Replace the note of a topic.

        Args:
            topic: What the report is about.
            report: Gives scalars, or vectors of one number a critic, by name.
            tensors: Its arguments. They are read after the step, so they must not change or hold a
                graph.
        """
        self.notes[topic] = Note(report, tensors)

    def read(self) -> dict[str, float]:
        """All numbers by name, and forget them.

        A vector gives its mean and its elements, as name_1, name_2.
        """
        tensors = {
            k: v for note in self.notes.values() for k, v in note.report(*note.tensors).items()
        }
        self.notes = {}
        if not tensors:
            return {}
        # One transfer for all: a number at a time costs more than the arithmetic behind it.
        numbers = iter(th.cat([values.flatten() for values in tensors.values()]).tolist())
        scalars: dict[str, float] = {}
        for name, values in tensors.items():
            elements = list(islice(numbers, values.numel()))
            scalars[name] = fmean(elements)
            if values.dim():
                scalars |= {f"{name}_{i}": element for i, element in enumerate(elements, 1)}
        return scalars
