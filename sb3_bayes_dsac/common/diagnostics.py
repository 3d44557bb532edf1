"""Means of scalars over many gradient steps, read from the device once."""

from __future__ import annotations

from collections import defaultdict

import torch as th


class ScalarMeans:
    """Collects scalar tensors by name without waiting for their values."""

    def __init__(self) -> None:
        self._values: defaultdict[str, list[th.Tensor]] = defaultdict(list)

    def add(self, **scalars: th.Tensor) -> None:
        """Note one value of each name."""
        for name, scalar in scalars.items():
            self._values[name].append(scalar.detach())

    def read(self) -> dict[str, float]:
        """Mean of what was noted of each name; the only place that waits for the device."""
        if not self._values:
            return {}
        means = th.stack([th.stack(values).mean() for values in self._values.values()])
        return dict(zip(self._values, means.tolist(), strict=True))
