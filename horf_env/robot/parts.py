"""Geometry of rigid bodies, read from the elements of a URDF."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import trimesh
import yourdfpy

from horf_env.errors import GeometryError
from horf_env.types import FloatArray

Elements = Literal["collision", "visual"]

_CYLINDER_SIDES = 96  # 0.05 % of the radius too large at most
_LEAST_VOLUME = 1e-12  # m^3: a cube of 0.1 mm; less is rounding of a sheet
_FLAT = "its geometry is flat; a body needs a volume"
_SPHERE_SUBDIVISIONS = 3  # 1280 faces, 0.5 % of the radius too large at most


@dataclass(frozen=True)
class Body:
    """A rigid group of links.

    Attributes:
        frame: Link in whose frame the geometry is given.
        links: All links of the group.
    """

    frame: str
    links: tuple[str, ...]


@dataclass(frozen=True)
class ConvexPart:
    """A convex piece of a body, in the body's frame.

    Attributes:
        vertices: Shape (V, 3), m.
        faces: Vertex indices of the triangles, outward orientation, shape (F, 3).
    """

    vertices: FloatArray
    faces: np.ndarray


@dataclass(frozen=True)
class MeshPart:
    """A piece of any shape, possibly open or intersecting itself, in the body's frame.

    Attributes:
        vertices: Shape (V, 3), m.
        faces: Vertex indices of the triangles, shape (F, 3).
    """

    vertices: FloatArray
    faces: np.ndarray


Part = ConvexPart | MeshPart
Resolve = Callable[[str], str]


def read_parts(
    urdf: yourdfpy.URDF, bodies: Sequence[Body], elements: Elements, resolve: Resolve
) -> tuple[tuple[Part, ...], ...]:
    """Parts of each body.

    Collision meshes become their convex hulls, which is what PyBullet collides with; visual meshes
    stay as they are. Cylinders and spheres become convex polyhedra around them, so a distance is
    never too large.

    Args:
        urdf: The robot, loaded without its meshes.
        bodies: Which links belong together.
        elements: Which elements to read.
        resolve: Turns the file name of a mesh in the URDF into a path.

    Raises:
        GeometryError: If a body has no geometry, a mesh no faces, or all lie in one plane.
        MissingAssetError: If a mesh does not exist, from `resolve`.
    """
    return tuple(tuple(_body_parts(urdf, body, elements, resolve)) for body in bodies)


def _body_parts(
    urdf: yourdfpy.URDF, body: Body, elements: Elements, resolve: Resolve
) -> Iterator[Part]:
    empty = True
    for link in body.links:
        T_body_link = urdf.get_transform(link, body.frame)
        entry = urdf.link_map[link]
        for element in entry.collisions if elements == "collision" else entry.visuals:
            empty = False
            origin = np.eye(4) if element.origin is None else element.origin
            yield _part(element.geometry, T_body_link @ origin, link, elements, resolve)
    if empty:
        raise GeometryError(
            body.frame, f"no {elements} geometry; give its link some, or leave the body out"
        )


def _part(
    geometry: yourdfpy.Geometry,
    T_body_part: FloatArray,
    link: str,
    elements: Elements,
    resolve: Resolve,
) -> Part:
    if geometry.mesh is None:
        mesh, convex = _primitive(geometry), True
    else:
        mesh, convex = _mesh(geometry.mesh, link, resolve), elements == "collision"
    if convex:
        mesh = _hull(mesh, link)
    mesh.apply_transform(T_body_part)
    kind = ConvexPart if convex else MeshPart
    return kind(np.array(mesh.vertices), np.array(mesh.faces))


def _primitive(geometry: yourdfpy.Geometry) -> trimesh.Trimesh:
    if geometry.box is not None:
        return trimesh.creation.box(extents=geometry.box.size)
    if geometry.cylinder is not None:
        radius = geometry.cylinder.radius / np.cos(np.pi / _CYLINDER_SIDES)
        return trimesh.creation.cylinder(radius, geometry.cylinder.length, sections=_CYLINDER_SIDES)
    sphere = trimesh.creation.icosphere(subdivisions=_SPHERE_SUBDIVISIONS)
    inner = np.einsum("fi,fi->f", sphere.face_normals, sphere.triangles_center).min()
    return sphere.apply_scale(geometry.sphere.radius / inner)


def _mesh(mesh: yourdfpy.Mesh, link: str, resolve: Resolve) -> trimesh.Trimesh:
    path = resolve(mesh.filename)
    try:
        loaded = trimesh.load(path, force="mesh")
    except Exception as error:  # each format has its own
        raise GeometryError(link, f"{path} cannot be read ({error}); try STL or OBJ") from error
    if len(loaded.faces) == 0:
        raise GeometryError(link, f"{path} has no faces; give it a mesh of triangles")
    return loaded if mesh.scale is None else loaded.apply_scale(mesh.scale)


def _hull(mesh: trimesh.Trimesh, link: str) -> trimesh.Trimesh:
    try:
        with np.errstate(invalid="ignore"):  # trimesh divides by the volume
            hull = mesh.convex_hull
            flat = hull.volume < _LEAST_VOLUME
    except Exception as error:  # qhull's own error class is private to scipy
        raise GeometryError(link, _FLAT) from error
    if flat:
        raise GeometryError(link, _FLAT)
    return hull
