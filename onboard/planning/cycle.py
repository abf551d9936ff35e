"""Planning job of a stop: from the map to a decision and a path. One pure function, `plan`.

    Ldem -> classes -> pose freedom (+ trail, R2) -> fields -> sets -> options -> mission rule -> decision, path
                        and the orbiter's map refreshed -> its cost-to-go -> seeds of the fields

If the goal lies in the map's window, its seeds are the poses within the tolerance, with a cost that rises towards the
rim. Else the seeds are the window's border, each cell with the cost-to-go of the orbiter's map from there (a straight
line without one), so both maps make one field.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from onboard import config
from onboard.native import each
from onboard.native.elementary import dist
from onboard.perception.map.cell_classes import classify
from onboard.perception.map.unseen_cells import without_unseen
from onboard.planning import gdem_refresh, global_path, mission_rule, options
from onboard.planning.fenced import closed, fenced
from onboard.planning.global_path import GlobalField
from onboard.planning.guard import trust
from onboard.planning.guard.wheel_footprint import barred
from onboard.planning.local.pose_field import cost_to_go
from onboard.planning.local.poses import (
    ORIENTATIONS,
    Freedom,
    block,
    clearance_m,
    closeness,
    node_sets,
    pose_freedom,
    pose_index,
    reachable,
    steered_cells,
    tall,
    trail,
    tyre_cells,
    wheel_cells,
)
from onboard.planning.mission_rule import BLOCK_M, Again, MissionState, Situation, Stop
from onboard.planning.options import Fields
from onboard.planning.plan_records import PlanningSettings, PlanReport, PlanRequest, PlanResult
from onboard.planning.sensing.gain import Eyes
from onboard.planning.sensing.next_position import NextPosition
from onboard.records import F64, U8, Bool, CellClass, Decision, Gdem, Grid, Path, Surface

STAND_M = 0.25  # around a rover whose own pose is not free on the map
MOST_RATIO = 0.5  # of the ground reachable with rocks ignored: from this share on, poses on rocks stay blocked
DISC_PRICE = 2.0  # per metre left within the goal's disc, so that driving on is cheaper
CONFIRM_M = 3.0  # R7: blocked poses farther than this from every stop may be wrong
CONFIRM_RATIO = 0.5  # cost ratio added for a way over them
SLIPPERY_M = 0.6  # around a place where the wheels slipped: half the rover plus the odometry error there
FOOT_M = 0.10  # of a rock beyond the centres of its tall cells: half a cell's diagonal and 0.03 m of slope
MOST_MARKS = 60  # in one job; then the rule is evaluated with no way left


@dataclass(frozen=True, slots=True)
class _Stop:
    """Inputs that stay constant while the rule is evaluated at one stop.

    request: the plan request.
    surface: classified ground.
    freedom: pose freedom before any mark.
    seeds: seeds (k, 3) of the cost-to-go and the remaining cost of each (k,).
    tall: (k, 2) j, i of cells that stand out of the ground.
    """

    request: PlanRequest
    surface: Surface
    freedom: U8
    seeds: tuple[NDArray[np.int64], F64]
    tall: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class PlanOutcome:
    """Result of the rule at a stop.

    decision: the decision.
    state: mission state after it.
    before: mission state at the begin of the stop.
    fields: fields with the marks of `state`.
    unmarked: fields at the begin of the stop.
    gdem: the orbiter's map, refreshed; None without one.
    global_field: its cost-to-go; None without it.
    answer: result of the strategy; None if it was not asked.
    """

    decision: Decision
    state: MissionState
    before: MissionState
    fields: Fields
    unmarked: Fields
    gdem: Gdem | None
    global_field: GlobalField | None
    answer: NextPosition | None


def plan(request: PlanRequest) -> PlanResult:
    """Decide at a stop (`10-navigation` section 5). Call it once for each stop, after its scans are in the map.

    Pure: the same request gives the same bits. For a goal that cannot be reached the decision has kind 'unreachable'
    with its reason; it is never an error and never a straight line.
    """
    settings = request.settings
    surface = surface_of(request)
    found = decide(request, surface, freedom_of(request, surface))
    outcome, state = found.decision, found.state
    leg = trust.within_trust(first_leg(outcome, settings.mission.leg_m), request, state)
    if leg is not outcome:
        state = mission_rule.interrupted(state, found.before)
    leg = replace(leg, path=measured(leg.path, found.fields.freedom, surface.grid))
    sets = node_sets(surface, found.unmarked.freedom, found.unmarked.reach)
    report = _report(request, found.fields, sets, found.global_field, found.answer)
    return PlanResult(leg, state, report, request.pose, request.goal_m, found.gdem)


def decide(request: PlanRequest, surface: Surface, freedom: U8) -> PlanOutcome:
    """The rule's decision over the free ground of `freedom`, with the whole path, not cut to the first leg.

    freedom: result of `freedom_of`. The beams' data (`request.ldem`) is not read.
    """
    settings = request.settings
    gdem, field = _from_orbit(request, surface, freedom)
    pose = Stop(request.pose.x_m, request.pose.y_m, request.pose.yaw_rad)
    seeds = _seeds(surface.grid, request.goal_m, settings.mission.goal_tolerance_m, field)
    stop = _Stop(request, surface, freedom, seeds, np.argwhere(tall(surface, settings.planning.step_m)))
    fields = unmarked = _fields(stop, request.state)
    state = mission_rule.arrive(request.state, pose, float(np.min(fields.optimistic_m[fields.reach], initial=np.inf)))
    before = state

    answer: NextPosition | None = None
    outcome: Decision | Again
    for _ in range(MOST_MARKS):
        situation, found = _situation(stop, fields, state)
        answer = found or answer
        outcome, state = mission_rule.decide(state, situation, settings.mission)
        if isinstance(outcome, Decision):
            break
        fields = _fields(stop, state)
    else:
        situation = replace(situation, commit=None, confirm=None, choice=None)
        outcome, state = mission_rule.decide(replace(state, cleared=True), situation, settings.mission)
    assert isinstance(outcome, Decision), "without a way the rule gives up"
    return PlanOutcome(outcome, state, before, fields, unmarked, gdem, field, answer)


def measured(path: Path, freedom: U8, grid: Grid) -> Path:
    """The path with the clearance of its stations, so that the follower slows down near blocked poses."""
    poses = np.array([pose_index(grid, *station) for station in path.stations.tolist()], np.int64).reshape(-1, 3)
    return Path(path.stations, clearance_m(freedom, poses, grid.cell_m))


def first_leg(decision: Decision, leg_m: float) -> Decision:
    """The decision itself if its path is short, else its first `leg_m`, to scan there: odometry slips along the way.

    leg_m: metres. A path up to a quarter longer is driven whole. The heading to scan at is that of the path.
    """
    stations = decision.path.stations
    way = np.concatenate([[0.0], np.cumsum(each.hypot(*np.diff(stations[:, :2], axis=0).T))])
    if decision.kind not in ("drive", "goal") or way[-1] <= 1.25 * leg_m:
        return decision
    last = int(np.searchsorted(way, leg_m, side="right"))
    path = Path(stations[:last])
    reason = f"{decision.reason}; first {way[last - 1]:.1f} m, then a look"
    return replace(decision, kind="drive", path=path, reason=reason, heading_rad=float(stations[last - 1, 2]))


def _situation(stop: _Stop, fields: Fields, state: MissionState) -> tuple[Situation, NextPosition | None]:
    """Input of the rule: the options in its order, each computed only if the earlier ones do not decide."""
    request, mission = stop.request, stop.request.settings.mission
    situation = Situation(
        pose=Stop(*fields.start),
        goal_m=request.goal_m,
        nearest=options.nearest(fields),
        terminal=options.terminal(fields, mission.goal_tolerance_m),
    )
    terminal = situation.terminal
    if terminal is not None and dist(terminal.stop[:2], request.goal_m) <= mission.goal_tolerance_m / 2:
        return situation, None
    eyes = _eyes(request.settings)
    found, answer = options.choice(fields, eyes, state, mission)
    situation = replace(situation, choice=found)
    commit = options.commit(fields)
    situation = replace(situation, commit=commit)
    if commit is None:
        commit = options.commit(_fields(stop, state, confirm=True))
        situation = replace(situation, confirm=commit)
    if commit is None or commit.target_m is None or not mission_rule.failed(state, commit):
        return situation, answer
    if mission_rule.tries_left(state, commit.target_m) > 0:
        view = options.viewpoint(fields, commit.target_m, state, eyes)
        situation = replace(situation, viewpoint=view)
    return situation, answer


def _eyes(settings: PlanningSettings) -> Eyes:
    return Eyes(settings.rover.lidar_z_m, settings.scanning.range_m, settings.scanning.sector_rad)


def surface_of(request: PlanRequest) -> Surface:
    """The ground of a request: the surface of its map, with the unseen cells as occluded."""
    return without_unseen(classify(request.ldem, request.settings.mapping), request.unseen_m)


def freedom_of(request: PlanRequest, surface: Surface) -> U8:
    """Freedom of every pose with the trail and the rover's own place free (R2), keep-outs blocked, before any mark."""
    grid, settings = surface.grid, request.settings
    freedom = pose_freedom(surface, settings.rover, settings.planning)
    if request.blocked_m:
        freedom = barred(freedom, request.blocked_m, grid, settings.rover)
    driven = [pose_index(grid, *(float(part) for part in station)) for station in request.trail]
    freedom = trail(freedom, np.array(driven, dtype=np.int64).reshape(-1, 3))
    own = pose_index(grid, request.pose.x_m, request.pose.y_m, request.pose.yaw_rad)
    if not grid.contains(own[0], own[1]):
        raise ValueError(f"the rover's cell {own[:2]} lies outside the map's window, {grid.rows} x {grid.columns}")
    if freedom[own[2], own[0], own[1]] != Freedom.FREE:
        freedom = _stand(freedom, surface, own, settings)
    return fenced(freedom, request.fences, grid, settings.rover, (request.pose.x_m, request.pose.y_m))


