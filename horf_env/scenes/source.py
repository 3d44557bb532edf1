"""Where an environment's scenes come from: a family by name, or one scene file."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np

from horf_env.errors import UnknownNameError
from horf_env.scenes.families import SCENES
from horf_env.scenes.instances import test_instance, training_instance, validation_instance
from horf_env.scenes.scene import Scene, load_scene

_SPLITS = {"test": test_instance, "validation": validation_instance}


class SceneSource(Protocol):
    """Picks the scene of an episode."""

    def pick(
        self, rng: np.random.Generator, *, instance: int | None = None, split: str = "test"
    ) -> Scene:
        """Scene of the next episode.

        Args:
            rng: Generator for a random training instance.
            instance: Number of a frozen instance instead of a random one.
            split: Set of the frozen instance: "test" or "validation".
        """


class FamilySource:
    """Instances of one of the four scene families."""

    def __init__(self, family: str) -> None:
        self._family = family

    def pick(
        self, rng: np.random.Generator, *, instance: int | None = None, split: str = "test"
    ) -> Scene:
        """See `SceneSource`.

        Raises:
            UnknownNameError: If there is no such split.
            ValueError: If the split has no instance of that number.
        """
        if split not in _SPLITS:
            raise UnknownNameError("split", split, _SPLITS)
        if instance is None:
            return training_instance(self._family, rng)
        return _SPLITS[split](self._family, instance)


class FileSource:
    """One scene from a file, always the same."""

    def __init__(self, path: Path) -> None:
        self._scene = load_scene(path)

    def pick(
        self, rng: np.random.Generator, *, instance: int | None = None, split: str = "test"
    ) -> Scene:
        """See `SceneSource`.

        Raises:
            ValueError: If an instance is asked for: a file holds one scene.
        """
        if instance is not None:
            raise ValueError(
                f"instance {instance}: a scene file holds one scene; leave the option out"
            )
        return self._scene


def scene_source(scene: str) -> SceneSource:
    """Source for a family's name or for the path of a scene file.

    Raises:
        UnknownNameError: If it is neither a family nor looks like a path.
        SceneFileError: If the file cannot be used.
    """
    if scene in SCENES:
        return FamilySource(scene)
    path = Path(scene)
    if path.suffix == ".json" or path.exists():
        return FileSource(path)
    raise UnknownNameError("scene", scene, SCENES)
