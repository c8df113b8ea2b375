"""From a chosen candidate to a timed, collision-checked plan of the arm's motion."""

from sr_mj.planning.config import PlannerConfig, SearchConfig
from sr_mj.planning.plan import PICK_PHASES, PLACE_PHASES, Phase, Plan, Segment
from sr_mj.planning.planner import Planner
from sr_mj.planning.straight import straight_poses

__all__ = [
    "PICK_PHASES",
    "PLACE_PHASES",
    "Phase",
    "Plan",
    "Planner",
    "PlannerConfig",
    "SearchConfig",
    "Segment",
    "straight_poses",
]
