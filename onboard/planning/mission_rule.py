"""Mission rule: the decision at each stop, its reason, and the end of the mission. Pure (`10-navigation` section 5).

    R1 start     two scans at the first stop, ahead and behind; one at every other
    R2 trail     poses driven over stay free (done by the caller)
    R4 terminal  a goal pose is reachable over free poses: drive to the one nearest to the goal. One in the outer half
                 of the tolerance waits while a commit may still show a nearer one
    R10 choice   the strategy's own stop, while the record distance fell by 0.5 m within the last 2 stops; at every
                 stop if `guard` is false (simulation only: nothing but `stop_limit` ends such a mission)
    R5 commit    follow the optimistic path to its last free pose, look at the first that is not free
    R6 failed    a commit that would repeat a stop and heading, or look at the same target a third time: another
                 viewpoint, at most twice per 0.5 m block of targets; then the target is marked as an obstacle
    R7 confirm   no way is left: R5 once more, with blocked poses farther than 3 m from every stop taken as unknown
    R8 again     still none: the marks and tries are cleared, once in a mission
    R9 give up   else unreachable, with the nearest reachable pose
    R11 unseen   where the scanner saw too little of a side, it looks there again first, at most `lost_beams.looks`
                 times in a mission; done by the caller (`core.seeing`), like R2

Every stop is new, or uses up a look or a try of a block of targets, or lowers the record. Marks only grow, except for
R8, which happens once. `stop_limit` bounds the rest, and twice `stop_limit` the legs of a way that is free to the goal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from onboard.config import Mission
from onboard.native.elementary import dist
from onboard.records import Decision, Path
from protocol.conventions import wrap_rad

REPEAT_M = 0.1
REPEAT_RAD = math.radians(10)
RECORD_STEP_M = 0.5
RECORD_STOPS = 2
BLOCK_M = 0.5
TRIES = 2
LOOKS = 2
SAME_TARGET_M = 0.25


class Stop(NamedTuple):
    """Place and heading from which a scan was taken."""

    x_m: float
    y_m: float
    heading_rad: float


class ViewpointCount(NamedTuple):
    """Number of looks from other viewpoints at a block of targets.

    row, column: block of BLOCK_M squares of the map.
    tries: number of looks.
    """

    row: int
    column: int
    tries: int


@dataclass(frozen=True, slots=True)
class Option:
    """A stop that can be driven to.

    stop: place and heading.
    path: the way to it.
    cost_m: cost in metres.
    target_m: the first pose that is not free (R5), if there is one.
    data: numbers for the report.
    reason: why the strategy chose this place.
    """

    stop: Stop
    path: Path
    cost_m: float
    target_m: tuple[float, float] | None = None
    data: dict[str, Any] = field(default_factory=dict)
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Again:
    """Request to compute the options again at the same stop, because the marks in the state have changed."""

    rule: str
    reason: str


@dataclass(frozen=True, slots=True)
class Nearest:
    """Reachable pose nearest to the goal, for R9.

    x_m, y_m: its place.
    distance_m: its distance to the goal.
    blocking_cells: number of cells that bound the reachable ground.
    """

    x_m: float
    y_m: float
    distance_m: float
    blocking_cells: int


@dataclass(frozen=True, slots=True)
class MissionState:
    """State of one mission. A mission on an existing map begins with number=1: its first stop takes one scan.

    number: stops so far.
    stops: places scanned from, newest last.
    targets: points that commits looked at.
    marked: points that count as blocked.
    tried: looks at blocks of targets.
    record_m: smallest optimistic cost-to-go so far.
    since_record: stops since it last fell by 0.5 m.
    cleared: R8 was used.
    """

    number: int = 0
    stops: tuple[Stop, ...] = ()
    targets: tuple[tuple[float, float], ...] = ()
    marked: tuple[tuple[float, float], ...] = ()
    tried: tuple[ViewpointCount, ...] = ()
    record_m: float = math.inf
    since_record: int = 0
    cleared: bool = False


@dataclass(frozen=True, slots=True)
class Situation:
    """Results of planning at this stop; an option is None if there is none.

    pose: place and heading of the rover.
    goal_m: x, y of the goal.
    nearest: for R9.
    terminal: for R4.
    commit: for R5.
    choice: for R10.
    confirm: for R7, computed only without a commit.
    viewpoint: for R6, computed only if the commit, or the confirm, has `failed`.
    best_cost_m: least optimistic cost-to-go over the reachable free poses.
    """

    pose: Stop
    goal_m: tuple[float, float]
    nearest: Nearest
    terminal: Option | None = None
    commit: Option | None = None
    choice: Option | None = None
    confirm: Option | None = None
    viewpoint: Option | None = None
    best_cost_m: float = math.inf


def scan_headings(state: MissionState) -> tuple[float, ...]:
    """Yaws (rad) relative to the rover's at which to scan at this stop (R1)."""
    return (0.0, math.pi) if state.number == 0 else (0.0,)


