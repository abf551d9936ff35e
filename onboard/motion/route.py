"""Stages of a path: legs that are driven without a stop, and turns on the spot between them.

    stations  o--o--o--o  o  o--o--o      leg, turn (two stations at one place), leg
                       |turn|

A leg ends where stations turn on the spot, and where the path bends by more than 10 degrees: the carrot never lies
round a corner, since the wheels have to steer there anyway. A change between forward and backward is such a corner.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass

from onboard.native.elementary import atan2, cos, hypot, sin
from onboard.records import Path
from protocol.conventions import wrap_rad

SAME_PLACE_M = 1e-3
CORNER_RAD = math.radians(10.0)
PASSED_RAD = math.radians(10.0)  # stations within a turn count as passed at this distance
BEND_M = 0.1  # a bend is measured over this to each side
BOW_M = 0.006  # largest deviation of a leg from the chord to the carrot


@dataclass(frozen=True, slots=True)
class Turn:
    """Turn on the spot through the stations' yaws.

    yaw_rad: yaws in their order.
    rest_rad: signed turn from station k to the last, in the direction of the stations.
    within_rad: tolerance at the last.
    """

    yaw_rad: list[float]
    rest_rad: list[float]
    within_rad: float

    def error_rad(self, yaw_rad: float, passed: int) -> tuple[float, int]:
        """Return the remaining turn from a yaw, and the number of stations passed by now."""
        while passed < len(self.yaw_rad) - 1 and abs(wrap_rad(self.yaw_rad[passed] - yaw_rad)) < PASSED_RAD:
            passed += 1
        return wrap_rad(self.yaw_rad[passed] - yaw_rad) + self.rest_rad[passed], passed


@dataclass(frozen=True, slots=True)
class Leg:
    """Part of a path that is driven without a stop. Angles do not jump.

    x_m, y_m, yaw_rad: stations.
    s_m: path length along the leg at each station.
    direction_rad, middle_m: direction and middle of each segment.
    before_m: length of the path before the leg.
    clearance_m: clearance at the stations, None if unknown.
    """

    x_m: list[float]
    y_m: list[float]
    yaw_rad: list[float]
    s_m: list[float]
    direction_rad: list[float]
    middle_m: list[float]
    before_m: float
    clearance_m: list[float] | None = None

    def nearest(self, x_m: float, y_m: float, segment: int) -> tuple[int, float, float]:
        """(segment, path length, signed distance to the left) of the nearest place on the leg from a segment on."""
        last = len(self.direction_rad) - 1
        while True:
            heading = self.direction_rad[segment]
            c, s = cos(heading), sin(heading)
            dx, dy = x_m - self.x_m[segment], y_m - self.y_m[segment]
            along = dx * c + dy * s
            span = self.s_m[segment + 1] - self.s_m[segment]
            if along <= span or segment == last:
                return segment, self.s_m[segment] + max(0.0, min(along, span)), dy * c - dx * s
            segment += 1

    def carrot_m(self, segment: int, along_m: float, ahead_m: float) -> float:
        """Path length of the carrot: `ahead_m` ahead, less in bends, at most the end."""
        target = min(along_m + ahead_m, self.s_m[-1])
        bend, i = 0.0, segment + 1
        while i < len(self.direction_rad) and self.s_m[i] < target:
            bend += abs(wrap_rad(self.direction_rad[i] - self.direction_rad[i - 1]))
            if (min(target, self.s_m[i + 1]) - along_m) * bend > 4.0 * BOW_M:
                return min(target, max(self.s_m[i], along_m + 4.0 * BOW_M / bend))
            i += 1
        return target

    def at(self, along_m: float) -> tuple[float, float, float]:
        """(x, y, yaw) at a path length, limited to the leg."""
        i = max(0, min(bisect_right(self.s_m, along_m) - 1, len(self.s_m) - 2))
        span = self.s_m[i + 1] - self.s_m[i]
        t = max(0.0, min(1.0, (along_m - self.s_m[i]) / span))
        return (
            self.x_m[i] + t * (self.x_m[i + 1] - self.x_m[i]),
            self.y_m[i] + t * (self.y_m[i + 1] - self.y_m[i]),
            self.yaw_rad[i] + t * (self.yaw_rad[i + 1] - self.yaw_rad[i]),
        )

    def bearing_rad(self, along_m: float) -> float:
        """Direction of the leg: linear between the middles of segments, constant at the ends; not wrapped."""
        return _between(self.middle_m, self.direction_rad, along_m)

    def curvature_pm(self, along_m: float) -> float:
        """Curvature over the 0.2 m around a place, rad/m, positive to the left."""
        return (self.bearing_rad(along_m + BEND_M) - self.bearing_rad(along_m - BEND_M)) / (2 * BEND_M)

    def turning_pm(self, along_m: float) -> float:
        """Curvature of the leg or turn of the body per metre, whichever is more, rad/m >= 0."""
        turn = _between(self.s_m, self.yaw_rad, along_m + BEND_M) - _between(self.s_m, self.yaw_rad, along_m - BEND_M)
        return max(abs(self.curvature_pm(along_m)), abs(turn) / (2 * BEND_M))

    def near_m(self, along_m: float) -> float:
        """Clearance at a path length, inf if unknown."""
        return math.inf if self.clearance_m is None else _between(self.s_m, self.clearance_m, along_m)


def _between(places: list[float], values: list[float], at: float) -> float:
    """Interpolate linearly between rising places, constant beyond them."""
    i = bisect_right(places, at)
    if i == 0 or i == len(places):
        return values[0] if i == 0 else values[-1]
    t = (at - places[i - 1]) / (places[i] - places[i - 1])
    return values[i - 1] + t * (values[i] - values[i - 1])


Place = tuple[float, float, list[float], float]  # x, y, the yaws there in their order, clearance


def route(path: Path, within_rad: tuple[float, float, float], *, one_leg: bool = False) -> list[Leg | Turn]:
    """Return the stages of a path. within_rad: tolerances of the turns at the start, on the way, at the end.

    one_leg: the places as a single leg, without turns but the last (for a law that steers the body itself).
    An empty path has no stages.
    """
    places = _places(path)
    if not places:
        return []
    start, between, end = within_rad
    first = places[0][2]
    stages: list[Leg | Turn] = [] if one_leg else [_turn(first, start if len(first) == 1 else between)]
    leg, before = [(places[0][0], places[0][1], first[-1], places[0][3])], 0.0
    for k, (x, y, yaws, clear_m) in enumerate(places[1:], 1):
        leg.append((x, y, yaws[0], clear_m))
        turns = len(yaws) > 1
        if k == len(places) - 1 or (not one_leg and (turns or _corner(places, k))):
            stages.append(_leg(leg, before))
            before += stages[-1].s_m[-1]  # type: ignore[union-attr]
            leg = [(x, y, yaws[-1], clear_m)]
        if turns and not one_leg:
            stages.append(_turn(yaws, between))
    stages.append(_turn(places[-1][2][-1:], end))
    return stages


def _places(path: Path) -> list[Place]:
    places: list[Place] = []
    clearance = [math.inf] * len(path.stations) if path.clearance_m is None else path.clearance_m.tolist()
    for (x, y, yaw), clear_m in zip(path.stations.tolist(), clearance):
        if places and hypot(x - places[-1][0], y - places[-1][1]) < SAME_PLACE_M:
            if abs(wrap_rad(yaw - places[-1][2][-1])) > 1e-6:
                places[-1][2].append(yaw)
        else:
            places.append((x, y, [yaw], clear_m))
    return places


def _corner(places: list[Place], k: int) -> bool:
    (ax, ay, *_), (bx, by, *_), (cx, cy, *_) = places[k - 1 : k + 2]
    return abs(wrap_rad(atan2(cy - by, cx - bx) - atan2(by - ay, bx - ax))) > CORNER_RAD


def _turn(yaws: list[float], within_rad: float) -> Turn:
    rest = [0.0]
    for here, there in zip(reversed(yaws[:-1]), reversed(yaws[1:])):
        rest.insert(0, rest[0] + wrap_rad(there - here))
    return Turn(yaws, rest, within_rad)


def _leg(stations: list[tuple[float, float, float, float]], before_m: float) -> Leg:
    x, y, yaw = [s[0] for s in stations], [s[1] for s in stations], [stations[0][2]]
    way: list[float] = [0.0]
    directions: list[float] = []
    middles: list[float] = []
    for i in range(1, len(stations)):
        dx, dy = x[i] - x[i - 1], y[i] - y[i - 1]
        yaw.append(yaw[-1] + wrap_rad(stations[i][2] - yaw[-1]))
        way.append(way[-1] + hypot(dx, dy))
        direction, last = atan2(dy, dx), directions[-1] if directions else 0.0
        directions.append(last + wrap_rad(direction - last))
        middles.append(0.5 * (way[-2] + way[-1]))
    clear = [s[3] for s in stations]
    return Leg(x, y, yaw, way, directions, middles, before_m, None if math.inf in clear else clear)
