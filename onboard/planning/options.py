"""Options of a stop for the mission rule: terminal, commit, the strategy's choice, a viewpoint."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from onboard import config
from onboard.native import each
from onboard.native.elementary import atan2, cos, dist, hypot, sin
from onboard.planning.local.contract import Plan, Problem
from onboard.planning.local.path import Ground, turn_to
from onboard.planning.local.planners import PLANNERS
from onboard.planning.local.pose_field import descend
from onboard.planning.local.pose_planner import PoseFieldPlanner
from onboard.planning.local.poses import Freedom
from onboard.planning.mission_rule import MissionState, Nearest, Option, Stop
from onboard.planning.sensing import strategies, visibility
from onboard.planning.sensing.gain import Eyes
from onboard.planning.sensing.next_position import NextPosition, Question, straight_line_m
from onboard.records import F32, F64, I32, U8, Bool, CellClass, Path, Surface

LOOK_BEYOND_M = 1.5  # R5: look this far past the first pose that is not free
HEADING_SLACK_RAD = math.radians(60)  # with a heading this far off the target is still in the sector
BACK_OFF_M = 1.5  # a stop moves back at most this far along its path to find room to turn
VIEW_M, APART_M, TARGET_M = 4.0, 0.5, 0.55  # R6: reach of a viewpoint, distance from stops, radius of the targets


@dataclass(frozen=True, slots=True)
class Fields:
    """Ground at a stop as input of the options; arrays over poses are (8, rows, columns).

    surface: classified cells.
    freedom: uint8 of Freedom.
    closeness: float32 soft cost ratio.
    start: x, y, yaw of the rover.
    cell: its pose (j, i, o).
    reach: free poses connected with it.
    optimistic_m: cost-to-go with unknown poses passable.
    chain: its descent (k, 3) from the rover, empty where there is no way.
    goal_m: x, y of the goal.
    planning: configuration.
    """

    surface: Surface
    freedom: U8
    closeness: F32
    start: tuple[float, float, float]
    cell: tuple[int, int, int]
    reach: Bool
    optimistic_m: F32
    chain: I32
    goal_m: tuple[float, float]
    planning: config.Planning

    @property
    def ground(self) -> Ground:
        """The free poses on their grid."""
        return Ground(self.freedom == int(Freedom.FREE), self.surface.grid)  # int: the enum takes five times as long


def optimistic_chain(cost: F32, cell: tuple[int, int, int], planning: config.Planning, cell_m: float, near: F32) -> I32:
    """Descent of a pose field (8, rows, columns) from a pose, int32 (k, 3) of j, i, o; (0, 3) where its cost is inf."""
    if not np.isfinite(cost[cell[2], cell[0], cell[1]]):
        return np.empty((0, 3), dtype=np.int32)
    return descend(cost, cell, planning, cell_m, near)


def terminal(fields: Fields, tolerance_m: float) -> Option | None:
    """Option R4: the way to the reachable pose nearest to the goal; None if none lies within the tolerance."""
    away = _distances(fields, fields.goal_m)
    open_cells = np.asarray(fields.reach.any(axis=0))
    nearest = float(np.min(away[open_cells], initial=np.inf))
    if nearest > tolerance_m:
        return None
    grid = fields.surface.grid
    own = grid.cell(*fields.goal_m)
    exact = grid.contains(*own) and bool(open_cells[own])
    goals = np.zeros(open_cells.shape, dtype=bool)
    if exact:
        goals[own] = True
    else:
        goals = open_cells & (away <= nearest + 1e-6)
    plan = _plan(fields, fields.reach & goals, fields.goal_m if exact else None)
    if plan.path is None:
        return None
    return Option(Stop(*plan.path.stations[-1]), plan.path, plan.cost_m, data={"plan": plan.reason})


def commit(fields: Fields) -> Option | None:
    """Option R5: the way to the last free pose of the optimistic path, looking at the first that is not free.

    None if there is no such path, or no free way to that pose.
    """
    chain = fields.chain
    if len(chain) == 0:
        return None
    closed = np.flatnonzero(fields.freedom[chain[:, 2], chain[:, 0], chain[:, 1]] != Freedom.FREE)
    first = int(closed[0]) if len(closed) else len(chain)
    last = chain[first - 1]
    places = _places(fields, chain)
    target = (float(places[first, 0]), float(places[first, 1])) if len(closed) else None
    look = _beyond(places, min(first, len(chain) - 1))
    if target is None:
        look = (float(2 * places[-1, 0] - places[0, 0]), float(2 * places[-1, 1] - places[0, 1]))
    plan = _plan(fields, _only(fields, (int(last[0]), int(last[1]))), None)
    cost = float(fields.optimistic_m[fields.cell[2], fields.cell[0], fields.cell[1]])
    data = {"unknown_poses": len(closed), "plan": plan.reason}
    return _looking(fields, plan, look, Option(Stop(*fields.start), _nowhere(fields), cost, target, data))


def choice(
    fields: Fields, eyes: Eyes, state: MissionState, mission: config.Mission
) -> tuple[Option | None, NextPosition | None]:
    """The strategy's next sensing position as an option, with its whole result; the option is None without a place."""
    surface = fields.surface
    cost = np.where(fields.reach, fields.optimistic_m, np.float32(np.inf)).min(axis=0)
    if mission.distance == "straight-line":
        cost = np.where(np.isfinite(cost), straight_line_m(surface.grid, surface.z_mean, fields.goal_m), cost)
    stops = tuple((s.x_m, s.y_m) for s in state.stops)
    free = np.asarray(fields.reach.any(axis=0))
    asked = Question(surface.grid, surface.z_mean, free, cost, fields.goal_m, stops)
    answer = strategies.next_position(asked, eyes, mission, state.number)
    best = None if answer is None else answer.best
    if answer is None or best is None:
        return None, answer
    look = (best.x_m + cos(best.heading_rad), best.y_m + sin(best.heading_rad))
    plan = _plan(fields, _only(fields, best.cell), None)
    data = {"score": best.score, "visibility": best.visibility, "new_cells": best.new_cells}
    sketch = Option(Stop(*fields.start), _nowhere(fields), best.cost_m, None, data, answer.reason)
    return _looking(fields, plan, look, sketch), answer