def _stand(freedom: U8, surface: Surface, own: tuple[int, int, int], settings: PlanningSettings) -> U8:
    """Pose freedom with the poses around the rover freed, because sensor noise must not trap the rover.

    Within 0.25 m, poses at its own and the adjacent orientations count as free regardless of the map, other
    orientations unless they are blocked. Except for its own pose this needs all wheels on known cells. Poses that put a
    tyre on a cell that stands out stay as they are if at least half (MOST_RATIO) of the ground can be reached without
    them: a rock is not noise.
    """
    bare = np.full_like(freedom, Freedom.FREE)
    stones = np.argwhere(tall(surface, settings.planning.step_m))
    block(bare, stones, lambda o: tyre_cells(o, settings.rover, surface.grid.cell_m))
    rocks = bare == Freedom.BLOCKED
    off, over = (_freed(freedom, surface, own, settings.rover, kept) for kept in (rocks, np.zeros_like(rocks)))
    cells = [np.count_nonzero(reachable(one, *own).any(axis=0)) for one in (off, over)]
    return off if cells[0] >= MOST_RATIO * cells[1] else over


def _freed(freedom: U8, surface: Surface, own: tuple[int, int, int], rover: config.Rover, rocks: Bool) -> U8:
    """The freedom with the poses of `_stand` freed.

    rocks: (8, rows, columns), poses that stay as they are, except the rover's own pose.
    """
    j, i, o = own
    grid, out = surface.grid, freedom.copy()
    known = ndimage.binary_erosion(surface.cell_class >= CellClass.HIT, np.ones((3, 3), np.bool_))
    near = np.argwhere(each.hypot(*np.ogrid[-j : grid.rows - j, -i : grid.columns - i]) * grid.cell_m <= STAND_M)
    for other in range(ORIENTATIONS):
        turned = min((other - o) % ORIENTATIONS, (o - other) % ORIENTATIONS)
        wheels = near[:, None, :] + np.array(wheel_cells(other, rover, grid.cell_m))
        inside = ((wheels >= 0) & (wheels < (grid.rows, grid.columns))).all(axis=(1, 2))
        at = near[inside][known[tuple(np.moveaxis(wheels[inside], 2, 0))].all(axis=1)]
        at = at[(out[other][tuple(at.T)] != Freedom.BLOCKED) | ((turned <= 1) & ~rocks[other][tuple(at.T)])]
        out[other][tuple(at.T)] = Freedom.FREE
    out[o, j, i] = Freedom.FREE
    return out


