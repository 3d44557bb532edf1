"""Scalars for the logger, of the last gradient step alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import torch as th

Report = Callable[[], Mapping[str, th.Tensor]]


class Diagnostics:
    """Keeps the newest report of each topic, and computes it when it is read.

    SB3's logger shows the last call of `train` before it writes; what the gradient steps before
    it would have said is never computed.
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
        """All numbers by name; a vector gives its mean and its elements, as name_1, name_2."""
        tensors: dict[str, th.Tensor] = {}
        for report in self._reports.values():
            for name, values in report().items():
                tensors[name] = values.mean()
                for i, value in enumerate(values if values.dim() else []):
                    tensors[f"{name}_{i + 1}"] = value
        if not tensors:
            return {}
        return dict(zip(tensors, th.stack(list(tensors.values())).tolist(), strict=True))
