"""Fields on disk, in the user's cache folder, under a hash of all that they depend on."""

from __future__ import annotations

import hashlib
import io
import logging
import os
import tempfile
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs

from horf_env.sdf.fields import (
    CONVEX,
    MESH,
    Fields,
    build_fields,
    grid_frames,
    grid_rows,
    mesh_grids,
    row_count,
)
from horf_env.sdf.geometry import BodyGeometry
from horf_env.sdf.packing import pack, unpack
from horf_env.types import FloatArray

_LOG = logging.getLogger(__name__)
_FORMAT = 4  # raise when the meaning of the stored arrays changes


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
            return _read(path, grid_frames(geometry), mesh_grids(geometry))
        except Exception as error:  # a damaged file makes zipfile and numpy raise almost anything
            _LOG.warning("distance fields in %s are unusable (%s): building them anew", path, error)
    fields = build_fields(geometry)
    try:
        _write(path, fields, mesh_grids(geometry))
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


def _read(path: Path, frames: FloatArray, is_mesh: np.ndarray) -> Fields:
    with zipfile.ZipFile(path) as stored:
        if not np.array_equal(_array(stored, "frames"), frames):
            raise ValueError("its grids are others")
        n_convex, n_mesh = row_count(frames[~is_mesh]), row_count(frames[is_mesh])
        convex = _checked(_array(stored, "nodes"), np.float32, (n_convex, 4))
        near_faces = _checked(_array(stored, "near_faces"), np.int32, (n_convex,))
        packed = _checked(_array(stored, "packed"), np.int16, (n_mesh, 3))
        steps = _checked(_array(stored, "steps"), np.float64, (is_mesh.sum(),))
    nodes = np.empty((n_convex + n_mesh, 4), dtype=np.float32)
    nodes[:n_convex] = convex
    for frame, step in zip(frames[is_mesh], steps, strict=True):
        rows = grid_rows(frame)
        unpack(packed[rows.start - n_convex : rows.stop - n_convex], step, nodes[rows])
    return Fields(nodes, near_faces, frames)


def _array(stored: zipfile.ZipFile, name: str) -> np.ndarray:
    """An array of the file, whose check sum is only looked at if all of it is read at once."""
    array: np.ndarray = np.load(io.BytesIO(stored.read(f"{name}.npy")), allow_pickle=False)
    return array


def _checked(array: np.ndarray, dtype: type, shape: tuple[int, ...]) -> np.ndarray:
    if array.dtype != dtype or array.shape != shape:
        raise ValueError(f"holds {array.dtype} {array.shape}, expected {dtype.__name__} {shape}")
    return array


def _stored(fields: Fields, is_mesh: np.ndarray) -> dict[str, Any]:
    """Arrays of the file: nodes of convex parts as they are, those of meshes packed."""
    n_convex = len(fields.near_faces)
    packed = [(np.empty((0, 3), dtype=np.int16), 0.0)]
    packed += [pack(fields.nodes[grid_rows(frame)]) for frame in fields.frames[is_mesh]]
    return {
        "nodes": fields.nodes[:n_convex],
        "near_faces": fields.near_faces,
        "frames": fields.frames,
        "packed": np.concatenate([numbers for numbers, _ in packed]),
        "steps": np.array([step for _, step in packed[1:]]),
    }


def _write(path: Path, fields: Fields, is_mesh: np.ndarray) -> None:
    """Write under a temporary name and rename, so that no reader sees half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, **_stored(fields, is_mesh))
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
