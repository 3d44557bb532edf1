"""What stands about in a room."""

from __future__ import annotations

import numpy as np

from horf_env.scenes.families.furniture import Furniture, ball, barrel, chair, crate


def random_clutter(rng: np.random.Generator) -> Furniture:
    """A crate, a barrel, a ball or a chair of random size."""
    kind = rng.choice(["crate", "barrel", "ball", "chair"], p=[0.4, 0.15, 0.1, 0.35])
    if kind == "crate":
        return crate(rng.uniform(0.3, 0.8), rng.uniform(0.3, 0.8), rng.uniform(0.3, 1.2))
    if kind == "barrel":
        return barrel(rng.uniform(0.15, 0.3), rng.uniform(0.5, 1.1))
    return ball(rng.uniform(0.2, 0.35)) if kind == "ball" else chair()
