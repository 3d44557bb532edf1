"""The robot and its distance fields, loaded once for all tests."""

import pytest

from horf_env.robot import MobileManipulator
from horf_env.sdf import RobotSdf


@pytest.fixture(scope="session")
def robot():
    return MobileManipulator.load()


@pytest.fixture(scope="session")
def sdf(robot, tmp_path_factory):
    return RobotSdf.load(robot, cache_folder=tmp_path_factory.mktemp("fields"))