def viewpoint(fields: Fields, target_m: tuple[float, float], state: MissionState, eyes: Eyes) -> Option | None:
    """Option R6: the reachable place within 4 m of a target, 0.5 m from all stops, that sees most of its unknown cells.

    None if no such place sees any of them, or the best one cannot be driven to.
    """
    unknown = fields.surface.cell_class <= CellClass.OCCLUDED
    from_target = _distances(fields, target_m)
    allowed = fields.reach.any(axis=0) & (from_target <= VIEW_M)
    allowed[np.arange(allowed.shape[0]) % 2 == 1] = False
    allowed[:, np.arange(allowed.shape[1]) % 2 == 1] = False
    for stop in state.stops:
        allowed &= _distances(fields, stop[:2]) >= APART_M
    cells = np.argwhere(allowed)
    if len(cells) == 0:
        return None
    table = visibility.beams(VIEW_M + TARGET_M, fields.surface.grid.cell_m, 240)
    asked = visibility.VisibilityRequest(allowed, new_half_rad=math.pi, targets=unknown & (from_target <= TARGET_M))
    seen = visibility.total(visibility.scene(fields.surface.z_mean), table, eyes.height_m, asked).new_cells[allowed]
    if seen.max() <= 0.0:
        return None
    from_rover = _distances(fields, fields.start[:2])[cells[:, 0], cells[:, 1]]
    best = cells[np.lexsort((cells[:, 1], cells[:, 0], from_rover, -np.round(seen, 6)))[0]]
    plan = _plan(fields, _only(fields, (int(best[0]), int(best[1]))), None)
    sketch = Option(Stop(*fields.start), _nowhere(fields), plan.cost_m, target_m, {"targets_seen": float(seen.max())})
    return _looking(fields, plan, target_m, sketch)


