"""One leg under the drive guard: begin on the map of its stop, process each line, enter the result into the map.

    begin(map, path, trail) -> leg;   hear(leg, line, pose) -> leg, bad cells;   credit(map, leg, pose, bad) -> map

Pure. The flight program and the kinematic missions both use these three functions; `listen` is the flight program's
`hear`, a job that makes the lines from scans.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.config import Config
from onboard.native import each
from onboard.perception.map import ldem, strip_map
from onboard.perception.map.cell_classes import classify
from onboard.perception.map.stop_map import StopMap
from onboard.perception.scan.cloud import cloud
from onboard.planning.guard import drive_guard
from onboard.planning.guard.drive_guard import Bad, GuardSettings, Watch
from onboard.planning.guard.wheel_footprint import tracks
from onboard.planning.plan_records import GuardLine
from onboard.records import F64, Bool, Cloud, Pose, TiltTrack
from protocol.conventions import wrap_rad

MARGIN_M = 3.0  # of the guard's grid around the path: the line reaches 2.5 m
NEXT = 6  # stations ahead that are searched: a line comes every 11 mm, and a path may cross itself
TURN_M = 0.2  # distance that a radian of heading counts as in that search


@dataclass(frozen=True, slots=True)
class Leg:
    """State of a leg.

    watch: state of the drive guard.
    stations: (k, 3) of the path.
    trail: (m, 3) driven before it.
    at: index of the station that was reached.
    ahead: cells (rows, columns) that wheels roll over from there on.
    """

    watch: Watch
    stations: F64
    trail: F64
    at: int
    ahead: Bool


def settings_of(config: Config) -> GuardSettings:
    """Parts of the configuration that the guard reads."""
    return GuardSettings(config.rover, config.mapping, config.drive_guard)


def begin(memory: StopMap, pose: Pose, ways: tuple[F64, F64], config: Config) -> Leg:
    """The guard of a leg that begins at `pose`.

    ways: stations (k, 3) to come, and the trail (m, 3) driven so far.
    """
    stations, trail = ways
    reach_m = MARGIN_M + float(np.abs(stations[:, :2] - (pose.x_m, pose.y_m)).max(initial=0.0))
    surface = classify(ldem.window(memory.cells, pose.x_m, pose.y_m, 2 * reach_m), config.mapping)
    ahead = tracks(stations, trail, surface.grid, config.rover)
    return Leg(drive_guard.begin(surface), stations, trail, 0, ahead)


def hear(leg: Leg, line: Cloud, pose: Pose, settings: GuardSettings) -> tuple[Leg, tuple[Bad, ...]]:
    """Process one line, in the map frame by the estimate `pose`; return the new leg and the cells that stop it."""
    at = _reached(leg, pose)
    if at != leg.at:
        ahead = tracks(leg.stations[at:], leg.trail, leg.watch.surface.grid, settings.rover)
        leg = replace(leg, at=at, ahead=ahead)
    watch, bad = drive_guard.hear(leg.watch, line, pose, leg.ahead, settings)
    return replace(leg, watch=watch), bad


def listen(leg: Leg, lines: Sequence[GuardLine], config: Config) -> tuple[Leg, tuple[Bad, ...]]:
    """Process lines as the scanner delivers them, in their order; see `hear`."""
    settings, found = settings_of(config), list[Bad]()
    for line in lines:
        leg, bad = hear(leg, cloud_of(line, config), line.pose, settings)
        found += bad
    return leg, tuple(found)


def credit(memory: StopMap, leg: Leg, pose: Pose, bad: Sequence[Bad], config: Config) -> StopMap:
    """The map with the strip's result merged, as the leg ends at `pose`, and the bad cells blocked for wheels."""
    ahead_m = drive_guard.ahead_m(config.rover, config.drive_guard)
    cells = strip_map.merge(memory.cells, leg.watch.strip, pose, ahead_m, config.mapping)
    blocked = {*memory.blocked_m, *((cell.x_m, cell.y_m) for cell in bad)}
    return replace(memory, cells=cells, blocked_m=tuple(sorted(blocked)))


def _reached(leg: Leg, pose: Pose) -> int:
    """The station nearest to a pose among the next few; never an earlier one."""
    near = leg.stations[leg.at : leg.at + NEXT]
    turned = np.abs([wrap_rad(yaw - pose.yaw_rad) for yaw in near[:, 2].tolist()])
    away_m = each.hypot(near[:, 0] - pose.x_m, near[:, 1] - pose.y_m) + TURN_M * turned
    return leg.at + int(np.argmin(away_m))


def cloud_of(line: GuardLine, config: Config) -> Cloud:
    """The line's beams, those without a return too. The axis does not move, so one angle applies to the whole scan."""
    scan = line.scan
    end_ns = scan.start_ns + round(len(scan.ranges_m) * scan.beam_ns) + 1
    held = TiltTrack(np.array([scan.start_ns, end_ns]), np.array([line.tilt_rad, line.tilt_rad]))
    noise_m = config.lidar.range_noise_m
    return cloud((scan,), held, line.pose.matrix(), config.rover, config.scanning, noise_m, lost=True)
