"""The instances of each scene family that are proven to be feasible.

A planner that is none of the compared methods has solved each of them; see
benchmarks/make_instances.py. For each family the package holds one file with the instances of three
splits: those of the test split as whole scenes, frozen, the others as seeds from which the family
draws them again. A hash of each scene tells if a file was damaged, or a family changed after its
instances had been proven.
"""

from __future__ import annotations

import hashlib
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from horf_env.errors import HorfEnvError, UnknownNameError
from horf_env.scenes.families import SCENES, SceneFamily
from horf_env.scenes.scene import Scene
from horf_env.scenes.validation import scene_file_error


class Split(NamedTuple):
    """How many instances a split has, and from which seed on they are looked for."""

    first_seed: int
    size: int


SPLITS: MappingProxyType[str, Split] = MappingProxyType(
    {
        "test": Split(0, 50),
        "validation": Split(1_000_000, 20),
        "training": Split(2_000_000, 300),
    }
)
"""The splits; about 1.5 seeds are tried for each instance, so that their ranges never meet."""


class InstanceIndexError(HorfEnvError, IndexError):
    """A split has no instance of this number."""


class StaleInstanceError(HorfEnvError, ValueError):
    """A scene is not the one that was proven to be feasible.

    Attributes:
        name: Scene family.
        seed: Seed of the scene.
    """

    def __init__(self, name: str, seed: int) -> None:
        self.name = name
        self.seed = seed
        super().__init__(
            f"scene {name!r}, seed {seed}: its hash differs from that of the proven scene. The "
            "file is damaged (reinstall the package), or the family or NumPy's random streams "
            "changed (run benchmarks/make_instances.py again)"
        )


@dataclass(frozen=True, config=ConfigDict(extra="forbid", allow_inf_nan=False))
class Instance:
    """A scene that is proven to be feasible.

    Attributes:
        seed: Seed from which the family draws it.
        path_length: Length of the base's path that the planner found, m.
        sha256: `scene_hash` of the scene.
        scene: The scene itself, if it is frozen.
    """

    seed: int
    path_length: float
    sha256: str
    scene: Scene | None = None


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class InstanceFile:
    """The instances of one family by split, each in the order of seeds."""

    test: tuple[Instance, ...] = ()
    validation: tuple[Instance, ...] = ()
    training: tuple[Instance, ...] = ()


def test_instance(name: str, k: int) -> Scene:
    """Instance k of the frozen test set of a scene family.

    Args:
        name: Name of the family.
        k: Number of the instance, from 0 on.

    Raises:
        UnknownNameError: If there is no such family.
        InstanceIndexError: If there is no such instance.
        StaleInstanceError: If its hash is wrong.
    """
    return _scene(name, _pick(name, "test", k))


def validation_instance(name: str, k: int) -> Scene:
    """Instance k of the validation split; errors as for `test_instance`."""
    return _scene(name, _pick(name, "validation", k))


def training_instance(name: str, rng: np.random.Generator) -> Scene:
    """A random instance of the training split; errors as for `test_instance`."""
    return _scene(name, _pick(name, "training", int(rng.integers(len(instances(name).training)))))


def planner_path_length(name: str, k: int) -> float:
    """Length of the base's path by which the planner solved test instance k, m."""
    return _pick(name, "test", k).path_length


def random_scene(name: str, seed: int) -> Scene:
    """The scene that a family draws from a seed, feasible or not.

    Raises:
        UnknownNameError: If there is no such family.
    """
    return _family(name).generate(np.random.default_rng(seed))


def scene_hash(scene: Scene) -> str:
    """SHA-256 of the scene's JSON, as hexadecimal digits."""
    return hashlib.sha256(scene.to_json().encode()).hexdigest()


@cache
def instances(name: str) -> InstanceFile:
    """All instances of a family. The packaged file does not change: it is read once.

    Raises:
        UnknownNameError: If there is no such family.
        SceneFileError: If the file is malformed.
    """
    file = resources.files("horf_env.scenes").joinpath(f"instances/{_family(name).name}.json")
    return parse_instances(file.read_bytes(), source=f"instances/{name}.json")


def parse_instances(text: str | bytes, *, source: str) -> InstanceFile:
    """Read the text of a file of instances.

    Raises:
        SceneFileError: With the field's path and what was expected there.
    """
    try:
        return TypeAdapter(InstanceFile).validate_json(text, strict=True)
    except ValidationError as error:
        raise scene_file_error(source, error) from None


def _family(name: str) -> SceneFamily:
    if name not in SCENES:
        raise UnknownNameError("scene", name, SCENES)
    return SCENES[name]


def _pick(name: str, split: str, k: int) -> Instance:
    found: tuple[Instance, ...] = getattr(instances(name), split)
    if not 0 <= k < len(found):
        raise InstanceIndexError(
            f"{split} instance {k} of scene {name!r}: expected 0 to {len(found) - 1}"
        )
    return found[k]


def _scene(name: str, instance: Instance) -> Scene:
    scene = instance.scene or random_scene(name, instance.seed)
    if scene_hash(scene) != instance.sha256:
        raise StaleInstanceError(name, instance.seed)
    return scene
