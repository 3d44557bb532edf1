"""Scene files for single purposes."""

import json

import numpy as np
import pytest

from horf_env.robot import ARM_READY

TOOL_DOWN = [1.0, 0.0, 0.0, 0.0]


@pytest.fixture
def scene_file(tmp_path):
    """Writes a scene with the robot at the origin and returns its path."""

    def write(boxes=(), goal=(1.6, 0.3, 0.6), quaternion=None, **changes):
        scene = {
            "name": "single",
            "boxes": [dict(zip(("center", "half_extents", "yaw"), b, strict=True)) for b in boxes],
            "cylinders": [],
            "spheres": [],
            "start": {"base": [0.0, 0.0, 0.0], "arm": ARM_READY.tolist()},
            "goal": {"position": list(goal), "quaternion_xyzw": quaternion or TOOL_DOWN},
        } | changes
        path = tmp_path / f"scene{len(list(tmp_path.iterdir()))}.json"
        path.write_text(json.dumps(scene))
        return str(path)

    return write


@pytest.fixture
def rng():
    return np.random.default_rng(0)
