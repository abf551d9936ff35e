"""Drivable path from a chain of lattice poses: lines of sight, real yaws, stations.

A lattice pose is (j, i, o), the body's axis at o * 22.5 degrees modulo 180: the rover is symmetric, so a free pose is
free with either end ahead. Three steps, all deterministic:

1. `shorten`: from each point straight to the farthest pose of the chain that is visible over free poses, the body along
   the line, unless that way costs more closeness than the chain saves; if no line is free, one step of the chain
   unchanged (crab: the body keeps its axis).
2. `lead`: which end leads. The scanner's end, unless the way back is a short retreat or there is no room to turn round.
3. stations at most 0.05 m and 11.25 degrees apart; each one's pose is free by the same test as `is_free`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.kernel_calls import sight
from onboard.native import each
from onboard.native.elementary import atan2, cos, dist, hypot, sin
from onboard.planning.local.poses import ORIENTATIONS, Freedom, orientation
from onboard.records import F32, F64, I32, U8, Bool, Grid, Path
from protocol.conventions import wrap_rad

STEP_RAD = math.pi / ORIENTATIONS
SPACING_M = 0.05
TURN_STEP_RAD = math.radians(11.25)
RETREAT_M = 1.0
BETWEEN = 0.4  # of an orientation step: an axis more than 0.1 of a step from an orientation lies between two
DETOUR = 1.02  # a line of sight may cost this much more than the chain it replaces
HORIZON = 150  # poses of the chain that a line of sight may skip


class Leg(NamedTuple):
    """A straight piece of a path from the last point.

    x_m, y_m: its end.
    axis_rad: the body's axis (modulo 180 degrees).
    """

    x_m: float
    y_m: float
    axis_rad: float


class Ground(NamedTuple):
    """Free poses on their grid.

    free: (8, rows, columns) bool.
    grid: the grid.
    closeness: a ratio, of the same shape, or None.
    unblocked: bool, poses that nothing blocks, of the same shape, or None.
    """

    free: Bool
    grid: Grid
    closeness: F32 | None = None
    unblocked: Bool | None = None

    def allows(self, stations: F64) -> bool:
        """True if the pose of every station (k, 3) is free: nearest cell, nearest orientation."""
        j, i, o = self._poses(stations)
        inside = (i >= 0) & (i < self.grid.columns) & (j >= 0) & (j < self.grid.rows)
        return bool(inside.all() and self.free[o, j, i].all())

    def price_m(
        self, a: tuple[float, float], b: tuple[float, float], axis_rad: float, spacing_m: float = SPACING_M
    ) -> float:
        """Cost of the straight way from a to b at a fixed axis, inf if a pose of its stations is not free.

        An axis between two orientations puts wheels on cells of neither: the other orientation must not be blocked.
        """
        at, nearest = axis_rad / STEP_RAD, round(axis_rad / STEP_RAD)
        for other in (round(at - BETWEEN), round(at + BETWEEN)):
            if other != nearest and self.unblocked is not None:
                line = (a, b, other % ORIENTATIONS)
                if not math.isfinite(sight.price_m(self.unblocked, None, self.grid, line, spacing_m)):
                    return math.inf
        line = (a, b, nearest % ORIENTATIONS)
        return sight.price_m(self.free, self.closeness, self.grid, line, spacing_m)

    def _poses(self, stations: F64) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        grid = self.grid
        i = np.rint((stations[:, 0] - grid.x0_m) / grid.cell_m).astype(np.int64)
        j = np.rint((stations[:, 1] - grid.y0_m) / grid.cell_m).astype(np.int64)
        return j, i, np.rint(stations[:, 2] / STEP_RAD).astype(np.int64) % ORIENTATIONS


def ground_of(freedom: U8, grid: Grid, closeness: F32 | None = None) -> Ground:
    """Ground from (8, rows, columns) uint8 of Freedom and, for costs, float32 closeness of the same shape."""
    return Ground(freedom == int(Freedom.FREE), grid, closeness, freedom != int(Freedom.BLOCKED))


def is_free(stations: F64, freedom: U8, grid: Grid) -> bool:
    """True if every station (k, 3) of x, y (m), yaw (rad) stands on a free pose; outside the grid none does."""
    return ground_of(freedom, grid).allows(np.asarray(stations, dtype=np.float64))


def drivable(
    states: I32, start: tuple[float, float, float], ground: Ground, end: tuple[float, float] | None = None
) -> Path:
    """The path from the pose `start` (x, y, yaw) along a chain of free lattice poses (k, 3) that begins in its cell.

    end: a point in the last pose's cell to stop at instead of its centre.

    Raises ValueError if the chain is empty or leaves the free poses: it must come from a field over the same poses.
    """
    if len(states) == 0:
        raise ValueError("an empty chain of poses has no path; check that the goal is reachable first")
    points = [(start[0], start[1])] + [ground.grid.centre(int(j), int(i)) for j, i, _ in states]
    axes = [orientation(start[2])] + [int(o) for _, _, o in states]
    if end is not None:  # via the cell's centre: a line from another cell may cut a third cell's corner
        points, axes = [*points, end], [*axes, axes[-1]]
    if bool(np.all(states[:, :2] == states[0, :2])):  # within one cell the path does not go via its centre
        points, axes = [points[0], points[-1]], [axes[0], axes[-1]]
    return Path(lead(shorten(points, axes, start[2], ground), start, ground))


def shorten(points: list[tuple[float, float]], axes: list[int], yaw_rad: float, ground: Ground) -> list[Leg]:
    """Legs along the points with the chain's orientations `axes`; every leg and the turns between are free.

    points: (x, y), m.
    axes: orientation 0..7 at each.
    yaw_rad: of the rover at the first.

    Raises ValueError if two consecutive points are not joined over free poses.
    """
    legs: list[Leg] = []
    at, axis = 0, yaw_rad
    last = len(points) - 1
    gone = _prices(points, axes, ground)
    while at < last:
        for to in range(min(last, at + HORIZON), at, -1):
            seen = _sight(points[at], points[to], axis, ground, DETOUR * (gone[to] - gone[at]) + SPACING_M)
            if seen is not None and (to == last or _turn(points[to], seen, axes[to] * STEP_RAD, ground) is not None):
                break
        else:
            to = at + 1
            seen = _step(points[at], points[to], axes[to] * STEP_RAD, axis, ground)
            if seen is None:  # turn back to the chain's orientation here first
                legs.append(Leg(*points[at], axes[at] * STEP_RAD))
                seen = _step(points[at], points[to], axes[to] * STEP_RAD, axes[at] * STEP_RAD, ground)
            if seen is None:
                raise ValueError(f"the chain is not free between {points[at]} and {points[to]}")
        legs.append(Leg(*points[to], seen))
        at, axis = to, seen
    return legs


def _prices(points: list[tuple[float, float]], axes: list[int], ground: Ground) -> list[float]:
    """Cost of the chain from its first point to each."""
    gone = [0.0]
    for a, b, axis in zip(points, points[1:], axes[1:]):
        gone.append(gone[-1] + ground.price_m(a, b, axis * STEP_RAD, math.inf))
    return gone


def _sight(
    a: tuple[float, float], b: tuple[float, float], axis_rad: float, ground: Ground, most_m: float
) -> float | None:
    """The axis of the straight way from a to b along the body.

    None if a pose of it or of the turn to it is not free, or if its cost is above `most_m`.
    """
    if dist(a, b) < 1e-9:
        return None
    heading = atan2(b[1] - a[1], b[0] - a[0])
    if ground.price_m(a, b, heading) > most_m or _turn(a, axis_rad, heading, ground) is None:
        return None
    return heading


def _step(
    a: tuple[float, float], b: tuple[float, float], axis_rad: float, before_rad: float, ground: Ground
) -> float | None:
    """Axis of one unchanged step of the chain: turn at a from `before_rad`, then to b; None if not free."""
    free = math.isfinite(ground.price_m(a, b, axis_rad)) and _turn(a, before_rad, axis_rad, ground) is not None
    return axis_rad if free else None


def _line(a: tuple[float, float], b: tuple[float, float], yaw_rad: float) -> F64:
    """Stations from a to b, both included, at most SPACING_M apart."""
    pieces = max(1, math.ceil(dist(a, b) / SPACING_M - 1e-9))
    out = np.empty((pieces + 1, 3))
    out[:, 0], out[:, 1] = np.linspace(a[0], b[0], pieces + 1), np.linspace(a[1], b[1], pieces + 1)
    out[:, 2] = yaw_rad
    return out


def _turn(at: tuple[float, float], from_rad: float, to_rad: float, ground: Ground) -> F64 | None:
    """Stations of a free turn on the spot between two axes (modulo 180 degrees), the shorter one first; else None."""
    delta = math.remainder(to_rad - from_rad, math.pi)
    for angle in (delta, delta - math.copysign(math.pi, delta)):
        stations = _spin(at, from_rad, angle)
        if ground.allows(stations):
            return stations
    return None


def turn_to(at: tuple[float, float], from_rad: float, to_rad: float, ground: Ground) -> F64 | None:
    """Stations (k, 3) of a free turn on the spot from one yaw to another, both included.

    The shorter turn is tried first; None if neither is free.
    at: x, y, m.
    """
    delta = wrap_rad(to_rad - from_rad)
    for angle in (delta, delta - math.copysign(math.tau, delta)):
        stations = _spin(at, from_rad, angle)
        if ground.allows(stations):
            return stations
    return None


def _spin(at: tuple[float, float], from_rad: float, angle_rad: float) -> F64:
    pieces = max(1, math.ceil(abs(angle_rad) / TURN_STEP_RAD - 1e-9))
    out = np.empty((pieces + 1, 3))
    out[:, 0], out[:, 1] = at
    out[:, 2] = from_rad + np.linspace(0.0, angle_rad, pieces + 1)
    return out


def lead(legs: list[Leg], start: tuple[float, float, float], ground: Ground) -> F64:
    """Stations (k, 3) of x, y (m), yaw (rad) over the legs from `start`, with the leading end and the turns decided.

    Raises ValueError if a turn between two legs is not free.
    """
    stations = [np.array([start], dtype=np.float64)]
    place, yaw = (start[0], start[1]), start[2]
    for k, leg in enumerate(legs):
        ahead = _ahead(place, leg)
        turn = None
        if abs(wrap_rad(ahead - yaw)) > math.pi / 2 + 1e-9 and _retreat_m(place, legs[k:], yaw) >= RETREAT_M:
            turn = turn_to(place, yaw, ahead, ground)
        if turn is None:
            turn = _turn(place, yaw, leg.axis_rad, ground)
        if turn is None:
            raise ValueError(f"no free turn at {place}: the legs are not of these free poses")
        yaw = float(turn[-1, 2])
        stations += [turn[1:], _line(place, (leg.x_m, leg.y_m), yaw)[1:]]
        place = (leg.x_m, leg.y_m)
    joined = np.concatenate(stations)
    joined[:, 2] = each.atan2(each.sin(joined[:, 2]), each.cos(joined[:, 2]))
    moved = np.any(np.abs(np.diff(joined, axis=0)) > 1e-12, axis=1)
    return np.asarray(joined[np.concatenate([[True], moved])])


def _ahead(place: tuple[float, float], leg: Leg) -> float:
    """The yaw on the leg's axis with the scanner's end towards the leg's far end."""
    dx, dy = leg.x_m - place[0], leg.y_m - place[1]
    forward = cos(leg.axis_rad) * dx + sin(leg.axis_rad) * dy >= -1e-9
    return wrap_rad(leg.axis_rad if forward else leg.axis_rad + math.pi)


def _retreat_m(place: tuple[float, float], legs: list[Leg], yaw_rad: float) -> float:
    """Length of the legs from here on that would be driven backwards if the rover did not turn round now."""
    length = 0.0
    for leg in legs:
        ahead = _ahead(place, leg)
        if abs(wrap_rad(ahead - yaw_rad)) <= math.pi / 2 + 1e-9:
            break
        length += hypot(leg.x_m - place[0], leg.y_m - place[1])
        place, yaw_rad = (leg.x_m, leg.y_m), wrap_rad(ahead + math.pi)
    return length
