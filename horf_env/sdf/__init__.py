"""Robot-centric signed distance fields: geometry, filter grids, exact queries."""

from horf_env.sdf.robot_sdf import LinkDistances, RobotSdf, Witnesses

__all__ = ["LinkDistances", "RobotSdf", "Witnesses"]
