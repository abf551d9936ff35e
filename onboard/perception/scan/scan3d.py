"""3D scan of the tilting scanner: one range image with the tilt and the time of every beam, and its points.

pixels[line, beam]    line: one turn of the scanner, in time order      beam: counter-clockwise, as fired

p_tilt = range * (cos phi, sin phi, 0)           phi = first_angle_rad + beam * step_rad
p_base = t + R R_y(tilt) p_tilt                  positive tilt is down; t, R: tilt unit (`onboard.extrinsics`)
p_map  = T_map_base(time) p_base                 the rover's pose at the beam's own time, if it moves
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from onboard.config import Rover
from onboard.extrinsics import lidar_place, lidar_rotation
from onboard.native import each
from onboard.native.linear import product
from onboard.perception.scan.beam_tilt import tilt_at
from onboard.records import F64, BeamStatus, Bool, Scan, TiltTrack

PIXEL = np.dtype([("range_m", "<f4"), ("tilt_rad", "<f4"), ("time_ns", "<i8"), ("intensity", "<i4"), ("mask", "u1")])
Pixels = NDArray[np.void]


class Mask(IntEnum):
    """Reason why a pixel has no point, in addition to the values of BeamStatus; 0 (BeamStatus.OK) is a point."""

    NO_TILT = 16  # fired before the first or after the last sample of the axis, or in a hole of them
    TURNING = 17  # fired while the axis sped up, slowed down or turned round


@dataclass(frozen=True, slots=True)
class Scan3d:
    """One sweep.

    pixels: (lines, beams) of PIXEL. Fields of a pixel:
        range_m: NaN if the sensor gave none (it stays if only the tilt is missing).
        tilt_rad: NaN for Mask.NO_TILT.
        time_ns: onboard time.
        intensity: -1 if it was not requested.
        mask: BeamStatus or Mask, 0 for a point.
    first_angle_rad: angle of beam 0.
    step_rad: angle between beams.
    """

    pixels: Pixels
    first_angle_rad: float
    step_rad: float

    @property
    def azimuths_rad(self) -> F64:
        """Direction of each beam in the scanner's plane, (beams,), 0 ahead, positive left."""
        return self.first_angle_rad + np.arange(self.pixels.shape[1], dtype=np.float64) * self.step_rad

    @property
    def valid(self) -> Bool:
        """Flags (lines, beams) of the pixels that are points."""
        points: Bool = self.pixels["mask"] == BeamStatus.OK
        return points


@dataclass(frozen=True, slots=True)
class PoseTrack:
    """Poses of the rover over time.

    times_ns: (k,) int64, rising.
    poses: (k, 6) x, y, z (m), roll, pitch, yaw (rad).
    """

    times_ns: NDArray[np.int64]
    poses: F64


@dataclass(frozen=True, slots=True)
class Points:
    """Points of a scan.

    xyz_m: (k, 3) float64.
    pixels: (k,) of PIXEL.
    line, beam: (k,) their place in the image.
    """

    xyz_m: F64
    pixels: Pixels
    line: NDArray[np.intp]
    beam: NDArray[np.intp]


def gather(scans: Sequence[Scan], tilt: TiltTrack) -> Scan3d:
    """The 3D scan of turns of one geometry, in time order; their arrays are copied.

    Raises ValueError without a scan, and if number or direction of the beams differ between the scans.
    """
    geometry = {(len(scan.ranges_m), scan.first_angle_rad, scan.step_rad) for scan in scans}
    if len(geometry) != 1:
        raise ValueError(f"a 3D scan needs turns of one geometry, these have {len(geometry)}")
    ((beams, first_rad, step_rad),) = geometry
    pixels: Pixels = np.empty((len(scans), beams), PIXEL)
    origin_ns = min(scan.start_ns for scan in scans)
    since_ns = np.array([[scan.start_ns - origin_ns] for scan in scans], np.float64)
    since_ns = since_ns + np.array([[scan.beam_ns] for scan in scans]) * np.arange(beams)
    angle, sampled, steady = tilt_at(tilt, since_ns, origin_ns)
    status = np.stack([scan.status for scan in scans])
    pixels["range_m"] = np.stack([scan.ranges_m for scan in scans])
    pixels["tilt_rad"] = np.where(sampled, angle, np.nan)
    pixels["time_ns"] = origin_ns + np.rint(since_ns).astype(np.int64)
    for row, scan in zip(pixels, scans):
        row["intensity"] = -1 if scan.intensity is None else scan.intensity
    without = np.where(sampled, Mask.TURNING, Mask.NO_TILT)
    pixels["mask"] = np.where((status == BeamStatus.OK) & ~steady, without, status)
    return Scan3d(pixels, first_rad, step_rad)


def points(scan: Scan3d, rover: Rover, poses: PoseTrack | None = None) -> Points:
    """The valid pixels as points: in base_link, or with `poses` in their frame, each by the pose at its own time.

    Poses are interpolated linearly (yaw over the shorter way); beams before the first or after the last are left out.
    """
    line, beam = np.nonzero(scan.valid)
    pixels = scan.pixels[line, beam]
    if poses is not None:
        within = (pixels["time_ns"] >= poses.times_ns[0]) & (pixels["time_ns"] <= poses.times_ns[-1])
        line, beam, pixels = line[within], beam[within], pixels[within]
    phi, tilt = scan.azimuths_rad[beam], pixels["tilt_rad"].astype(np.float64)
    range_m = pixels["range_m"].astype(np.float64)
    ahead_m = range_m * each.cos(phi)
    xyz_m = np.stack([ahead_m * each.cos(tilt), range_m * each.sin(phi), -ahead_m * each.sin(tilt)], axis=1)
    mount = lidar_rotation(rover)
    if mount is not None:
        xyz_m = product(xyz_m, mount.T)
    xyz_m += lidar_place(rover)
    if poses is not None:
        _move(xyz_m, pixels["time_ns"], poses)
    return Points(xyz_m, pixels, line, beam)


def _move(xyz_m: F64, times_ns: NDArray[Any], poses: PoseTrack) -> None:
    """Transform base_link to the poses' frame, in place: roll, pitch, yaw, then position, each at the point's time."""
    at = (times_ns - poses.times_ns[0]).astype(np.float64)
    known = (poses.times_ns - poses.times_ns[0]).astype(np.float64)
    whole = np.column_stack([poses.poses[:, :3], np.unwrap(poses.poses[:, 3:], axis=0)])
    for column, (i, j) in ((3, (1, 2)), (4, (2, 0)), (5, (0, 1))):  # about x: y towards z, and so on
        angle = np.interp(at, known, whole[:, column])
        cosine, sine = each.cos(angle), each.sin(angle)
        first, second = xyz_m[:, i].copy(), xyz_m[:, j].copy()
        xyz_m[:, i] = cosine * first - sine * second
        xyz_m[:, j] = sine * first + cosine * second
    for column in range(3):
        xyz_m[:, column] += np.interp(at, known, whole[:, column])
