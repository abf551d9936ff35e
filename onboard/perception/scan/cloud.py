"""Point cloud of a stop: scans, the tilt at each beam's own time and the rover's pose give points in the map frame.

p_tilt = range * (cos phi, sin phi, 0)           phi: angle of the beam in the scanner's plane
p_base = t + R R_y(tilt) p_tilt                  positive tilt is down; the scanner's centre t is on the axis,
                                                 R is the mounting rotation of the tilt unit (`onboard.extrinsics`)
p_map  = T_map_base p_base
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.config import Rover, Scanning
from onboard.extrinsics import lidar_place, lidar_rotation
from onboard.native import each
from onboard.native.elementary import hypot
from onboard.native.linear import product
from onboard.perception.scan.beam_tilt import tilt_at
from onboard.perception.scan.range_image import witnessed
from onboard.records import F32, F64, BeamStatus, Bool, Cloud, Scan, TiltTrack
from protocol.conventions import WHEEL_SIGNS

DECK_TOP_M = 0.50  # of the bare vehicle, above the wheel plane
SELF_MARGIN_M = 0.03
SCANS_AT_ONCE = 32  # a sweep has about 460; all together would need 40 MB of temporaries


def cloud(
    scans: Sequence[Scan],
    tilt: TiltTrack,
    T_map_base: F64,
    rover: Rover,
    scanning: Scanning,
    range_noise_m: float,
    lost: bool = False,
) -> Cloud:
    """The beams of one stop within scanning.sector_rad of straight ahead that hit something.

    Each beam takes the tilt interpolated at its own time, never extrapolated (`beam_tilt`). Returns farther than
    scanning.range_m become non-hits that end at that range: the beam passed. Dropped are: beams without a return,
    because their free length is unknown; returns without a witness (`range_image`); beams whose tilt was not sampled or
    not steady; beams that are too near or in error; and hits on the rover itself (its hull plus 3 cm).

    lost: keep beams without a return or a witness too, as non-hits that end at scanning.range_m. Such a cloud shows
        where nothing returned; it must not enter a map.
    """
    origin_base_m, mount = lidar_place(rover), lidar_rotation(rover)
    rotation, translation = T_map_base[:3, :3], T_map_base[:3, 3]
    boxes = hull_boxes(rover)
    ends: list[F32] = [np.empty((0, 3), np.float32)]
    hits: list[Bool] = [np.empty(0, np.bool_)]
    for _, alike in groupby(scans if len(tilt.times_ns) else (), key=attrgetter("geometry")):
        image = _image(list(alike), scanning, range_noise_m, lost)
        for first in range(0, len(image.starts_ns), SCANS_AT_ONCE):
            points_base_m, hit = _beams(image.lines(first, first + SCANS_AT_ONCE), tilt, scanning.range_m)
            if mount is not None:
                points_base_m = product(points_base_m, mount.T)
            points_base_m += origin_base_m
            kept = ~(hit & _inside(points_base_m, boxes))
            ends.append((product(points_base_m[kept], rotation.T) + translation).astype(np.float32))
            hits.append(hit[kept])
    origin_m = product(rotation, origin_base_m) + translation
    return Cloud(origin_m, np.concatenate(ends), np.concatenate(hits), range_noise_m)


def ahead(scan: Scan, sector_rad: float) -> Scan:
    """The scan's beams within sector_rad of straight ahead, copied; uses about half of the memory."""
    count, first_rad, step_rad = scan.geometry
    low = max(0, math.ceil((-sector_rad - first_rad) / step_rad - 1e-9))
    high = min(count, math.floor((sector_rad - first_rad) / step_rad + 1e-9) + 1)
    return replace(
        scan,
        start_ns=scan.start_ns + round(low * scan.beam_ns),
        first_angle_rad=first_rad + low * step_rad,
        ranges_m=scan.ranges_m[low:high].copy(),
        status=scan.status[low:high].copy(),
    )


