"""Build the request of a planning job: map window around the rover, pose, trail, fences and known bad places."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from onboard.config import Config
from onboard.perception.map import ldem
from onboard.planning.fences import Fence
from onboard.planning.mission_rule import MissionState
from onboard.planning.plan_records import PlanningSettings, PlanRequest
from onboard.records import F64, Gdem, Pose

if TYPE_CHECKING:
    from onboard.perception.map.stop_map import StopMap


def stands_on(memory: StopMap, pose: Pose, config: Config) -> bool:
    """Return whether the map covers the ground under the rover; a goto then need not scan behind first."""
    return ldem.knows(memory.cells, pose.x_m, pose.y_m, config.rover.body_length_m / 2)


def plan_request(
    memory: StopMap,
    pose: Pose,
    goal_m: tuple[float, float],
    gdem: Gdem | None,
    config: Config,
    fences: tuple[Fence, ...],
    *,
    state: MissionState | None = None,
    trail: F64 | None = None,
    sigma_m: float = 0.0,
) -> PlanRequest:
    """Build the request of one stop. trail: None before any driving; sigma_m: position uncertainty, 1 sigma."""
    here = np.array([[pose.x_m, pose.y_m, pose.yaw_rad]])
    return PlanRequest(
        ldem=ldem.window(memory.cells, pose.x_m, pose.y_m, config.mapping.size_m),
        pose=pose,
        goal_m=goal_m,
        gdem=gdem,
        state=state or MissionState(),
        settings=PlanningSettings(
            config.rover, config.mapping, config.planning, config.mission, config.scanning, config.drive_guard
        ),
        trail=here if trail is None else trail,
        blocked_m=memory.blocked_m,
        slippery_m=memory.slippery_m,
        unseen_m=memory.unseen_m,
        fences=fences,
        sigma_m=sigma_m,
    )
