"""Scalars for the logger, of the last gradient step alone, computed when they are read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import islice
from statistics import fmean

import torch as th

Report = Callable[[], Mapping[str, th.Tensor]]


class Diagnostics:
    """Keeps the newest report of each topic, and computes it when it is read.

    SB3's logger shows the last gradient step before it writes; what the steps before it would have
    said is never computed.
    """

    def __init__(self) -> None:
        self._reports: dict[str, Report] = {}

    def note(self, topic: str, report: Report) -> None:
        """Replace the report of a topic.

        Args:
            topic: What the report is about.
            report: Gives scalars, or vectors of one number a critic, by name. They are read after
                the step; tensors in it must not change or hold a graph.
        """
        self._reports[topic] = report

    def read(self) -> dict[str, float]:
        """All numbers by name, and forget them.

        A vector gives its mean and its elements, as name_1, name_2.
        """
        tensors = {k: v for report in self._reports.values() for k, v in report().items()}
        self._reports = {}
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