class _Image(NamedTuple):
    """Scans of one geometry as (lines, beams) arrays over the sector.

    phi_rad: (beams,) angle of each beam in the scanner's plane.
    beam: (beams,) number of each beam.
    starts_ns: (lines,) start of each scan.
    beam_ns: (lines,) time between beams.
    ranges_m: (lines, beams) range, m.
    seen: (lines, beams) a return with a witness.
    counts: (lines, beams) the beam goes into the cloud.
    """

    phi_rad: F64
    beam: NDArray[np.int64]
    starts_ns: NDArray[np.int64]
    beam_ns: F64
    ranges_m: F32
    seen: Bool
    counts: Bool

    def lines(self, first: int, last: int) -> _Image:
        """The lines from first up to, not including, last."""
        some = slice(first, last)
        return self._replace(
            starts_ns=self.starts_ns[some],
            beam_ns=self.beam_ns[some],
            ranges_m=self.ranges_m[some],
            seen=self.seen[some],
            counts=self.counts[some],
        )


def _image(scans: Sequence[Scan], scanning: Scanning, range_noise_m: float, lost: bool) -> _Image:
    """The range image of scans of one geometry, cut to the sector.

    lost: count beams without a return or a witness too.
    """
    count, first_rad, step_rad = scans[0].geometry
    phi: F64 = first_rad + np.arange(count, dtype=np.float64) * step_rad
    beam = np.flatnonzero(np.abs(phi) <= scanning.sector_rad)
    part = slice(beam[0], beam[-1] + 1) if len(beam) else slice(0)
    ranges_m = np.stack([scan.ranges_m[part] for scan in scans])
    status = np.stack([scan.status[part] for scan in scans])
    seen = witnessed(ranges_m, status == BeamStatus.OK, range_noise_m)
    counts = (status == BeamStatus.OK) | (status == BeamStatus.NO_RETURN) if lost else seen
    starts_ns = np.array([scan.start_ns for scan in scans], np.int64)
    return _Image(phi[part], beam, starts_ns, np.array([scan.beam_ns for scan in scans]), ranges_m, seen, counts)


def _beams(image: _Image, tilt: TiltTrack, range_m: float) -> tuple[F64, Bool]:
    """Vectors (k, 3) from the scanner to the ends of the counted beams, in the tilt unit's axes, and hit flags (k,)."""
    origin_ns = int(tilt.times_ns[0])
    starts_ns = (image.starts_ns - origin_ns).astype(np.float64)
    angles, _, steady = tilt_at(tilt, starts_ns[:, None] + image.beam * image.beam_ns[:, None], origin_ns)
    good = image.counts & steady
    angle, ranges_m = angles[good], image.ranges_m[good]
    hit = image.seen[good] & (ranges_m <= range_m)
    length_m = np.where(hit, ranges_m, range_m).astype(np.float64)
    ahead_m = length_m * np.broadcast_to(each.cos(image.phi_rad), good.shape)[good]
    vectors_m = np.empty((len(length_m), 3))
    vectors_m[:, 0] = ahead_m * each.cos(angle)
    vectors_m[:, 1] = length_m * np.broadcast_to(each.sin(image.phi_rad), good.shape)[good]
    vectors_m[:, 2] = -ahead_m * each.sin(angle)
    return vectors_m, hit


def hull_boxes(rover: Rover, margin_m: float = SELF_MARGIN_M) -> F64:
    """Boxes (5, 2, 3), lowest and highest corner in base_link: deck, wheels at any steering angle, plus a margin."""
    length, width, radius = rover.half_wheelbase_m, rover.half_track_m, rover.wheel_radius_m
    reach = hypot(radius, rover.wheel_width_m / 2)
    boxes = [[[-length, -width, rover.belly_m], [length, width, DECK_TOP_M]]]
    for along, across in WHEEL_SIGNS:
        x, y = along * length, across * width
        boxes.append([[x - reach, y - reach, 0.0], [x + reach, y + reach, 2 * radius]])
    corners: F64 = np.array(boxes, np.float64) + np.array([[-margin_m], [margin_m]])
    return corners


def _inside(points_m: F64, boxes: F64) -> Bool:
    """Flags (k,) of points (k, 3) in any box: a test of the outer bounds, then of each box for the few left."""
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    inside: Bool = ((points_m >= low) & (points_m <= high)).all(axis=1)
    near = np.flatnonzero(inside)
    few_m = points_m[near, None, :]
    within = np.logical_and(few_m >= boxes[:, 0], few_m <= boxes[:, 1]).all(axis=2)
    inside[near] = np.logical_or.reduce(within, axis=1)
    return inside