def arrive(state: MissionState, pose: Stop, best_cost_m: float = math.inf) -> MissionState:
    """The state after the stop's scans: stop counted, headings added, record updated.

    Call it once at each stop, before `decide` (which may be called several times at one stop).
    """
    scanned = tuple(pose._replace(heading_rad=wrap_rad(pose.heading_rad + turn)) for turn in scan_headings(state))
    lower = best_cost_m <= state.record_m - RECORD_STEP_M
    return replace(
        state,
        number=state.number + 1,
        stops=state.stops + scanned,
        record_m=best_cost_m if lower else state.record_m,
        since_record=0 if lower else state.since_record + 1,
    )


def interrupted(state: MissionState, before: MissionState) -> MissionState:
    """The state after a path that ends before the decided stop: nothing has been tried at its end yet.

    before: the state that `arrive` returned at this stop, or a later one.
    """
    return replace(state, targets=before.targets, tried=before.tried)


def repeats(state: MissionState, stop: Stop) -> bool:
    """True if a scan was taken at this place (0.1 m) and heading (10 degrees) before."""
    return any(
        dist(stop[:2], earlier[:2]) <= REPEAT_M and abs(wrap_rad(stop.heading_rad - earlier.heading_rad)) <= REPEAT_RAD
        for earlier in state.stops
    )


def failed(state: MissionState, commit: Option) -> bool:
    """True if a commit would show nothing new: its scan was taken before, or its target was looked at twice already."""
    target = commit.target_m
    looks = sum(target is not None and dist(target, earlier) <= SAME_TARGET_M for earlier in state.targets)
    return repeats(state, commit.stop) or looks >= LOOKS


def tries_left(state: MissionState, target_m: tuple[float, float]) -> int:
    """Number of further viewpoints that a target's block may have (R6)."""
    row, column = _block(target_m)
    return TRIES - sum(t.tries for t in state.tried if (t.row, t.column) == (row, column))


def decide(state: MissionState, situation: Situation, mission: Mission) -> tuple[Decision | Again, MissionState]:
    """The decision at this stop by R4 to R10, or Again; after Again the caller plans again with the returned state.

    Pure; each Again has marked a target, or cleared the marks, which happens once in a mission (R8).
    """
    away = dist(situation.pose[:2], situation.goal_m)
    ended = _at_the_limit(state, situation, away, mission)
    if ended is not None:
        return ended, state
    if _ends(state, situation, away, mission):
        return _terminal(situation, away, mission), state
    choice = situation.choice
    if choice is not None and _may_choose(state, choice, mission):
        why = "the way left still shrinks" if mission.guard else "nothing guards the choice"
        return _drive(choice, "R10", f"{why}; {choice.reason}"), state
    commit, rule = (situation.commit, "R5") if situation.commit else (situation.confirm, "R7")
    if commit is None:
        return _no_way(state, situation)
    if not failed(state, commit):
        looked = state.targets if commit.target_m is None else (*state.targets, commit.target_m)
        return _drive(commit, rule, _commit_text(commit)), replace(state, targets=looked)
    return _failed_try(state, situation, commit)


def _at_the_limit(state: MissionState, situation: Situation, away_m: float, mission: Mission) -> Decision | None:
    """The end by count: past `stop_limit` only a way that is free to the goal is driven, past twice that none."""
    limit = mission.stop_limit
    if state.number <= limit:
        return None
    if away_m <= mission.goal_tolerance_m:
        text = f"{away_m:.2f} m from the goal; {limit} stops are the limit (mission.stop_limit)"
        return Decision("arrived", "R4", text, _stay(situation.pose), situation.pose.heading_rad)
    if situation.terminal is None or state.number > 2 * limit:
        return _give_up(situation, f"{limit} stops are the limit (mission.stop_limit)")
    return None


