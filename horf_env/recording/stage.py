"""What stands still in a recording: meshes of the robot, obstacles, goal, camera."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np
import rerun as rr
import trimesh

from horf_env.perception.camera import CameraModel
from horf_env.recording import names
from horf_env.robot import BODIES, ConvexPart, collision_parts
from horf_env.scenes.scene import Scene
from horf_env.scenes.scene_mesh import triangles

_ARM_COLOUR = (232, 232, 232)
_BODY_COLOURS = MappingProxyType({"base_link": (72, 78, 88), "panda_hand": (150, 158, 168)})
_OBSTACLE_COLOUR = (181, 148, 112)
_FLOOR_COLOUR = (205, 205, 200)
_GOAL_COLOUR = (213, 60, 40)
_FLOOR_DEPTH = 0.01  # m; the floor is drawn this far below z = 0, or it flickers with box bottoms
_FLOOR_MARGIN = 1.0  # m around everything that stands on it
_GOAL_AXES = 0.25  # m, the size of the hand
_GOAL_RADIUS = 0.03  # m, the tolerance of the task
_FRUSTUM_LENGTH = 0.4  # m
_SMOOTH_ANGLE = np.radians(35.0)  # edges sharper than this stay visible


def log_robot(stream: rr.RecordingStream) -> None:
    """Meshes of the nine bodies in their own frames.

    They are the convex parts that everything else computes with. The URDF's visual meshes have
    100,000 triangles, which would be the larger part of a recording.
    """
    for body, parts in zip(BODIES, collision_parts(), strict=True):
        mesh = trimesh.util.concatenate([_shaded(part) for part in parts])
        colour = _BODY_COLOURS.get(body.frame, _ARM_COLOUR)
        stream.log(f"{names.ROBOT}/{body.frame}", _mesh(mesh, colour), static=True)


def log_scene(stream: rr.RecordingStream, scene: Scene) -> None:
    """Obstacles, the floor under them, and the goal with its axes."""
    stream.log(names.WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    vertices, faces = triangles(scene)
    if len(faces):
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        mesh.unmerge_vertices()  # every face of a box has a normal of its own
        stream.log(f"{names.SCENE}/obstacles", _mesh(mesh, _OBSTACLE_COLOUR), static=True)
    stream.log(f"{names.SCENE}/floor", _floor(scene, vertices), static=True)
    stream.log(
        names.GOAL,
        rr.Transform3D(
            translation=scene.goal.position,
            quaternion=rr.Quaternion(xyzw=scene.goal.quaternion_xyzw),
        ),
        rr.TransformAxes3D(_GOAL_AXES),
        rr.Points3D([[0.0, 0.0, 0.0]], radii=_GOAL_RADIUS, colors=_GOAL_COLOUR),
        static=True,
    )


def log_camera(stream: rr.RecordingStream, camera: CameraModel) -> None:
    """The pinhole on the base; it moves because the base does."""
    fx, fy = camera.focal_lengths
    T = camera.T_base_camera
    stream.log(
        names.CAMERA,
        rr.Transform3D(translation=T[:3, 3], mat3x3=T[:3, :3]),
        rr.Pinhole(
            focal_length=(fx, fy),
            principal_point=(0.5 * camera.width, 0.5 * camera.height),
            width=camera.width,
            height=camera.height,
            camera_xyz=rr.ViewCoordinates.RDF,
            image_plane_distance=_FRUSTUM_LENGTH,
        ),
        static=True,
    )


def _shaded(part: ConvexPart) -> trimesh.Trimesh:
    mesh = trimesh.Trimesh(part.vertices, part.faces)
    return trimesh.graph.smooth_shade(mesh, angle=_SMOOTH_ANGLE)


def _mesh(mesh: trimesh.Trimesh, colour: tuple[int, int, int]) -> rr.Mesh3D:
    return rr.Mesh3D(
        vertex_positions=np.asarray(mesh.vertices, dtype=np.float32),
        triangle_indices=np.asarray(mesh.faces, dtype=np.uint32),
        vertex_normals=np.asarray(mesh.vertex_normals, dtype=np.float32),
        albedo_factor=colour,
    )


def _floor(scene: Scene, vertices: np.ndarray) -> rr.Boxes3D:
    points = np.vstack([vertices[:, :2], [scene.start.base[:2], scene.goal.position[:2]]])
    lower, upper = points.min(axis=0) - _FLOOR_MARGIN, points.max(axis=0) + _FLOOR_MARGIN
    return rr.Boxes3D(
        mins=[[*lower, -2.0 * _FLOOR_DEPTH]],
        sizes=[[*(upper - lower), _FLOOR_DEPTH]],
        colors=_FLOOR_COLOUR,
        fill_mode="solid",
    )
