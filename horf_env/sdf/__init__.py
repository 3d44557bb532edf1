"""Robot-centric signed distance fields: geometry, filter grids, exact queries."""

from horf_env.sdf.robot_sdf import RobotSdf
from horf_env.sdf.witnesses import LinkDistances, Witnesses

__all__ = ["LinkDistances", "RobotSdf", "Witnesses"]
