"""Methods of the comparison that do not learn, one file each."""

from horf_env.planners.hra import HraPlanner
from horf_env.planners.mapped import MappedPlanner
from horf_env.planners.oracle import OraclePlanner
from horf_env.planners.planner import Planner

PLANNERS: dict[str, type[Planner]] = {
    "hra": HraPlanner,
    "mapped": MappedPlanner,
    "oracle": OraclePlanner,
}

__all__ = ["PLANNERS", "HraPlanner", "MappedPlanner", "OraclePlanner", "Planner"]
