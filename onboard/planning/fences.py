"""Fences drawn by operators: keep-outs, which no part of the rover enters, and goal fences, which contain all goals.

A polygon is its corners in the map frame, closed from the last to the first. Inside is by the even-odd rule, the edge
included.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from onboard.config import Rover
from onboard.native.elementary import cos, dist, hypot, sin
from onboard.records import Pose

Point = tuple[float, float]
KEEP_OUT, GOAL = "keep_out", "goal"


@dataclass(frozen=True, slots=True)
class Fence:
    """A named polygon of kind KEEP_OUT or GOAL with three corners or more."""

    name: str
    kind: str
    corners_m: tuple[Point, ...]

    def distance_m(self, point: Point) -> float:
        """Distance from a point to the polygon; 0 inside."""
        if self._holds(point):
            return 0.0
        return min(_to_segment_m(point, a, b) for a, b in _edges(self))

    @property
    def crosses_itself(self) -> bool:
        """True if two of its edges cross, so that the even-odd rule gives another area than intended."""
        edges = _edges(self)
        return any(_cross(p, q) for k, p in enumerate(edges) for q in edges[k + 1 :])

    def _holds(self, point: Point) -> bool:
        x, y = point
        odd = False
        for (ax, ay), (bx, by) in _edges(self):
            if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
                odd = not odd
        return odd


def _to_segment_m(point: Point, a: Point, b: Point) -> float:
    dx, dy = b[0] - a[0], b[1] - a[1]
    length2 = dx * dx + dy * dy
    share = 0.0 if length2 == 0.0 else ((point[0] - a[0]) * dx + (point[1] - a[1]) * dy) / length2
    share = min(1.0, max(0.0, share))
    return dist(point, (a[0] + share * dx, a[1] + share * dy))


def entered(fences: Iterable[Fence], pose: Pose, rover: Rover) -> str:
    """Name of a keep-out that the rover's outline touches, or ''."""
    half_x_m, half_y_m = rover.body_length_m / 2, rover.body_width_m / 2
    here, reach_m = (pose.x_m, pose.y_m), hypot(half_x_m, half_y_m)
    for fence in fences:
        if fence.kind == KEEP_OUT and fence.distance_m(here) <= reach_m:
            body = _in_body(fence, pose)
            corners = ((a * half_x_m, b * half_y_m) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1)))
            outline = Fence("", "", tuple(corners))
            if _overlap(body, outline):
                return fence.name
    return ""


def _in_body(fence: Fence, pose: Pose) -> Fence:
    c, s = cos(pose.yaw_rad), sin(pose.yaw_rad)
    moved = ((x - pose.x_m, y - pose.y_m) for x, y in fence.corners_m)
    return Fence(fence.name, fence.kind, tuple((c * x + s * y, c * y - s * x) for x, y in moved))


def _overlap(a: Fence, b: Fence) -> bool:
    """True if two polygons share a point: a corner of one lies in the other, or two edges cross."""
    if any(a.distance_m(corner) == 0.0 for corner in b.corners_m):
        return True
    if any(b.distance_m(corner) == 0.0 for corner in a.corners_m):
        return True
    return any(_cross(p, q) for p in _edges(a) for q in _edges(b))


def _edges(fence: Fence) -> list[tuple[Point, Point]]:
    return list(zip(fence.corners_m, (*fence.corners_m[1:], fence.corners_m[0])))


def _cross(p: tuple[Point, Point], q: tuple[Point, Point]) -> bool:
    return _side(p, q[0]) * _side(p, q[1]) < 0.0 and _side(q, p[0]) * _side(q, p[1]) < 0.0


def _side(edge: tuple[Point, Point], point: Point) -> float:
    (ax, ay), (bx, by) = edge
    return (bx - ax) * (point[1] - ay) - (by - ay) * (point[0] - ax)


def goal_refused(fences: Sequence[Fence], goal_m: Point) -> str:
    """Reason why the fences forbid a goal here, or ''."""
    for fence in fences:
        if fence.kind == KEEP_OUT and fence.distance_m(goal_m) == 0.0:
            return f"({goal_m[0]:.1f}, {goal_m[1]:.1f}) is in keep-out `{fence.name}`"
    within = [fence for fence in fences if fence.kind == GOAL]
    if not within or any(fence.distance_m(goal_m) == 0.0 for fence in within):
        return ""
    names = ", ".join(fence.name for fence in within)
    return f"({goal_m[0]:.1f}, {goal_m[1]:.1f}) is outside the goal fence ({names})"


def to_json(fences: Iterable[Fence]) -> bytes:
    """Fences as JSON, to be stored."""
    return json.dumps([{"name": f.name, "kind": f.kind, "corners_m": f.corners_m} for f in fences]).encode()


def from_json(kept: bytes) -> tuple[Fence, ...]:
    """Stored fences. Raises ValueError on anything else."""
    try:
        rows = json.loads(kept) if kept else []
        made = [
            Fence(str(row["name"]), str(row["kind"]), tuple((float(x), float(y)) for x, y in row["corners_m"]))
            for row in rows
        ]
    except (TypeError, KeyError) as error:
        raise ValueError(f"no fences: {error!r}") from error
    if any(fence.kind not in (KEEP_OUT, GOAL) or len(fence.corners_m) < 3 for fence in made):
        raise ValueError("a fence of unknown kind, or with less than three corners")
    return tuple(made)
