"""Table of the local planners: `PLANNERS` maps the names of `planning.planner` in the configuration to classes.

Each class has `plan(problem) -> Plan` (`contract`). A new planner is a file here and a row in the table.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from onboard.planning.local.contract import Planner
from onboard.planning.local.distance_transform import DistanceTransformPlanner
from onboard.planning.local.pose_planner import PoseFieldPlanner

PLANNERS: Mapping[str, type[Planner]] = MappingProxyType(
    {
        "pose-field": PoseFieldPlanner,
        "distance-transform": DistanceTransformPlanner,
    }
)
