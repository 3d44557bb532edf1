"""A scene: obstacles, the robot's start and the goal of its end effector, and the JSON form of it.

Pydantic dataclasses: frozen like the standard library's, and the same declaration validates files.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass
from scipy.spatial.transform import Rotation

from horf_env.errors import SceneFileError
from horf_env.scenes.validation import WHOLE_FILE, scene_file_error
from horf_env.types import FloatArray

_CONFIG = ConfigDict(extra="forbid", allow_inf_nan=False)

_UNIT_NORM_TOLERANCE = 1e-3
"""Files with three decimals are fine; a wrong component is not."""


def _unit(quaternion: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    norm = math.hypot(*quaternion)
    if abs(norm - 1.0) > _UNIT_NORM_TOLERANCE:
        raise ValueError(f"a unit quaternion (x, y, z, w); its norm is {norm:.6g}")
    return quaternion


Vector3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
UnitQuaternion = Annotated[tuple[float, float, float, float], AfterValidator(_unit)]
Arm = tuple[float, float, float, float, float, float, float]


@dataclass(frozen=True, config=_CONFIG)
class Box:
    """A cuboid that stands upright.

    Attributes:
        center: Shape (3,), m.
        half_extents: Half of the edge lengths, each > 0, m.
        yaw: Rotation about the vertical axis through the centre, rad.
    """

    center: Vector3
    half_extents: tuple[Positive, Positive, Positive]
    yaw: float


@dataclass(frozen=True, config=_CONFIG)
class Cylinder:
    """A cylinder whose axis is vertical; centre, radius and half of its height in m."""

    center: Vector3
    radius: Positive
    half_height: Positive


@dataclass(frozen=True, config=_CONFIG)
class Sphere:
    """A sphere; centre and radius in m."""

    center: Vector3
    radius: Positive


@dataclass(frozen=True, config=_CONFIG)
class Start:
    """Where the robot starts.

    Attributes:
        base: (x, y, theta), m and rad.
        arm: Joint angles q1 to q7, rad.
    """

    base: Vector3
    arm: Arm


@dataclass(frozen=True, config=_CONFIG)
class Goal:
    """Pose that the end effector has to reach.

    Attributes:
        position: Shape (3,), m.
        quaternion_xyzw: Orientation in the world; the z axis of the EE is the approach direction.
    """

    position: Vector3
    quaternion_xyzw: UnitQuaternion

    @property
    def pose(self) -> FloatArray:
        """The same as a homogeneous transform, shape (4, 4)."""
        T = np.eye(4)
        T[:3, :3] = Rotation.from_quat(self.quaternion_xyzw).as_matrix()
        T[:3, 3] = self.position
        return T


@dataclass(frozen=True, config=_CONFIG)
class Scene:
    """Obstacles above the floor z = 0 (which is implied), start and goal.

    Constructing one with invalid numbers raises `pydantic.ValidationError`.
    """

    name: Annotated[str, Field(min_length=1)]
    boxes: tuple[Box, ...]
    cylinders: tuple[Cylinder, ...]
    spheres: tuple[Sphere, ...]
    start: Start
    goal: Goal

    @classmethod
    def from_json(cls, text: str | bytes, *, source: str = "scene") -> Scene:
        """Read a scene, strictly: no missing key, no unknown key, finite numbers only.

        Args:
            text: JSON text.
            source: What to call the text in an error, usually its file name.

        Raises:
            SceneFileError: With the field's path and what was expected there.
        """
        try:
            return _ADAPTER.validate_json(text, strict=True)
        except ValidationError as error:
            raise scene_file_error(source, error) from None

    def to_json(self) -> str:
        """The scene as one line of JSON; numbers survive the round trip exactly."""
        return _ADAPTER.dump_json(self).decode()


_ADAPTER = TypeAdapter(Scene)


def load_scene(path: str | Path) -> Scene:
    """Read a scene file.

    Raises:
        SceneFileError: If the file cannot be read or does not hold a scene.
    """
    try:
        text = Path(path).read_bytes()
    except OSError as error:
        raise SceneFileError(str(path), WHOLE_FILE, f"a readable file; {error.strerror}") from error
    return Scene.from_json(text, source=str(path))
