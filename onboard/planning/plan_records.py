"""What the planning jobs are asked and what they answer: plain records; core and archive need not know the jobs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from onboard import config
from onboard.planning.fences import Fence
from onboard.planning.mission_rule import MissionState
from onboard.records import F32, F64, U8, Decision, Gdem, Grid, Ldem, Pose, Scan

if TYPE_CHECKING:  # its module loads scipy, and the records travel without it
    from onboard.planning.next_position import NextPosition


@dataclass(frozen=True, slots=True)
class Settings:
    """The parts of the configuration that planning reads."""

    rover: config.Rover
    mapping: config.Mapping_
    planning: config.Planning
    mission: config.Mission
    scanning: config.Scanning
    drive_guard: config.DriveGuard = config.DriveGuard()


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """What the job is given. ldem: the window around the rover. trail: (k, 3) x, y, yaw driven so far (R2).

    gdem None: nothing is known from orbit, the goal lies in a straight line. blocked_m: points whose cells no wheel may
    roll over, whatever the map says: the drive guard stopped at them. slippery_m: where the wheels slipped: dear
    ground. unseen_m: centres of cells that are unknown whatever the map says: beams should have told of them and did
    not. fences: keep-outs are obstacles. sigma_m: 1 sigma of the pose's place in the plan.
    """

    ldem: Ldem
    pose: Pose
    goal_m: tuple[float, float]
    gdem: Gdem | None
    state: MissionState
    settings: Settings
    trail: F64
    blocked_m: tuple[tuple[float, float], ...] = ()
    slippery_m: tuple[tuple[float, float], ...] = ()
    fences: tuple[Fence, ...] = ()
    sigma_m: float = 0.0
    unseen_m: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class GuardLine:
    """One turn of the scanner while the drive guard holds it: scan, tilt, the estimate at its middle."""

    scan: Scan
    tilt_rad: float
    pose: Pose


@dataclass(frozen=True, slots=True)
class PlanReport:
    """For the record and for people. node_sets: uint8 of NodeSet, z_mean: float32, both on `grid`.

    global_path: (k, 2) over the orbiter's map, empty where there is none. optimistic_path: (k, 2). next_position: what
    the strategy found, None where it was not asked.
    """

    grid: Grid
    node_sets: U8
    z_mean: F32
    global_path: F64
    optimistic_path: F64
    next_position: NextPosition | None


@dataclass(frozen=True, slots=True)
class PlanResult:
    """The decision with its path, the mission's new state, the report; where the rover stood and wanted to go.

    gdem: the orbiter's map as the next stop is to be given it, brought up to date by what was seen from here.
    """

    decision: Decision
    state: MissionState
    report: PlanReport
    pose: Pose
    goal_m: tuple[float, float]
    gdem: Gdem | None = None
