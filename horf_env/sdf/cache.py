"""Fields on disk, in the user's cache folder, under a hash of all that they depend on."""

from __future__ import annotations

import hashlib
import logging
import os
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import platformdirs

from horf_env.sdf.fields import CONVEX, MESH, Fields, build_fields, grid_frames, row_count
from horf_env.sdf.geometry import BodyGeometry
from horf_env.types import FloatArray

_LOG = logging.getLogger(__name__)
_FORMAT = 3  # raise when the meaning of the stored arrays changes


def cached_fields(geometry: BodyGeometry, folder: Path | None = None) -> Fields:
    """Fields from the cache, or built and stored there.

    A file that cannot be read or has another shape is rebuilt, with a warning that says so. A
    folder that cannot be written costs the time to build again, with a warning as well.

    Args:
        geometry: Parts of the bodies.
        folder: Where to look; the user's cache folder without it.
    """
    folder = folder or Path(platformdirs.user_cache_dir("horf")) / "sdf"
    path = folder / f"{_digest(geometry)}.npz"
    if path.exists():
        try:
            return _read(path, grid_frames(geometry))
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            _LOG.warning("distance fields in %s are unusable (%s): building them anew", path, error)
    fields = build_fields(geometry)
    try:
        _write(path, fields)
    except OSError as error:
        _LOG.warning("distance fields could not be stored in %s: %s", path, error)
    return fields


def _digest(geometry: BodyGeometry) -> str:
    digest = hashlib.sha256(f"{_FORMAT} {CONVEX} {MESH}".encode())
    digest.update(geometry.faces.tobytes())
    digest.update(geometry.part_start.tobytes())
    for mesh in geometry.meshes:
        if mesh is not None:
            digest.update(mesh.vertices.tobytes())
            digest.update(mesh.faces.tobytes())
    return digest.hexdigest()[:24]


def _read(path: Path, frames: FloatArray) -> Fields:
    with np.load(path, allow_pickle=False) as stored:
        fields = Fields(stored["nodes"], stored["near_faces"], stored["frames"])
    if not np.array_equal(fields.frames, frames):
        raise ValueError("its grids are others")
    n_rows = len(fields.near_faces)
    if fields.nodes.shape != (n_rows, 4) or n_rows != row_count(frames):
        raise ValueError(f"holds {fields.nodes.shape}, expected {(row_count(frames), 4)}")
    if fields.nodes.dtype != np.float32 or fields.near_faces.dtype != np.int32:
        raise ValueError(f"holds {fields.nodes.dtype} and {fields.near_faces.dtype}")
    return fields


def _write(path: Path, fields: Fields) -> None:
    """Write under a temporary name and rename, so that no reader sees half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, nodes=fields.nodes, near_faces=fields.near_faces, frames=fields.frames)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
