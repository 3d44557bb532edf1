from __future__ import annotations

from functools import cache

import pytest

from horf_env.scenes.instances import random_scene
from horf_env.scenes.scene import Box, Cylinder, Goal, Scene, Sphere, Start

READY = (0.0, -0.3, 0.0, -2.2, 0.0, 2.0, 0.785398)


@cache
def drawn(name: str, seed: int) -> Scene:
    return random_scene(name, seed)


def make_scene(*bodies: Box | Cylinder | Sphere) -> Scene:
    return Scene(
        name="test",
        boxes=tuple(b for b in bodies if isinstance(b, Box)),
        cylinders=tuple(b for b in bodies if isinstance(b, Cylinder)),
        spheres=tuple(b for b in bodies if isinstance(b, Sphere)),
        start=Start((-3.0, 0.5, 0.1), READY),
        goal=Goal((1.0, 2.0, 0.7), (0.0, 0.0, 0.0, 1.0)),
    )


@pytest.fixture
def scene_of():
    """Builds a scene from bodies."""
    return make_scene


@pytest.fixture
def draw():
    """Draws the scene of a family and a seed, each only once."""
    return drawn


@pytest.fixture
def small_scene() -> Scene:
    return make_scene(
        Box((2.0, 0.0, 0.5), (0.3, 0.4, 0.5), 0.3),
        Box((0.0, 2.0, 0.9), (0.4, 0.1, 0.2), -1.1),
        Cylinder((0.0, -2.0, 0.4), 0.25, 0.4),
        Sphere((1.0, -1.0, 0.2), 0.3),
    )
