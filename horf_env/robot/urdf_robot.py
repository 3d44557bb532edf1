"""Any robot with a URDF and a fixed root: body poses and Jacobians for distance queries."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
import yourdfpy

from horf_env.errors import ConfigurationError, GeometryError, MissingAssetError, RobotFileError
from horf_env.robot.jacobians import shifted_jacobians
from horf_env.robot.joint_limits import check_limits
from horf_env.robot.parts import Body, Elements, Part, read_parts
from horf_env.types import FloatArray

_PACKAGE_PREFIX = "package://"
_JOINT_TYPES = ("fixed", "prismatic", "revolute")


@dataclass(frozen=True)
class BodyState:
    """Where the bodies of a robot are, and how its joints move them.

    Attributes:
        configuration: Shape (n,), rad or m.
        link_poses: T_world_body of the B bodies, shape (B, 4, 4).
        body_jacobians: See `RobotState`; shape (B, 6, n).
    """

    configuration: FloatArray
    link_poses: FloatArray
    body_jacobians: FloatArray


class UrdfRobot:
    """A tree of revolute and prismatic joints on a fixed root.

    Links without a joint between them form one body, named after the first of them. Groups without
    any geometry are no bodies. Not thread-safe: Pinocchio's work space is reused.

    Attributes:
        link_names: First link of each body.
        lower: Lower joint limits, shape (n,).
        upper: Upper joint limits, shape (n,).
    """

    def __init__(self, path: str | Path, *, mesh_folder: str | Path | None = None) -> None:
        """Read the URDF.

        Args:
            path: The URDF file.
            mesh_folder: What `package://` in it refers to; relative names of meshes are looked for
                there too. The folder of the file without it.

        Raises:
            MissingAssetError: If there is no such file.
            RobotFileError: If it is no valid URDF, or a joint is neither fixed nor prismatic nor
                revolute with limits.
            GeometryError: If no link has geometry.
        """
        path = Path(path)
        if not path.is_file():
            raise MissingAssetError(str(path), "give the path of a URDF file")
        self._mesh_folder = Path(mesh_folder) if mesh_folder else path.parent
        self._urdf, self._model = _read(path)
        self._data = self._model.createData()
        self._bodies = _bodies(self._urdf)
        self.link_names = tuple(body.frame for body in self._bodies)
        self.lower: FloatArray = np.array(self._model.lowerPositionLimit)
        self.upper: FloatArray = np.array(self._model.upperPositionLimit)
        self._frame_ids = [self._model.getFrameId(name, pin.BODY) for name in self.link_names]
        joints = [self._model.frames[k].parentJoint for k in self._frame_ids]
        self._moves = np.zeros((len(joints), self._model.nv))
        for row, joint in enumerate(joints):
            for ancestor in list(self._model.supports[joint])[1:]:  # the first is the universe
                self._moves[row, self._model.joints[ancestor].idx_v] = 1.0

    def parts(self, elements: Elements) -> tuple[tuple[Part, ...], ...]:
        """Parts of each body; see `read_parts` for the errors."""
        return read_parts(self._urdf, self._bodies, elements, self._resolve)

    def state(self, configuration: FloatArray) -> BodyState:
        """Run forward kinematics and all Jacobians once.

        Args:
            configuration: Shape (n,), rad or m.

        Raises:
            ConfigurationError: If it has another shape, is not finite or outside the limits.
        """
        q = np.array(configuration, dtype=float)
        self._check(q)
        pin.computeJointJacobians(self._model, self._data, q)
        pin.updateFramePlacements(self._model, self._data)
        poses = np.array([self._data.oMf[k].homogeneous for k in self._frame_ids])
        origins = np.ascontiguousarray(poses[:, :3, 3])
        rates = np.eye(self._model.nv)
        joints = self._data.J.reshape(6, -1)  # of a single joint Pinocchio gives a vector
        return BodyState(q, poses, shifted_jacobians(joints, rates, self._moves, origins))

    def _check(self, q: FloatArray) -> None:
        if q.shape != self.lower.shape or not np.isfinite(q).all():
            raise ConfigurationError(
                f"configuration: expected {len(self.lower)} finite numbers, got {q}"
            )
        names = list(self._model.names)[1:]  # the first is the universe
        check_limits(q.tolist(), self.lower.tolist(), self.upper.tolist(), names)

    def _resolve(self, filename: str) -> str:
        path = self._mesh_folder / filename.removeprefix(_PACKAGE_PREFIX).removeprefix("file://")
        if not path.is_file():
            raise MissingAssetError(str(path), "check the mesh folder that the robot was given")
        return str(path)


def _read(path: Path) -> tuple[yourdfpy.URDF, pin.Model]:
    """The file as both libraries see it."""
    try:
        urdf = yourdfpy.URDF.load(str(path), load_meshes=False)
        _check_joints(path, urdf)
        return urdf, pin.buildModelFromXML(path.read_text())
    except RobotFileError:
        raise
    except Exception as error:  # whatever the two libraries raise
        raise RobotFileError(str(path), f"no valid URDF ({error}); correct the file") from error


def _check_joints(path: Path, urdf: yourdfpy.URDF) -> None:
    for joint in urdf.joint_map.values():
        if joint.type not in _JOINT_TYPES:
            raise RobotFileError(
                str(path),
                f"joint {joint.name!r} is {joint.type}, supported are {', '.join(_JOINT_TYPES)}; "
                "make a continuous joint revolute with wide limits",
            )


def _bodies(urdf: yourdfpy.URDF) -> tuple[Body, ...]:
    """Groups of links that fixed joints hold together, from the root on."""
    group_of = {urdf.base_link: urdf.base_link}
    children = {joint.child: joint for joint in urdf.joint_map.values()}
    for link in _from_root(urdf):
        if link in children:
            joint = children[link]
            group_of[link] = group_of[joint.parent] if joint.type == "fixed" else link
    groups: dict[str, list[str]] = {}
    for link, group in group_of.items():
        groups.setdefault(group, []).append(link)
    bodies = tuple(
        Body(group, tuple(links))
        for group, links in groups.items()
        if any(urdf.link_map[link].collisions or urdf.link_map[link].visuals for link in links)
    )
    if not bodies:
        raise GeometryError(urdf.base_link, "no link of the robot has geometry; give them some")
    return bodies


def _from_root(urdf: yourdfpy.URDF) -> list[str]:
    """All links, each after its parent."""
    order = [urdf.base_link]
    for link in order:
        order.extend(j.child for j in urdf.joint_map.values() if j.parent == link)
    return order