def _from_orbit(request: PlanRequest, surface: Surface, freedom: U8) -> tuple[Gdem | None, GlobalField | None]:
    """The orbiter's map, refreshed, and its cost-to-go; None, None without one.

    If the refreshed map would close the last way from the rover, it is too coarse to be trusted: the old map stays.
    """
    gdem, goal_m, planning = request.gdem, request.goal_m, request.settings.planning
    if gdem is None:
        return None, None
    here = (request.pose.x_m, request.pose.y_m)
    refreshed = gdem_refresh.refresh(gdem, surface, freedom, (here, goal_m))
    field = global_path.solve(closed(refreshed, request.fences), goal_m, planning)
    if refreshed is gdem or math.isfinite(global_path.value_at(field, *here)):
        return refreshed, field
    return gdem, global_path.solve(closed(gdem, request.fences), goal_m, planning)


def _near(grid: Grid, points_m: tuple[tuple[float, float], ...], radius_m: float) -> Bool:
    """Cells whose centre lies within a radius of any of the points, (rows, columns)."""
    x = grid.x0_m + np.arange(grid.columns) * grid.cell_m
    y = grid.y0_m + np.arange(grid.rows) * grid.cell_m
    near = np.zeros((grid.rows, grid.columns), dtype=bool)
    for point in points_m:
        near |= each.hypot(x[None, :] - point[0], y[:, None] - point[1]) <= radius_m
    return near


