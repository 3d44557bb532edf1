"""Where an environment's scenes come from: a family by name, all of them, or one scene file."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np

from horf_env.errors import UnknownNameError
from horf_env.scenes.families import SCENES
from horf_env.scenes.instances import test_instance, training_instance, validation_instance
from horf_env.scenes.scene import Scene, load_scene

MIXED = "mixed"
"""Name of the source that draws from all families."""

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


class MixedSource:
    """Instances of all families: instance k is instance k // n of family k mod n."""

    def pick(
        self, rng: np.random.Generator, *, instance: int | None = None, split: str = "test"
    ) -> Scene:
        """See `FamilySource`."""
        if instance is None:
            name = list(SCENES)[rng.integers(len(SCENES))]
            return FamilySource(name).pick(rng, split=split)
        name, number = _of_all(instance)
        return FamilySource(name).pick(rng, instance=number, split=split)


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
    """Source for a family's name, for "mixed", or for the path of a scene file.

    Raises:
        UnknownNameError: If it is no such name and does not look like a path.
        SceneFileError: If the file cannot be used.
    """
    if scene in SCENES:
        return FamilySource(scene)
    if scene == MIXED:
        return MixedSource()
    path = Path(scene)
    if path.suffix == ".json" or path.exists():
        return FileSource(path)
    raise UnknownNameError("scene", scene, [*SCENES, MIXED])


def family_instance(scene: str, instance: int) -> tuple[str, int] | None:
    """Family and number in it of an instance of a family or of all; None for a scene file."""
    if scene in SCENES:
        return scene, instance
    return _of_all(instance) if scene == MIXED else None


def _of_all(instance: int) -> tuple[str, int]:
    """Family and number in it of an instance of all families."""
    names = list(SCENES)
    return names[instance % len(names)], instance // len(names)
