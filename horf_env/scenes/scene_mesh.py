"""Triangles of a scene in the world frame, for the ray-casting depth camera and for viewers."""

from __future__ import annotations

import numpy as np
import trimesh

from horf_env.scenes.scene import Box, Cylinder, Scene, Sphere
from horf_env.types import FloatArray, IntArray

CYLINDER_SECTIONS = 32
"""Circumscribed polygon: its corners stick out by 0.5 % of the radius (1 mm for r = 0.2 m)."""

SPHERE_SUBDIVISIONS = 3
"""Circumscribed icosphere, 1280 faces: its corners stick out by about 1 % of the radius."""

FLOOR_MARGIN = 5.0
"""The floor reaches this far beyond the obstacles, m: the range of the depth camera."""


def triangles(scene: Scene, *, floor: bool = False) -> tuple[FloatArray, IntArray]:
    """All obstacles as one triangle mesh with outward orientation.

    Boxes are exact. Cylinders and spheres are circumscribed, so a ray hits at most the corner
    height named beside each constant too early, and never too late.

    Args:
        scene: The scene.
        floor: Also add a rectangle at z = 0 (seen from above) under all of it.

    Returns:
        Vertices (V, 3) in m, and vertex indices of the faces (F, 3).
    """
    meshes = [
        *map(_box_mesh, scene.boxes),
        *map(_cylinder_mesh, scene.cylinders),
        *map(_sphere_mesh, scene.spheres),
    ]
    if floor:
        meshes.append(_floor_mesh(scene, meshes))
    if not meshes:
        return np.empty((0, 3)), np.empty((0, 3), dtype=np.int64)
    mesh = trimesh.util.concatenate(meshes)
    return np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)


def _box_mesh(box: Box) -> trimesh.Trimesh:
    pose = trimesh.transformations.rotation_matrix(box.yaw, [0, 0, 1])
    pose[:3, 3] = box.center
    return trimesh.creation.box(extents=2 * np.array(box.half_extents), transform=pose)


def _cylinder_mesh(cylinder: Cylinder) -> trimesh.Trimesh:
    mesh = trimesh.creation.cylinder(
        radius=cylinder.radius / np.cos(np.pi / CYLINDER_SECTIONS),
        height=2 * cylinder.half_height,
        sections=CYLINDER_SECTIONS,
    )
    return mesh.apply_translation(cylinder.center)


def _sphere_mesh(sphere: Sphere) -> trimesh.Trimesh:
    mesh = trimesh.creation.icosphere(subdivisions=SPHERE_SUBDIVISIONS)
    inscribed = np.einsum("fi,fi->f", mesh.face_normals, mesh.triangles_center).min()
    return mesh.apply_scale(sphere.radius / inscribed).apply_translation(sphere.center)


def _floor_mesh(scene: Scene, meshes: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    start = [[*scene.start.base[:2], 0.0]]
    corners = np.vstack([start, *(mesh.bounds for mesh in meshes)])[:, :2]
    (x0, y0), (x1, y1) = corners.min(axis=0) - FLOOR_MARGIN, corners.max(axis=0) + FLOOR_MARGIN
    vertices = [[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]]
    return trimesh.Trimesh(vertices=vertices, faces=[[0, 1, 2], [0, 2, 3]], process=False)