def _may_choose(state: MissionState, choice: Option, mission: Mission) -> bool:
    """True if R10 allows the strategy's choice."""
    return not mission.guard or (state.since_record < RECORD_STOPS and not repeats(state, choice.stop))


def _ends(state: MissionState, situation: Situation, away_m: float, mission: Mission) -> bool:
    """True if the mission ends from here (R4)."""
    terminal, commit = situation.terminal, situation.commit
    near_m = away_m if terminal is None else dist(terminal.stop[:2], situation.goal_m)
    if terminal is None and away_m > mission.goal_tolerance_m:
        return False
    nothing_nearer = commit is None or commit.target_m is None or failed(state, commit)
    return nothing_nearer or near_m <= mission.goal_tolerance_m / 2 or state.number > mission.stop_limit


def _terminal(situation: Situation, away_m: float, mission: Mission) -> Decision:
    option = situation.terminal
    here = option is None or option.path.length_m <= 0.05
    if here and away_m <= mission.goal_tolerance_m:
        text = f"{away_m:.2f} m from the goal, no nearer pose is free"
        return Decision("arrived", "R4", text, _stay(situation.pose), situation.pose.heading_rad)
    assert option is not None
    left = dist(option.stop[:2], situation.goal_m)
    text = f"the goal is reached over free poses: {option.path.length_m:.2f} m to {left:.2f} m from it"
    return Decision("goal", "R4", text, option.path, option.stop.heading_rad, {"cost_m": option.cost_m, **option.data})


def _no_way(state: MissionState, situation: Situation) -> tuple[Decision | Again, MissionState]:
    """R8 once, then R9."""
    if state.marked and not state.cleared:
        fresh = replace(state, marked=(), tried=(), targets=(), cleared=True)
        return Again("R8", f"{len(state.marked)} marks are cleared, once"), fresh
    return _give_up(situation, "no way is left over free or unknown ground"), state


def _failed_try(state: MissionState, situation: Situation, commit: Option) -> tuple[Decision | Again, MissionState]:
    """R6: the commit would repeat a scan that showed nothing new at its target."""
    if commit.target_m is None:
        return _no_way(state, situation)
    view = situation.viewpoint
    if view is not None and tries_left(state, commit.target_m) > 0 and not repeats(state, view.stop):
        tried = (*state.tried, ViewpointCount(*_block(commit.target_m), 1))
        text = f"({commit.target_m[0]:.1f}, {commit.target_m[1]:.1f}) stayed unknown; it is looked at from elsewhere"
        return _drive(view, "R6", text), replace(state, tried=tried)
    text = f"what is unknown at ({commit.target_m[0]:.1f}, {commit.target_m[1]:.1f}) counts as an obstacle"
    return Again("R6", text), replace(state, marked=(*state.marked, commit.target_m))


def _drive(option: Option, rule: str, reason: str) -> Decision:
    data = {"cost_m": option.cost_m, "target_m": option.target_m, **option.data}
    return Decision("drive", rule, reason, option.path, option.stop.heading_rad, data)


def _commit_text(option: Option) -> str:
    ahead = "the map's border" if option.target_m is None else f"({option.target_m[0]:.1f}, {option.target_m[1]:.1f})"
    return f"{option.path.length_m:.2f} m to the last free pose, then look at {ahead}; {option.cost_m:.1f} m are left"


def _give_up(situation: Situation, why: str) -> Decision:
    near = situation.nearest
    text = f"{why}; nearest reachable pose ({near.x_m:.2f}, {near.y_m:.2f}), {near.distance_m:.2f} m from the goal"
    data = {"nearest_m": (near.x_m, near.y_m), "distance_m": near.distance_m, "blocking_cells": near.blocking_cells}
    return Decision("unreachable", "R9", text, _stay(situation.pose), situation.pose.heading_rad, data)


def _stay(pose: Stop) -> Path:
    return Path(np.array([pose], dtype=np.float64))


def _block(point_m: tuple[float, float]) -> tuple[int, int]:
    return math.floor(point_m[1] / BLOCK_M), math.floor(point_m[0] / BLOCK_M)
