"""Inputs and outputs of the planning jobs: plain records, so that core and archive need not import the jobs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from onboard import config
from onboard.planning.fences import Fence
from onboard.planning.mission_rule import MissionState
from onboard.records import F32, F64, U8, Decision, Gdem, Grid, Ldem, Pose, Scan

if TYPE_CHECKING:  # its module loads scipy, which the records do not need
    from onboard.planning.sensing.next_position import NextPosition


@dataclass(frozen=True, slots=True)
class PlanningSettings:
    """The parts of the configuration that planning reads."""

    rover: config.Rover
    mapping: config.Mapping_
    planning: config.Planning
    mission: config.Mission
    scanning: config.Scanning
    drive_guard: config.DriveGuard = config.DriveGuard()


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """Input of the planning job.

    ldem: the map window around the rover.
    pose: the rover's pose.
    goal_m: x, y of the goal.
    gdem: the orbiter's map; None: no orbital data, the goal lies in a straight line.
    state: mission state.
    settings: configuration.
    trail: (k, 3) x, y, yaw driven so far (R2).
    blocked_m: points whose cells no wheel may roll over, regardless of the map: the drive guard stopped at them.
    slippery_m: places where the wheels slipped; ground there costs more.
    fences: keep-outs are obstacles.
    sigma_m: 1 sigma of the rover's position in the plane.
    unseen_m: centres of cells that are unknown regardless of the map: beams should have seen them and did not.
    """

    ldem: Ldem
    pose: Pose
    goal_m: tuple[float, float]
    gdem: Gdem | None
    state: MissionState
    settings: PlanningSettings
    trail: F64
    blocked_m: tuple[tuple[float, float], ...] = ()
    slippery_m: tuple[tuple[float, float], ...] = ()
    fences: tuple[Fence, ...] = ()
    sigma_m: float = 0.0
    unseen_m: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class GuardLine:
    """One scan under the drive guard, with the axis at rest.

    scan: the scan.
    tilt_rad: tilt of the axis.
    pose: the estimate at the middle of the scan.
    """

    scan: Scan
    tilt_rad: float
    pose: Pose


@dataclass(frozen=True, slots=True)
class PlanReport:
    """Report of a plan, for the record and for people.

    grid: grid of the layers.
    node_sets: uint8 of NodeSet on `grid`.
    z_mean: float32 on `grid`.
    global_path: (k, 2) over the orbiter's map; without one the straight line; empty if there is no way.
    optimistic_path: (k, 2).
    next_position: result of the strategy, None if it was not asked.
    """

    grid: Grid
    node_sets: U8
    z_mean: F32
    global_path: F64
    optimistic_path: F64
    next_position: NextPosition | None


@dataclass(frozen=True, slots=True)
class PlanResult:
    """Output of the planning job.

    decision: the decision with its path.
    state: the mission's new state.
    report: report of the plan.
    pose: the rover's pose.
    goal_m: x, y of the goal.
    gdem: the orbiter's map, refreshed, as input of the next stop.
    """

    decision: Decision
    state: MissionState
    report: PlanReport
    pose: Pose
    goal_m: tuple[float, float]
    gdem: Gdem | None = None
