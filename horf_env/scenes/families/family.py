"""What a scene family is."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from horf_env.scenes.scene import Scene


class SceneFamily(Protocol):
    """A random law for scenes.

    Attributes:
        name: Name of the family and of its scenes.
        base_path: Length of the base's path that the paper's Table 1 reports for HORF, m.
    """

    name: str
    base_path: float

    def generate(self, rng: np.random.Generator) -> Scene:
        """Draw a scene; equal generators give equal scenes."""
        ...