def _seeds(
    grid: Grid, goal_m: tuple[float, float], tolerance_m: float, field: GlobalField | None
) -> tuple[NDArray[np.int64], F64]:
    """Seeds (k, 3) of the cost-to-go and the remaining cost from each (k,)."""
    if grid.contains(*grid.cell(*goal_m)):
        x = grid.x0_m + np.arange(grid.columns) * grid.cell_m - goal_m[0]
        y = grid.y0_m + np.arange(grid.rows) * grid.cell_m - goal_m[1]
        away = each.hypot(x[None, :], y[:, None])
        cells = np.argwhere(away <= max(tolerance_m, grid.cell_m))
        left = DISC_PRICE * away[cells[:, 0], cells[:, 1]]
    else:
        border = np.ones((grid.rows, grid.columns), dtype=bool)
        border[1:-1, 1:-1] = False
        cells = np.argwhere(border)
        points = np.array([grid.x0_m, grid.y0_m]) + cells[:, ::-1] * grid.cell_m
        straight = each.hypot(*(points - np.array(goal_m)).T)
        left = straight if field is None else global_path.values_at(field, points)
        cells, left = cells[np.isfinite(left)], left[np.isfinite(left)]
    return np.column_stack([cells, np.full(len(cells), -1)]).astype(np.int64), left


def _fields(stop: _Stop, state: MissionState, confirm: bool = False) -> Fields:
    """The fields with the marks of the state blocked (R6).

    confirm: far blocked poses count as unknown (R7).
    """
    request, grid, freedom = stop.request, stop.surface.grid, stop.freedom.copy()
    planning = request.settings.planning
    doubted = np.zeros(freedom.shape, dtype=bool)
    if confirm:
        looked = tuple((earlier.x_m, earlier.y_m) for earlier in state.stops)
        doubted = (freedom == Freedom.BLOCKED) & ~_near(grid, looked, CONFIRM_M)
        freedom[doubted] = Freedom.UNKNOWN
    freedom[(freedom == Freedom.UNKNOWN) & _near(grid, state.marked, BLOCK_M)] = Freedom.BLOCKED
    # An unseen cell may be a rock: a way avoids it like a blocked cell.
    # A steered tyre reaches beyond the cells of its pose, and the foot of a rock beyond its tall cells.
    rover = request.settings.rover
    shunned = barred(freedom, request.unseen_m, grid, rover)
    block(shunned, stop.tall, lambda o: steered_cells(o, rover, grid.cell_m, FOOT_M))
    near = closeness(shunned, planning, grid.cell_m, request.sigma_m)
    near[freedom == Freedom.UNKNOWN] += planning.unknown_ratio
    near[doubted] += np.float32(CONFIRM_RATIO)
    near[:, _near(grid, request.slippery_m, SLIPPERY_M)] += np.float32(planning.slippery_ratio)
    start = (request.pose.x_m, request.pose.y_m, request.pose.yaw_rad)
    cell = pose_index(grid, *start)
    cost = cost_to_go(freedom, stop.seeds[0], planning, grid.cell_m, True, near, stop.seeds[1])
    chain = options.optimistic_chain(cost, cell, planning, grid.cell_m, near)
    reach: Bool = reachable(freedom, *cell)
    return Fields(stop.surface, freedom, near, start, cell, reach, cost, chain, request.goal_m, planning)


def _report(
    request: PlanRequest, fields: Fields, sets: U8, field: GlobalField | None, answer: NextPosition | None
) -> PlanReport:
    grid, chain = fields.surface.grid, fields.chain
    start = (request.pose.x_m, request.pose.y_m)
    return PlanReport(
        grid=grid,
        node_sets=sets,
        z_mean=fields.surface.z_mean,
        global_path=np.array([start, request.goal_m]) if field is None else global_path.path(field, start),
        optimistic_path=np.array([grid.x0_m, grid.y0_m]) + chain[:, 1::-1] * grid.cell_m,
        next_position=answer,
    )
