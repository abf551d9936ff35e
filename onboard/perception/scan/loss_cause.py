"""Cause of lost beams, from the sweeps of a mission; UNKNOWN where the causes cannot be separated.

    BLIND      in nearly all directions, or more with each of the last sweeps: the scanner itself
    WINDOW     the same directions of the scanner's own frame at all distances, after the rover turned as before
    SUN        the same directions of the map at all distances, after the rover turned
    GROUND     one place: distances before or behind it are seen, and from elsewhere the same place is lost again
    END        nothing from some distance on, up to the horizon: the ground ends, falls away, or is dark from there on

One sweep alone gives only CLEAR, BLIND and END: dirt and sunlight look the same in it, and so do dark ground and dirt
low on the window. Beams to the sky are not counted: a beam that meets nothing there is no loss.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

import numpy as np

from onboard.native.elementary import atan2, cos, dist, hypot, sin
from onboard.perception.scan.lost_beams import BANDS_M, SECTORS, SURE_BANDS, LostBeams
from onboard.records import Bool, Pose
from protocol.conventions import wrap_rad

BAD_RATIO = 0.2  # a sector with a larger lost share is bad
NEARLY_ALL = 0.75  # of the sectors
GROWTH_RATIO = 0.05  # from sweep to sweep, twice
ALIKE_RATIO = 0.5  # of the bad sectors must be the same in both sweeps
APART_RAD, APART_M = math.radians(20.0), 0.8  # a sweep turned or moved by more than this counts as another view


class Cause(Enum):
    """Cause of lost beams."""

    CLEAR = "nothing"
    BLIND = "the scanner goes blind"
    WINDOW = "dirt on the window"
    SUN = "sunlight"
    GROUND = "dark ground"
    END = "ground that ends or is dark"
    UNKNOWN = "an unknown cause"


@dataclass(frozen=True, slots=True)
class SweepLoss:
    """Lost beams of one sweep, and the pose in the map from which it was taken."""

    lost: LostBeams
    pose: Pose


def cause(views: Sequence[SweepLoss], clear_ratio: float) -> Cause:
    """Cause of the losses of the newest view.

    clear_ratio: an overall share up to this, without a bad sector, is no loss.
    """
    if not views:
        return Cause.CLEAR
    newest = views[-1].lost
    sectors = newest.sectors
    bad = _bad(newest)
    earlier = [view for view in views[:-1] if _elsewhere(view.pose, views[-1].pose)]
    if _blind(views, bad, int(np.isfinite(sectors).sum())):
        known = any(_bounded(view.lost) and _same_place(views[-1], view) for view in earlier)
        return Cause.GROUND if known else Cause.BLIND
    if not _lost_cells(newest).any():
        if int(newest.open.sum()) > BAD_RATIO * int(newest.due.sum() + newest.open.sum()):
            return Cause.END
        return Cause.CLEAR if newest.ratio <= clear_ratio else Cause.UNKNOWN
    if bad.any() and _at_all_distances(newest, bad):
        window, sun = _turned(views[-1], bad, earlier)
        if window or sun:
            return Cause.UNKNOWN if window and sun else Cause.WINDOW if window else Cause.SUN
    return Cause.GROUND if any(_same_place(views[-1], view) for view in earlier) else Cause.UNKNOWN


def _blind(views: Sequence[SweepLoss], bad: Bool, judged: int) -> bool:
    if judged and bad.sum() >= NEARLY_ALL * judged:
        return True
    ratios = [view.lost.ratio for view in views[-3:]]
    return len(ratios) == 3 and ratios[-1] > BAD_RATIO and all(b - a > GROWTH_RATIO for a, b in pairwise(ratios))


def _bad(lost: LostBeams) -> Bool:
    bad: Bool = np.nan_to_num(lost.sectors) > BAD_RATIO
    return bad


def _lost_cells(lost: LostBeams) -> Bool:
    bad: Bool = np.nan_to_num(lost.cells) > BAD_RATIO
    return bad


def _at_all_distances(lost: LostBeams, bad: Bool) -> bool:
    """True if most of the judged near bands of the bad sectors are lost; farther bands have few witnesses."""
    judged = np.isfinite(lost.cells[bad, :SURE_BANDS])
    return float(_lost_cells(lost)[bad, :SURE_BANDS].sum()) > 0.7 * float(judged.sum())


def _bounded(lost: LostBeams) -> bool:
    """True if most of the judged cells were seen."""
    return 2 * int(_lost_cells(lost).sum()) < int(np.isfinite(lost.cells).sum())


def _elsewhere(a: Pose, b: Pose) -> bool:
    return abs(wrap_rad(a.yaw_rad - b.yaw_rad)) > APART_RAD or dist((a.x_m, a.y_m), (b.x_m, b.y_m)) > APART_M


def _turned(newest: SweepLoss, bad: Bool, earlier: Sequence[SweepLoss]) -> tuple[bool, bool]:
    """(window, sun): in a sweep of another heading the same sectors, or those of the same map bearings, are bad."""
    window = sun = False
    for view in earlier:
        turned_rad = wrap_rad(view.pose.yaw_rad - newest.pose.yaw_rad)
        if abs(turned_rad) <= APART_RAD:
            continue
        before = _bad(view.lost)
        window = window or _alike(bad, before)
        sun = sun or _alike(_shifted(bad, round(turned_rad / view.lost.width_rad)), before)
    return window, sun


def _shifted(sectors: Bool, turned: int) -> Bool:
    """The same map directions as sectors of a rover that is turned left by `turned` sectors."""
    moved = np.zeros_like(sectors)
    for k in np.flatnonzero(sectors) - turned:
        if 0 <= k < SECTORS:
            moved[k] = True
    return moved


def _alike(a: Bool, b: Bool) -> bool:
    either = int((a | b).sum())
    return either > 0 and int((a & b).sum()) >= ALIKE_RATIO * either


def _same_place(newest: SweepLoss, other: SweepLoss) -> bool:
    """True if the losses of the newest view lie where the other view lost beams too, and nowhere else."""
    met = same = 0
    lost = _lost_cells(other.lost)
    for sector, band in np.argwhere(_lost_cells(newest.lost)).tolist():
        x_m, y_m = place(newest, sector, 0.5 * (BANDS_M[band] + BANDS_M[band + 1]))
        azimuth_rad, range_m = direction(other.pose, x_m, y_m)
        at = other.lost.sector(azimuth_rad)
        if at is None or not BANDS_M[0] < range_m < BANDS_M[-1]:
            continue
        row = int(np.searchsorted(BANDS_M, range_m)) - 1
        near = lost[max(0, at - 1) : at + 2, max(0, row - 1) : row + 2]
        met, same = met + 1, same + bool(near.any())
    return met > 0 and same >= ALIKE_RATIO * met


def place(view: SweepLoss, sector: int, range_m: float) -> tuple[float, float]:
    """Map position of the middle of a sector at a distance."""
    bearing_rad = view.pose.yaw_rad + view.lost.azimuth_rad(sector)
    return view.pose.x_m + range_m * cos(bearing_rad), view.pose.y_m + range_m * sin(bearing_rad)


def direction(pose: Pose, x_m: float, y_m: float) -> tuple[float, float]:
    """Azimuth from straight ahead (rad) and distance (m) of a point of the map."""
    dx, dy = x_m - pose.x_m, y_m - pose.y_m
    return wrap_rad(atan2(dy, dx) - pose.yaw_rad), hypot(dx, dy)
