"""The nine bodies whose distances constrain the robot, and their geometry.

A body is a set of links without joints between them. Its geometry is a union of parts, one for each
element of the URDF.
"""

from __future__ import annotations

import io
from typing import cast

import yourdfpy

from horf_env.robot.description import resolve_mesh, urdf_text
from horf_env.robot.parts import Body, ConvexPart, Part, read_parts

BODIES: tuple[Body, ...] = (
    Body("base_link", ("base_link", "wheel_left", "wheel_right", "camera_link", "panda_link0")),
    *(Body(f"panda_link{k}", (f"panda_link{k}",)) for k in range(1, 8)),
    Body("panda_hand", ("panda_hand", "panda_leftfinger", "panda_rightfinger")),
)
"""Base with link0, link1 to link7, hand with fingers: the nine rows of the paper's A_avoi."""


def collision_parts() -> tuple[tuple[ConvexPart, ...], ...]:
    """Convex parts of each body of `BODIES`: what PyBullet collides with, less its margin of 1 mm.

    Raises:
        MissingAssetError: If the Panda's meshes are not installed.
    """
    parts = read_parts(_urdf(), BODIES, "collision", resolve_mesh)
    return cast("tuple[tuple[ConvexPart, ...], ...]", parts)


def visual_parts() -> tuple[tuple[Part, ...], ...]:
    """Parts of each body as the robot looks: what a camera sees and a real obstacle meets.

    Raises:
        MissingAssetError: If the Panda's meshes are not installed.
    """
    return read_parts(_urdf(), BODIES, "visual", resolve_mesh)


def _urdf() -> yourdfpy.URDF:
    return yourdfpy.URDF.load(io.StringIO(urdf_text()), load_meshes=False)
