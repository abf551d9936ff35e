"""Trust range: on pitted ground a path is driven only as far as its wheels roll over cells seen from near.

A hole of width w is visible only to depth w * h / r from distance r (h the scanner's height), so a view from afar never
proves that a wheel will not fall (study 3.6). A wheel's cell is trusted if it and its 8 neighbours were

    hit from within trust_m, or filled or holed next to such hits, or assumed under the start,
    or lie under a pose that was driven before (R2),
    or will be swept by the guard's line on this path before the wheel arrives.

On smooth ground, with the guard, this applies only to parts of the way that lead sideways or back: no line was there
before. On smooth ground each cell must also have been seen from within near_m: from farther away a cell gets one to
five hits, and of a rock half hidden behind another they show only the foot.
Cells that the guard will sweep are trusted for this path only; the map gets a view with its data (`strip_map.merge`).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from onboard.native import each
from onboard.native.elementary import cos, square
from onboard.perception.map.cell_classes import classify
from onboard.planning import mission_rule
from onboard.planning.guard.drive_guard import ahead_m
from onboard.planning.guard.wheel_footprint import driven, wheel_squares
from onboard.planning.mission_rule import MissionState, Stop
from onboard.planning.plan_records import PlanningSettings, PlanRequest
from onboard.records import F64, Bool, CellClass, Decision, Grid, Ldem, Path

NOSE_M = 0.6  # the rover may always drive this far where a look shows nothing more
AHEAD_RATIO = cos(math.radians(30.0))  # least forward share of a way that the guard's line has swept before
SETTLE = 4  # stations: a cell is judged twice and the rover stopped before a wheel arrives
_NEIGHBOURS = np.ones((3, 3), np.bool_)


def within_trust(decision: Decision, request: PlanRequest, state: MissionState) -> Decision:
    """The decision with its path cut before the first station whose wheels are not trusted, to scan there.

    The decision itself if all stations are trusted. A path shorter than 0.6 m (NOSE_M) is driven only for a scan at a
    new place or heading (`mission_rule.repeats`). If that scan was taken before, the rover drives 0.6 m. So every cut
    stop is new or 0.6 m farther, and `stop_limit` ends the rest.
    """
    stations = decision.path.stations
    good = _good(stations, request)
    if decision.kind not in ("drive", "goal") or good.all():
        return decision
    way = np.concatenate([[0.0], np.cumsum(each.hypot(*np.diff(stations[:, :2], axis=0).T))])
    last = max(0, int(np.argmin(good)) - 1)
    if way[last] < NOSE_M and mission_rule.repeats(state, Stop(*(float(part) for part in stations[last]))):
        last = min(int(np.searchsorted(way, NOSE_M)), len(way) - 1)
    if last == len(stations) - 1:
        return decision
    reason = f"{decision.reason}; first {way[last]:.1f} m, then a look: the ground beyond was not seen from near"
    path = Path(stations[: last + 1])
    return replace(decision, kind="drive", path=path, reason=reason, heading_rad=float(stations[last, 2]))


def _good(stations: F64, request: PlanRequest) -> Bool:
    """Flags (k,) of stations (k, 3) that the rover may drive to without a look before."""
    mapping, guard_on = request.settings.mapping, request.settings.drive_guard.on
    if request.settings.mission.ground != "smooth":
        return trusted_stations(stations, request, mapping.trust_m, swept=guard_on)
    near = trusted_stations(stations, request, mapping.near_m, swept=False)
    if not guard_on:
        return near
    return near & (~sideways(stations) | trusted_stations(stations, request, mapping.trust_m, swept=True))


def trusted_stations(stations: F64, request: PlanRequest, range_m: float, swept: bool) -> Bool:
    """Flags (k,) of stations (k, 3) whose wheel cells are all trusted when the rover arrives.

    range_m: a cell counts as seen within this range.
    swept: cells that the guard's line will pass over count as seen.
    """
    grid, settings = request.ldem.grid, request.settings
    cells = wheel_squares(stations, grid, settings.rover)
    on = (cells >= 0).all(axis=2) & (cells[..., 0] < grid.rows) & (cells[..., 1] < grid.columns)
    j, i = np.where(on, cells[..., 0], 0), np.where(on, cells[..., 1], 0)
    seen = seen_near(request.ldem, settings, range_m)[j, i] & on
    if swept:
        seen |= _swept(stations, cells, grid, settings)
    found: Bool = seen.all(axis=1) | driven(stations, request.trail, grid)
    return found


def sideways(stations: F64) -> Bool:
    """Flags (k,) of stations (k, 3) whose way leads more than 30 degrees off their heading."""
    (dx, dy), yaw = np.diff(stations[:, :2], axis=0).T, stations[1:, 2]
    ahead_m = each.cos(yaw) * dx + each.sin(yaw) * dy
    found = np.zeros(len(stations), np.bool_)
    found[1:] = ahead_m < AHEAD_RATIO * each.hypot(dx, dy) - 1e-9
    return found


def seen_near(ldem: Ldem, settings: PlanningSettings, range_m: float) -> Bool:
    """Cells (rows, columns) that were seen from within range_m, or assumed under the rover at the start."""
    kind = classify(ldem, settings.mapping).cell_class
    near = (ldem.n > 0) & (ldem.view_m <= range_m)
    gap = (kind == CellClass.FILLED) | (kind == CellClass.HOLE)
    found: Bool = near | (gap & ndimage.binary_dilation(near, _NEIGHBOURS)) | (kind == CellClass.ASSUMED)
    return found


def _swept(stations: F64, cells: NDArray[np.int64], grid: Grid, settings: PlanningSettings) -> Bool:
    """Flags of the cells (k, m, 2) that the guard's line has passed over SETTLE stations before a wheel arrives.

    The line counts sideways as far as it is within the trust range of the scanner.
    """
    rover, guard = settings.rover, settings.drive_guard
    line_m = ahead_m(rover, guard)
    half_m = math.sqrt(max(0.0, square(settings.mapping.trust_m) - square(line_m - rover.lidar_x_m)))
    all_cells, which = np.unique(cells.reshape(-1, 2), axis=0, return_inverse=True)
    x = grid.x0_m + all_cells[:, 1] * grid.cell_m - stations[:, 0, None]  # (stations, cells)
    y = grid.y0_m + all_cells[:, 0] * grid.cell_m - stations[:, 1, None]
    c, s = each.cos(stations[:, 2, None]), each.sin(stations[:, 2, None])
    ahead, across = c * x + s * y, c * y - s * x
    passed = np.zeros(ahead.shape, np.bool_)
    passed[1:] = (ahead[:-1] > line_m) & (ahead[1:] <= line_m) & (np.abs(across[1:]) <= half_m)
    ever = np.maximum.accumulate(passed, axis=0)
    settled = np.zeros_like(ever)
    settled[SETTLE:] = ever[:-SETTLE]
    of_station = np.arange(len(stations))[:, None]
    found: Bool = settled[of_station, which.reshape(cells.shape[:2])]
    return found
