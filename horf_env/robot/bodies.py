"""The nine bodies whose distances constrain the robot, and their collision geometry.

A body is a set of links without joints between them. Its geometry is a union of convex parts, one
for each collision element of the URDF, because that is what PyBullet collides with: the convex
hull of each collision mesh (plus a margin of about 1 mm).
"""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
import trimesh
import yourdfpy

from horf_env.robot.description import resolve_mesh, urdf_text
from horf_env.types import FloatArray


@dataclass(frozen=True)
class Body:
    """A rigid group of links.

    Attributes:
        frame: Link in whose frame the geometry is given.
        links: All links of the group.
    """

    frame: str
    links: tuple[str, ...]


BODIES: tuple[Body, ...] = (
    Body("base_link", ("base_link", "camera_link", "panda_link0")),
    *(Body(f"panda_link{k}", (f"panda_link{k}",)) for k in range(1, 8)),
    Body("panda_hand", ("panda_hand", "panda_leftfinger", "panda_rightfinger")),
)
"""Base with link0, link1 to link7, hand with fingers: the nine rows of the paper's A_avoi."""


@dataclass(frozen=True)
class ConvexPart:
    """A convex piece of a body, in the body's frame.

    Attributes:
        vertices: Shape (V, 3), m.
        faces: Vertex indices of the triangles, outward orientation, shape (F, 3).
    """

    vertices: FloatArray
    faces: np.ndarray


def collision_parts() -> tuple[tuple[ConvexPart, ...], ...]:
    """Convex parts of each body of `BODIES`, read from the URDF's collision elements.

    Raises:
        MissingAssetError: If the Panda's meshes are not installed.
    """
    urdf = yourdfpy.URDF.load(io.StringIO(urdf_text()), load_meshes=False)
    return tuple(
        tuple(
            part
            for link in body.links
            for part in _link_parts(urdf, link, urdf.get_transform(link, body.frame))
        )
        for body in BODIES
    )


def _link_parts(urdf: yourdfpy.URDF, link: str, T_body_link: FloatArray) -> list[ConvexPart]:
    parts = []
    for collision in urdf.link_map[link].collisions:
        hull = _mesh(collision.geometry).convex_hull
        origin = np.eye(4) if collision.origin is None else collision.origin
        hull.apply_transform(T_body_link @ origin)
        parts.append(ConvexPart(np.array(hull.vertices), np.array(hull.faces)))
    return parts


def _mesh(geometry: yourdfpy.Geometry) -> trimesh.Trimesh:
    if geometry.box is not None:
        return trimesh.creation.box(extents=geometry.box.size)
    return trimesh.load(resolve_mesh(geometry.mesh.filename), force="mesh")
