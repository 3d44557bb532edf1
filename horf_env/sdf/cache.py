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

from horf_env.sdf.fields import PADDINGS, RESOLUTION, Fields, build_fields
from horf_env.sdf.geometry import BodyGeometry

_LOG = logging.getLogger(__name__)
_FORMAT = 2  # raise when the meaning of the stored arrays changes


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
            return _read(path, n_parts=len(geometry.part_start) - 1)
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            _LOG.warning("distance fields in %s are unusable (%s): building them anew", path, error)
    fields = build_fields(geometry)
    try:
        _write(path, fields)
    except OSError as error:
        _LOG.warning("distance fields could not be stored in %s: %s", path, error)
    return fields


def _digest(geometry: BodyGeometry) -> str:
    digest = hashlib.sha256(f"{_FORMAT} {RESOLUTION} {PADDINGS}".encode())
    digest.update(geometry.faces.tobytes())
    digest.update(geometry.part_start.tobytes())
    return digest.hexdigest()[:24]


def _read(path: Path, n_parts: int) -> Fields:
    with np.load(path, allow_pickle=False) as stored:
        fields = Fields(stored["nodes"], stored["near_faces"], stored["frames"])
    expected = (n_parts * len(PADDINGS) * RESOLUTION**3, 4)
    if fields.nodes.shape != expected or fields.nodes.dtype != np.float32:
        raise ValueError(f"holds {fields.nodes.shape}, expected {expected}")
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
