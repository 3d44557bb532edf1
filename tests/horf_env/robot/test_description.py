"""The URDF and the meshes that it names."""

import importlib.util
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from horf_env.errors import MissingAssetError
from horf_env.robot import BODIES, LIMITS, collision_parts
from horf_env.robot.description import urdf_text


def test_all_meshes_of_the_urdf_exist():
    meshes = [mesh.get("filename") for mesh in ET.fromstring(urdf_text()).iter("mesh")]
    assert len(meshes) > 15
    assert all(Path(mesh).is_file() for mesh in meshes)


def test_missing_meshes_are_named_with_the_cure(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(MissingAssetError, match="pip install pybullet"):
        urdf_text()


def test_joint_limits_of_urdf_and_profiles_agree():
    joints = {joint.get("name"): joint for joint in ET.fromstring(urdf_text()).iter("joint")}
    limits = LIMITS["ld60"]
    for k in range(7):
        limit = joints[f"panda_joint{k + 1}"].find("limit")
        assert float(limit.get("lower")) == limits.arm_lower[k]
        assert float(limit.get("upper")) == limits.arm_upper[k]
        assert float(limit.get("velocity")) == limits.velocity[2 + k]


def test_the_base_is_an_ld60_and_bodies_are_closed_and_convex():
    parts = collision_parts()
    assert len(parts) == len(BODIES) == 9
    base = parts[0][0].vertices
    np.testing.assert_allclose(base.max(axis=0) - base.min(axis=0), [0.70, 0.50, 0.38])
    for body in parts:
        for part in body:
            corners = part.vertices[part.faces]
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            heights = np.einsum("fi,vi->fv", normals, part.vertices)
            offsets = np.einsum("fi,fi->f", normals, corners[:, 0])
            assert (heights <= offsets[:, None] + 1e-9).all()
