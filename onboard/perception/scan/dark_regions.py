"""Detection of ground that a sweep did not see: compact regions of beams without a return, next to beams that hit.

A dark rock returns nothing, but the cells at its rim contain hits of the ground around it, and gaps between hits are
filled. Single lost beams prove nothing: one in a hundred is lost anywhere, often several adjacent ones in one line. So
the search is for regions that chance does not produce, in the range image, lines (steep to flat) x beams:

    flat   . . . . . . . . .      . return    o none
           . . o o o o . . .  <-  the first return above: it shows how far the hidden ground extends at most
           . . o o o o . . .
           o . o o o o . o o      at least BEAMS beams wide and LINES lines high, and at least as high as an upright
           . . o o o o . . .      object of HEIGHT_M appears at that distance
           . . . . . . . . .  <-  the last ground below, within the mapping range
    steep  . . o o o . . . .      a group of beams lost in one line

The unseen ground begins where the last ground below ends. It is as deep as the hidden stretch, at most DEPTH_M: that
is the object itself; the ground behind it has no hits. A region without a return above (sky, ground that ends, a dirty
window) or with its ground below beyond the mapping range does not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.config import Rover, Scanning
from onboard.extrinsics import lidar_place, lidar_rotation
from onboard.native import each
from onboard.native.linear import product
from onboard.perception.scan.beam_tilt import tilt_at
from onboard.perception.scan.lost_beams import plane_range_m
from onboard.records import F32, F64, BeamStatus, Bool, Scan, TiltTrack
from onboard.records.scan import of_one_geometry

BEAMS, LINES = 4, 6
HEIGHT_M = 0.08  # the lowest rock that a wheel must not touch
DEPTH_M, STEP_M = 0.3, 0.05
GROUND_RATIO = 0.5  # of the distance to the plane through the wheels; nearer returns are dust or the rover's own deck

I64 = NDArray[np.int64]


class _Image(NamedTuple):
    """Lines of a sweep, ordered from steep to flat.

    tilt_rad: (lines,) tilt in the middle of each line.
    phi_rad: (beams,) angle in the scanner's plane.
    ranges_m: (lines, beams) range, m.
    returned: (lines, beams) the beam returned.
    lost: (lines, beams) the beam returned nothing.
    """

    tilt_rad: F64
    phi_rad: F64
    ranges_m: F32
    returned: Bool
    lost: Bool


def dark_regions(scans: Sequence[Scan], tilt: TiltTrack, rover: Rover, scanning: Scanning) -> F32:
    """Points of the unseen ground, (k, 3) float32 in base_link axes, some centimetres apart; usually none.

    If the scans have several geometries, only those of the most frequent one are used. Lines in which the axis was not
    steady are left out.
    """
    image = _image(scans, tilt, scanning)
    if image is None:
        return np.empty((0, 3), np.float32)
    line, beam = _windows(image, rover, scanning.range_m)
    return _points(image, line, beam, rover, scanning.range_m) if len(line) else np.empty((0, 3), np.float32)


def _image(scans: Sequence[Scan], tilt: TiltTrack, scanning: Scanning) -> _Image | None:
    """The image of the sector; None without lines or samples of the axis."""
    if not scans or len(tilt.times_ns) < 2:
        return None
    alike = of_one_geometry(scans)
    count, first_rad, step_rad = alike[0].geometry
    phi: F64 = first_rad + np.arange(count, dtype=np.float64) * step_rad
    beams = np.flatnonzero(np.abs(phi) <= scanning.sector_rad)
    if len(beams) < BEAMS:
        return None
    part = slice(int(beams[0]), int(beams[-1]) + 1)
    origin_ns, middle = int(tilt.times_ns[0]), float(beams.mean())
    middle_ns = np.array([scan.start_ns - origin_ns + middle * scan.beam_ns for scan in alike], np.float64)
    angles, _, steady = tilt_at(tilt, middle_ns, origin_ns)
    order = np.flatnonzero(steady)[np.argsort(-angles[steady], kind="stable")]
    if not len(order):
        return None
    status = np.stack([alike[k].status[part] for k in order])
    ranges_m = np.stack([alike[k].ranges_m[part] for k in order])
    return _Image(angles[order], phi[part], ranges_m, status == BeamStatus.OK, status == BeamStatus.NO_RETURN)


def _windows(image: _Image, rover: Rover, range_m: float) -> tuple[I64, I64]:
    """Steepest line and first beam of each window of lost beams that chance does not produce, sorted by line."""
    lines, beams = image.lost.shape
    count = _lines_high(image.tilt_rad, rover)
    first = np.flatnonzero((np.arange(lines) + count <= lines) & (_plane_m(image.tilt_rad, rover) <= 2 * range_m))
    before = np.zeros((lines + 1, beams), np.int32)
    np.cumsum(image.lost, axis=0, out=before[1:])
    full = before[first + count[first]] - before[first] == count[first, None]
    core = full[:, : beams - BEAMS + 1].copy()
    for shift in range(1, BEAMS):
        core &= full[:, shift : beams - BEAMS + 1 + shift]
    line, beam = np.nonzero(core)
    return first[line], beam


def _plane_m(tilt_rad: F64, rover: Rover) -> F64:
    """Distance straight ahead to the plane through the wheels, (lines,) m; inf at or above the horizon."""
    return plane_range_m(np.zeros(1), tilt_rad[:, None], rover)[:, 0]


def _lines_high(tilt_rad: F64, rover: Rover) -> I64:
    """Number of lines, from each line on, that an upright object of HEIGHT_M spans where the line meets the plane."""
    high_rad = HEIGHT_M * each.cos(tilt_rad) / _plane_m(tilt_rad, rover)
    last = np.searchsorted(-tilt_rad, high_rad - tilt_rad)
    count: I64 = np.maximum(LINES, last - np.arange(len(tilt_rad)))
    return count


class _Runs(NamedTuple):
    """Lost runs of columns, each field (k,).

    beam: column of the run.
    line: line of the run's steepest beam.
    begin_m, end_m: start and end of the hidden stretch, measured along the beam.
    """

    beam: I64
    line: I64
    begin_m: F64
    end_m: F64


def _runs(image: _Image, line: I64, beam: I64, rover: Rover, range_m: float) -> _Runs:
    """The lost runs of the columns of these windows, each once.

    All runs of a window begin at the nearest begin among them: a beam that passes the side of an object and then meets
    its top has ground behind the object as its last ground below.
    """
    columns, which = np.unique(beam[:, None] + np.arange(BEAMS), return_inverse=True)
    which = which.reshape(-1, BEAMS)
    plane_m = plane_range_m(image.phi_rad[columns], image.tilt_rad[:, None], rover)
    ranges_m = image.ranges_m[:, columns]
    ground = image.returned[:, columns] & (ranges_m >= GROUND_RATIO * np.minimum(plane_m, range_m))
    below, above = (of[line[:, None], which] for of in _neighbours(ground))
    # The steepest beam of the run, and where it would have met the ground: as far beyond the last hit as the plane.
    lowest = np.where(below >= 0, below + 1, line[:, None])
    with np.errstate(invalid="ignore"):
        longer = plane_m[lowest, which] / plane_m[below, which]
    longer = np.where(np.isfinite(longer), longer, 1.0)
    begin_m = np.where(below >= 0, ranges_m[below, which] * longer, plane_m[lowest, which]).min(axis=1)
    order = np.argsort(begin_m, kind="stable")  # of several windows of a run, the one that begins nearest counts
    which, below, above, lowest = which[order], below[order], above[order], lowest[order]
    _, once = np.unique(which * (len(ground) + 1) + below + 1, return_index=True)
    end_m = ranges_m[np.minimum(above, len(ground) - 1), which].ravel()[once].astype(np.float64)
    begin_m = np.repeat(begin_m[order], BEAMS)[once]
    good = (above.ravel()[once] < len(ground)) & (begin_m <= range_m) & (end_m > begin_m)
    return _Runs(columns[which.ravel()[once]][good], lowest.ravel()[once][good], begin_m[good], end_m[good])


def _points(image: _Image, line: I64, beam: I64, rover: Rover, range_m: float) -> F32:
    """The unseen ground of the columns of these windows: horizontally from the begin of each run to its end."""
    runs = _runs(image, line, beam, rover, range_m)
    tilt_rad, phi_rad = image.tilt_rad[runs.line], image.phi_rad[runs.beam]
    ahead = each.cos(phi_rad)
    ways = np.stack([ahead * each.cos(tilt_rad), each.sin(phi_rad), -ahead * each.sin(tilt_rad)], axis=1)
    mount = lidar_rotation(rover)
    if mount is not None:
        ways = product(ways, mount.T)
    level = np.maximum(each.hypot(ways[:, 0], ways[:, 1]), 1e-9)
    deep_m = np.minimum(DEPTH_M, (runs.end_m - runs.begin_m) * level)
    on_m = np.arange(0.0, DEPTH_M + STEP_M / 2, STEP_M)
    out = np.zeros((len(ways), 1, 3))
    out[:, 0, :2] = ways[:, :2] / level[:, None]
    starts_m = lidar_place(rover) + runs.begin_m[:, None] * ways
    points = (starts_m[:, None, :] + on_m[None, :, None] * out).astype(np.float32)
    found: F32 = points[on_m[None, :] <= deep_m[:, None]]
    return found


def _neighbours(ground: Bool) -> tuple[I64, I64]:
    """(line of the last True before each line, -1 without one; first True from it on, the number of lines without)."""
    lines = len(ground)
    number = np.arange(lines)[:, None]
    last = np.maximum.accumulate(np.where(ground, number, -1), axis=0)
    below = np.full_like(last, -1)
    below[1:] = last[:-1]
    above = np.minimum.accumulate(np.where(ground, number, lines)[::-1], axis=0)[::-1]
    return below, above