def nearest(fields: Fields) -> Nearest:
    """The reachable pose nearest to the goal (R9), and the number of cells with blocked poses next to reachable ones.

    The rover's own pose if no pose is reachable (a keep-out lies across the rover).
    """
    if not fields.reach.any():
        return Nearest(*fields.start[:2], dist(fields.start[:2], fields.goal_m), 0)
    away = np.where(fields.reach.any(axis=0), _distances(fields, fields.goal_m), np.inf)
    j, i = np.unravel_index(int(np.argmin(away)), away.shape)
    x, y = fields.surface.grid.centre(int(j), int(i))
    beside = np.zeros_like(fields.reach)
    beside[:, 1:] |= fields.reach[:, :-1]
    beside[:, :-1] |= fields.reach[:, 1:]
    beside[:, :, 1:] |= fields.reach[:, :, :-1]
    beside[:, :, :-1] |= fields.reach[:, :, 1:]
    blocking = (beside & (fields.freedom == Freedom.BLOCKED)).any(axis=0)
    return Nearest(x, y, float(away[j, i]), int(blocking.sum()))


def _plan(fields: Fields, goals: Bool, end: tuple[float, float] | None) -> Plan:
    """Plan by the configured planner; if it finds no way, by the pose field, with both reasons in the result."""
    problem = Problem(fields.freedom, fields.surface.grid, fields.start, goals, fields.planning, fields.closeness, end)
    plan = PLANNERS[fields.planning.planner]().plan(problem)
    if plan.path is not None or fields.planning.planner == "pose-field":
        return plan
    instead = PoseFieldPlanner().plan(problem)
    return replace(instead, reason=f"{fields.planning.planner}: {plan.reason}; pose-field: {instead.reason}")


def _looking(fields: Fields, plan: Plan, look_m: tuple[float, float], sketch: Option) -> Option | None:
    """The sketch with the plan's path and a turn at its end to look at a point; None without a path.

    If the end has no room to turn to within 60 degrees, the stop moves back along the path. If no such place is found,
    the stop takes the path's last heading.
    """
    if plan.path is None:
        return None
    stations, ground = plan.path.stations, fields.ground
    gone = np.append(0.0, np.cumsum(each.hypot(*np.diff(stations[:, :2], axis=0).T)))
    for k in range(len(stations) - 1, -1, -1):
        if gone[-1] - gone[k] > BACK_OFF_M:
            break
        turn = _turn_towards(stations[k], look_m, ground)
        if turn is not None:
            stations = np.concatenate([stations[:k], turn])
            break
    return replace(sketch, stop=Stop(*(float(part) for part in stations[-1])), path=Path(stations))


def _turn_towards(station: F64, look_m: tuple[float, float], ground: Ground) -> F64 | None:
    """Stations of the free turn that ends nearest to the direction of a point; None if over 60 degrees off."""
    x, y, yaw = (float(part) for part in station)
    dx, dy = look_m[0] - x, look_m[1] - y
    wanted = atan2(dy, dx) if hypot(dx, dy) > 1e-6 else yaw
    for off in range(round(HEADING_SLACK_RAD / math.radians(10)) + 1):
        for sign in (1, -1) if off else (1,):
            turn = turn_to((x, y), yaw, wanted + sign * off * math.radians(10), ground)
            if turn is not None:
                turn[:, 2] = each.atan2(each.sin(turn[:, 2]), each.cos(turn[:, 2]))
                return turn
    return None


def _places(fields: Fields, chain: NDArray[np.integer]) -> F64:
    grid = fields.surface.grid
    return np.column_stack([grid.x0_m + chain[:, 1] * grid.cell_m, grid.y0_m + chain[:, 0] * grid.cell_m])


def _beyond(places: F64, first: int) -> tuple[float, float]:
    """The point LOOK_BEYOND_M along the way past index `first`."""
    gone = np.append(0.0, np.cumsum(each.hypot(*np.diff(places[first:], axis=0).T)))
    at = first + min(int(np.searchsorted(gone, LOOK_BEYOND_M)), len(gone) - 1)
    return float(places[at, 0]), float(places[at, 1])


def _only(fields: Fields, cell: tuple[int, int]) -> Bool:
    goals = np.zeros_like(fields.reach)
    goals[:, cell[0], cell[1]] = fields.reach[:, cell[0], cell[1]]
    return goals


def _distances(fields: Fields, point_m: tuple[float, float]) -> F64:
    grid = fields.surface.grid
    x = grid.x0_m + np.arange(grid.columns) * grid.cell_m - point_m[0]
    y = grid.y0_m + np.arange(grid.rows) * grid.cell_m - point_m[1]
    return np.asarray(each.hypot(x[None, :], y[:, None]))


def _nowhere(fields: Fields) -> Path:
    return Path(np.array([fields.start], dtype=np.float64))
