"""Simulation of the robot among obstacles. The only package that imports PyBullet."""

from horf_env.simulation.clearance import Clearance
from horf_env.simulation.motion import MODES, MoveResult
from horf_env.simulation.rendering import Viewpoint
from horf_env.simulation.world import PyBulletWorld, WorldState

__all__ = ["MODES", "Clearance", "MoveResult", "PyBulletWorld", "Viewpoint", "WorldState"]
