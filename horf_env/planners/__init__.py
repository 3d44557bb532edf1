"""Methods of the comparison that do not learn, one file each."""

from horf_env.planners.hra import HraPlanner
from horf_env.planners.oracle import OraclePlanner
from horf_env.planners.planner import Planner

PLANNERS: dict[str, type[Planner]] = {"hra": HraPlanner, "oracle": OraclePlanner}

__all__ = ["PLANNERS", "HraPlanner", "OraclePlanner", "Planner"]
