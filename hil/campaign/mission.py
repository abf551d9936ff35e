"""Mission of a campaign's flight: to the goal of a field, with keep-outs along its edges, and its observer.

The bench has no ground beyond its fields: a look over an edge sees nothing, and the planner would look for a way there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from hil.records import PlantState
from hil.run.in_process import CAMPAIGN_STEP_NS, GOTO_S, InMemory, Rover
from hil.scenarios.model import Scenario, ground_of
from hil.terrain.field import Field
from hil.terrain.obstacle import Obstacle
from hil.world.operator import TimedCommand
from onboard import config
from onboard.motion.kinematics import wheel_places
from onboard.records import F64, Grid, Inputs, Outputs
from protocol.conventions import wrap_rad
from protocol.link.transactions import RequestState
from protocol.tables.modes import Phase

LIMIT_S = 3600.0
KEEP_OUT_M = 0.6  # from the field's edge; the bench ends a flight whose body's middle is 0.5 m from it
_TICKS = 50  # between two looks at the covariance
_PLACE_AND_YAW = (0, 1, 3)  # of the filter's x, y, z, yaw


def bench_to_goal(scenario: Scenario) -> InMemory:
    """Return the bench of a scenario with the orders of its mission: the keep-outs, then `goto` to the field's goal."""
    ground = ground_of(scenario).field
    return InMemory(scenario, (*edges(ground), goto(ground.goal_m)), ground=ground, step_ns=CAMPAIGN_STEP_NS)


def edges(field: Field) -> tuple[TimedCommand, ...]:
    """Return the orders of four keep-outs, a strip along each edge of the field."""
    return tuple(
        TimedCommand(GOTO_S, "fence_add", {"fence": name, "kind": "keep_out", "corners_m": tuple(chain(*corners))})
        for name, corners in strips(field.grid).items()
    )


def strips(grid: Grid) -> dict[str, tuple[tuple[float, float], ...]]:
    """Return the corners of a strip along each edge of a grid."""
    west, south = grid.x0_m, grid.y0_m
    east, north = grid.centre(grid.rows - 1, grid.columns - 1)
    boxes = {
        "west": (west, south, west + KEEP_OUT_M, north),
        "east": (east - KEEP_OUT_M, south, east, north),
        "south": (west, south, east, south + KEEP_OUT_M),
        "north": (west, north - KEEP_OUT_M, east, north),
    }
    return {name: ((x0, y0), (x1, y0), (x1, y1), (x0, y1)) for name, (x0, y0, x1, y1) in boxes.items()}


def goto(goal_m: tuple[float, float]) -> TimedCommand:
    """Return the order to a goal: at once; the first one after the rover's start."""
    return TimedCommand(GOTO_S, "goto", {"x_m": goal_m[0], "y_m": goal_m[1]})


def outcome_of(bench: InMemory, error: str = "") -> str:
    """Return 'arrived' if every order so far was completed, else the report on the first that was not."""
    for request in bench.operator.requests:
        if request.state is not RequestState.COMPLETED:
            told = request.report.text if request.report else "no answer"
            return error or f"{request.telecommand.name}: {told or request.state.name}"
    return error or "arrived"


@dataclass(frozen=True, slots=True)
class Estimate:
    """Error of the reported pose at one tick, against the filter's own covariance.

    error: (3,) x, y in m and yaw in rad, reported minus true
    covariance: (3, 3) of these
    """

    error: F64
    covariance: F64

    @property
    def sigma_m(self) -> float:
        """Standard deviation of the place along its worst axis."""
        xx, xy, yy = self.covariance[0, 0], self.covariance[0, 1], self.covariance[1, 1]
        return math.sqrt((xx + yy) / 2 + math.sqrt(((xx - yy) / 2) ** 2 + xy * xy))

    @property
    def sigma_rad(self) -> float:
        """Standard deviation of the yaw."""
        return math.sqrt(self.covariance[2, 2])

    @property
    def nees(self) -> float:
        """e^T P^-1 e; chi-square with 3 degrees of freedom for a consistent covariance."""
        return float(self.error @ np.linalg.solve(self.covariance, self.error))


class Watch:
    """Observer of a flight at each tick: error of the reported pose, tilt of the body, estimates at the stops.

    error_m, max_error_m: horizontal error now, and the largest during the mission
    heading_rad, max_heading_rad: the same of the yaw
    max_tilt_rad: largest angle between the body's z axis and the vertical
    last: estimate at most half a second ago
    stops: estimates at the end of each sweep, before the map is used to improve them
    jobs: jobs started so far
    in_obstacle: True once a wheel's rim came over an obstacle; None while there is none

    obstacles: put into the ground so far; the bench adds to it
    """

    def __init__(self, obstacles: Sequence[Obstacle] = ()) -> None:
        self._obstacles = obstacles
        self.in_obstacle: bool | None = None
        self.error_m = self.max_error_m = 0.0
        self.heading_rad = self.max_heading_rad = self.max_tilt_rad = 0.0
        self.last = Estimate(np.zeros(3), np.zeros((3, 3)))
        self.stops: list[Estimate] = []
        self.jobs = 0
        self._phase = Phase.NONE

    def __call__(self, tick: int, inputs: Inputs, outputs: Outputs, rover: Rover, state: PlantState) -> None:
        """Observe a tick, for InMemory.run and step."""
        pose = rover.localisation.pose
        x, y, z, w = state.quaternion_xyzw.tolist()
        self.error_m = math.dist((pose.x_m, pose.y_m), state.position_m[:2].tolist())
        self.heading_rad = abs(wrap_rad(pose.yaw_rad - math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))))
        self.max_tilt_rad = max(self.max_tilt_rad, math.acos(max(-1.0, min(1.0, 1 - 2 * (x * x + y * y)))))
        self.jobs += len(outputs.jobs)
        if self._obstacles and not self.in_obstacle:
            drawing = rover.config.rover
            x_m, y_m = wheels(state, drawing)
            holds = (each.holds(x_m, y_m, drawing.wheel_radius_m) for each in self._obstacles)
            self.in_obstacle = any(bool(held.any()) for held in holds)
        if tick % _TICKS == 0:
            self.last = estimate_of(rover, state)
        phase, was, self._phase = rover.executive.phase, self._phase, rover.executive.phase
        if phase is not Phase.NONE:
            self.max_error_m = max(self.max_error_m, self.error_m)
            self.max_heading_rad = max(self.max_heading_rad, self.heading_rad)
        if phase is Phase.MAPPING and was is Phase.SCANNING:
            self.stops.append(estimate_of(rover, state))


def estimate_of(rover: Rover, state: PlantState) -> Estimate:
    """Reported pose against the true one, now."""
    pose = rover.localisation.pose
    x, y, z, w = state.quaternion_xyzw.tolist()
    true_yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    true_x, true_y = state.position_m[:2].tolist()
    error = np.array([pose.x_m - true_x, pose.y_m - true_y, wrap_rad(pose.yaw_rad - true_yaw)])
    return Estimate(error, rover.localisation.estimate.covariance[np.ix_(_PLACE_AND_YAW, _PLACE_AND_YAW)])


def wheels(state: PlantState, rover: config.Rover) -> tuple[F64, F64]:
    """True places of the four wheels: x (4,), y (4,), m, map frame."""
    pose = state.pose
    along, across = np.array(wheel_places(rover)).T
    c, s = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return pose.x_m + c * along - s * across, pose.y_m + s * along + c * across
