"""Physics servers and the robot's URDF in them.

Every call to PyBullet names its server: without that, two environments in one process would move
each other's robots. `pybullet_utils.BulletClient` does so by itself, but it writes a line to stdout
for each server, where results belong.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from xml.etree import ElementTree

import pybullet

from horf_env.robot.description import mesh_root, urdf_text


def connect() -> int:
    """Start a physics server in this process, without a window; returns its number."""
    client: int = pybullet.connect(pybullet.DIRECT)
    return client


class RobotFile:
    """The robot's URDF as a file, until it is closed.

    PyBullet reads files only, and it keeps the text of each file name for ever: a new name for each
    load would leak 14 kB a load.

    Attributes:
        path: Where the file is.
    """

    def __init__(self) -> None:
        """Write the file.

        Raises:
            MissingAssetError: If the Panda's meshes are not installed.
        """
        text = _with_meshes_for_boxes(urdf_text())
        self._folder = tempfile.TemporaryDirectory(prefix="horf-")
        self.path = str(Path(self._folder.name, "horf.urdf"))
        Path(self.path).write_text(text)

    def close(self) -> None:
        """Delete the file. Closing twice is fine."""
        self._folder.cleanup()


def _with_meshes_for_boxes(urdf: str) -> str:
    """The URDF with a mesh in the place of each box that collides.

    PyBullet grows hulls of meshes by its margin of 1 mm, but takes it away from boxes before, so
    that their edges are round. As meshes, all links of the robot collide by the same rule.
    """
    root = ElementTree.fromstring(urdf)
    for geometry in root.iterfind("link/collision/geometry"):
        for box in geometry.findall("box"):
            geometry.remove(box)
            cube = {"filename": str(mesh_root() / "cube.obj"), "scale": box.attrib["size"]}
            ElementTree.SubElement(geometry, "mesh", cube)
    return ElementTree.tostring(root, encoding="unicode")


def load_robot(client: int, file: RobotFile, *, visuals: bool) -> int:
    """Load the robot with its virtual root fixed in the world.

    Args:
        client: Where to load it.
        file: Its URDF.
        visuals: Load the visual meshes instead of the collision meshes. They take several times as
            long, and only pictures need them.

    Returns:
        Index of the body.
    """
    ignored = (
        pybullet.URDF_IGNORE_COLLISION_SHAPES if visuals else pybullet.URDF_IGNORE_VISUAL_SHAPES
    )
    body: int = pybullet.loadURDF(
        file.path,
        useFixedBase=True,
        flags=ignored | pybullet.URDF_USE_INERTIA_FROM_FILE,
        physicsClientId=client,
    )
    return body


def movable_joints(client: int, body: int) -> list[int]:
    """Indices of the joints that are not fixed: those of the configuration, in its order."""
    count = pybullet.getNumJoints(body, physicsClientId=client)
    return [
        j
        for j in range(count)
        if pybullet.getJointInfo(body, j, physicsClientId=client)[2] != pybullet.JOINT_FIXED
    ]
