"""Session of the drive guard: points the scanner ahead while a leg is driven and has each of its lines judged.

    begin -> BLIND (the axis goes to 40 degrees down, one scan of 4 turns is requested) -> WATCHING -> close -> the map

A job judges a line outside the tick (5 ms of array work is too much for a tick). Its verdict is taken a fixed number of
ticks later, before the next line arrives; lines that arrive meanwhile wait. A hazard is known 0.14 s after the beams
met it.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from onboard.config import Config
from onboard.core.jobs import Late
from onboard.perception.scan.cloud import ahead
from onboard.planning.plan_records import GuardLine
from onboard.records import F64, Pose, Scan
from protocol.conventions import TICK_NS

if TYPE_CHECKING:  # built by the jobs, which run outside the tick
    from onboard.core.context import Context
    from onboard.perception.map.stop_map import StopMap
    from onboard.planning.guard.drive_guard import Bad
    from onboard.planning.guard.guarded_leg import Leg

GUARD_JOBS = frozenset({"guard_begin", "guard_listen", "guard_credit"})
TURNS = 4  # scanner turns per line: 10 lines a second
_LEAST_NS = 60_000_000  # between lines, for a sensor that gives more
_HELD_RAD = 0.01
_POSES = 20  # of the last 0.2 s; a line arrives 45 ms after its middle


class Guarding:
    """Guard of one leg. Call `begin`, `step` in each tick of the leg, then `close` each tick until it returns the map.

    bad: cells that stop the rover.
    blind_ns: for how long the guard has not been able to watch; 0 while it watches.
    """

    def __init__(self, config: Config) -> None:
        self.bad: tuple[Bad, ...] = ()
        self.blind_ns = 0
        self._config = config
        self._leg: Leg | None = None
        self._poses: deque[tuple[int, Pose]] = deque(maxlen=_POSES)
        self._lines: list[GuardLine] = []
        self._held_ns: int | None = None  # time since which the axis is in position
        self._line_ns = 0

    def begin(self, ctx: Context, memory: StopMap, ways: tuple[F64, F64]) -> None:
        """Begin a leg. ways: stations (k, 3) ahead, and the trail (m, 3) driven so far."""
        self._submit(ctx, "guard_begin", (memory, ctx.localisation.pose, ways, self._config))

    def step(self, ctx: Context) -> bool:
        """Process one tick; return whether the guard watches, so that the rover may drive."""
        ctx.lidar.stream(True, TURNS)
        ctx.nodes.park_tilt(self._config.drive_guard.tilt_rad)
        self._poses.append((ctx.now_ns, ctx.localisation.pose))
        self._take(ctx)
        self._held_ns = (self._held_ns or ctx.now_ns) if self._held(ctx) else None
        for scan in ctx.scans:
            self._hear(scan, ctx)
        self._judge(ctx)
        watching = self._held_ns is not None and self._line_ns > 0 and self._leg is not None
        watching = watching and not ctx.lidar.silent(ctx.now_ns)
        watching = watching and not ctx.jobs.overdue_ticks(ctx.tick, Late.HOLD)
        self.blind_ns = 0 if watching else self.blind_ns + TICK_NS
        return watching

    def close(self, ctx: Context, memory: StopMap) -> StopMap | None:
        """Return the map with the leg's lines entered, once all are judged, else None. The rover stands."""
        ctx.lidar.stream(False)
        self._take(ctx)
        if "guard_credit" in ctx.taken:
            kept: StopMap = ctx.taken["guard_credit"]
            return kept
        self._judge(ctx)
        if self._leg is not None and not GUARD_JOBS.intersection(ctx.jobs.running):
            self._submit(ctx, "guard_credit", (memory, self._leg, ctx.localisation.pose, self.bad, self._config))
        return None

    def _held(self, ctx: Context) -> bool:
        angle_rad = ctx.nodes.tilt_angle_rad
        off_rad = abs(angle_rad - self._config.drive_guard.tilt_rad) if angle_rad is not None else _HELD_RAD
        return off_rad < _HELD_RAD and not ctx.nodes.tilt_moving

    def _hear(self, scan: Scan, ctx: Context) -> None:
        angle_rad = ctx.nodes.tilt_angle_rad
        if self._held_ns is None or scan.start_ns < max(self._held_ns, self._line_ns + _LEAST_NS) or angle_rad is None:
            return
        self._line_ns = scan.start_ns
        middle_ns = scan.start_ns + round(len(scan.ranges_m) / 2 * scan.beam_ns)
        pose = min(self._poses, key=lambda row: abs(row[0] - middle_ns))[1]
        self._lines.append(GuardLine(ahead(scan, self._config.scanning.sector_rad), angle_rad, pose))

    def _take(self, ctx: Context) -> None:
        if "guard_begin" in ctx.taken:
            self._leg = ctx.taken["guard_begin"]
        if "guard_listen" in ctx.taken:
            self._leg, found = ctx.taken["guard_listen"]
            self.bad += tuple(cell for cell in found if cell not in self.bad)

    def _judge(self, ctx: Context) -> None:
        """Submit the waiting lines for judgement if no guard job of the leg runs."""
        if self._lines and self._leg is not None and not GUARD_JOBS.intersection(ctx.jobs.running):
            self._submit(ctx, "guard_listen", (self._leg, tuple(self._lines), self._config))
            self._lines = []

    def _submit(self, ctx: Context, name: str, arguments: tuple[object, ...]) -> None:
        ctx.jobs.submit(name, arguments, ctx.tick + self._config.jobs.guard_ticks)
