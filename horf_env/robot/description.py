"""The robot's URDF with its mesh paths resolved to the installed `pybullet_data` package."""

from __future__ import annotations

import importlib.util
from importlib import resources
from pathlib import Path

from horf_env.errors import MissingAssetError

_PACKAGE_PREFIX = "package://"
_PROBE = "franka_panda/meshes/collision/link0.obj"


def mesh_root() -> Path:
    """Folder to which `package://` in the URDF refers.

    Found without importing PyBullet: the meshes are data, the engine is not needed for them.

    Raises:
        MissingAssetError: If `pybullet_data` or the Panda's meshes are not installed.
    """
    spec = importlib.util.find_spec("pybullet_data")
    folders = (spec.submodule_search_locations or []) if spec else []
    for folder in folders:
        if (Path(folder) / _PROBE).is_file():
            return Path(folder)
    raise MissingAssetError(
        f"pybullet_data/{_PROBE}", "the Panda's meshes come with it; run `pip install pybullet`"
    )


def resolve_mesh(filename: str) -> str:
    """Absolute path of a mesh named in the URDF."""
    return str(mesh_root() / filename.removeprefix(_PACKAGE_PREFIX))


def urdf_text() -> str:
    """The URDF with absolute mesh paths: neither PyBullet nor viewers resolve `package://` here."""
    text = resources.files("horf_env.robot").joinpath("assets/horf.urdf").read_text()
    return text.replace(_PACKAGE_PREFIX, f"{mesh_root()}/")
