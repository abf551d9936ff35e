"""Planner job for the measurement: a stop on rough ground with rocks, of the size used in flight."""

from __future__ import annotations

import numpy as np

from onboard.config import Config
from onboard.perception.map import ldem
from onboard.planning.mission_rule import MissionState
from onboard.planning.plan_records import PlanningSettings, PlanRequest
from onboard.records import Cloud, Grid, Pose

BEAMS, LINES = 520, 400  # of a sweep, within the sector
GOAL_M = (9.0, 2.0)


def request(config: Config) -> PlanRequest:
    """The request, the same each time: waves of 5 cm, and a rock of 30 cm every 2 m."""
    cells = round(config.mapping.size_m / config.mapping.cell_m)
    corner_m = -(cells - 1) / 2 * config.mapping.cell_m
    bearings = np.linspace(-config.scanning.sector_rad, config.scanning.sector_rad, BEAMS)
    ways_m = np.linspace(0.8, config.scanning.range_m, LINES)
    x_m, y_m = (np.outer(ways_m, turn).ravel() for turn in (np.cos(bearings), np.sin(bearings)))
    rock = np.hypot((x_m + 1.0) % 2.0 - 1.0, (y_m + 0.6) % 2.0 - 1.0) < 0.2
    z_m = 0.05 * np.sin(1.3 * x_m) * np.cos(0.9 * y_m) + 0.3 * rock
    ends_m = np.ascontiguousarray(np.column_stack([x_m, y_m, z_m]), np.float32)
    cloud = Cloud(np.array([config.rover.lidar_x_m, 0.0, config.rover.lidar_z_m]), ends_m, np.ones(len(x_m), bool))
    empty = ldem.empty(Grid(corner_m, corner_m, config.mapping.cell_m, cells, cells))
    start = ldem.assume_disc(empty, Pose(0.0, 0.0), config.mapping.assumed_m)
    return PlanRequest(
        ldem.insert(start, cloud, 0, config.mapping.near_m),
        Pose(0.0, 0.0),
        GOAL_M,
        None,
        MissionState(),
        PlanningSettings(config.rover, config.mapping, config.planning, config.mission, config.scanning),
        np.empty((0, 3)),
    )
