"""Insertion of one scan straight into a live grid: the result of `cloud` and `kernel_calls.raster` without the cloud.

    live = LiveGrid(grid)
    live.add_turn(turn_of(scan, tilt, scanning), mount_of(T_map_base, rover))

For maps that take one line at a time at a known pose: the strip before the wheels while driving. The map of a stop
cannot be made this way: its cloud is registered first, which decides the pose, and it needs z_ray, for which each beam
is traced (`stop_map`).
"""

from __future__ import annotations

import numpy as np

from onboard.config import Rover, Scanning
from onboard.extrinsics import lidar_place, lidar_rotation
from onboard.kernel_calls.cells import BeamBlock, LiveGrid, Mount
from onboard.native import each
from onboard.native.linear import product
from onboard.perception.scan.beam_tilt import tilt_at
from onboard.perception.scan.cloud import hull_boxes
from onboard.records import F64, Scan, TiltTrack

__all__ = ["LiveGrid", "mount_of", "turn_of"]
_NONE: F64 = np.empty(0)


def turn_of(scan: Scan, tilt: TiltTrack, scanning: Scanning) -> BeamBlock:
    """The beams of one scan that `cloud` would use: within scanning.sector_rad, fired while the tilt was measured.

    The tilt is interpolated at each beam's own time, never extrapolated (`beam_tilt`).
    """
    if not len(tilt.times_ns):
        return BeamBlock(scan.ranges_m[:0], _directions(_NONE), _directions(_NONE), scanning.range_m)
    beams, origin_ns = np.arange(len(scan.ranges_m), dtype=np.float64), int(tilt.times_ns[0])
    phi = scan.first_angle_rad + beams * scan.step_rad
    times_ns = float(scan.start_ns - origin_ns) + beams * scan.beam_ns
    angle, _, steady = tilt_at(tilt, times_ns, origin_ns)
    good = (np.abs(phi) <= scanning.sector_rad) & steady
    return BeamBlock(scan.ranges_m[good], _directions(phi[good]), _directions(angle[good]), scanning.range_m)


def mount_of(T_map_base: F64, rover: Rover) -> Mount:
    """The scanner on a rover whose base_link stands at T_map_base (4, 4), with the hull that `cloud` masks.

    If the scanner's mounting is rotated, the result uses the scanner's axes: rover pose and hull are rotated instead.
    """
    place, mount = lidar_place(rover), lidar_rotation(rover)
    if mount is not None:
        turned = np.eye(4)
        turned[:3, :3] = mount
        place, T_map_base = product(mount.T, place), product(T_map_base, turned)
    return Mount(place, hull_boxes(rover), T_map_base)


def _directions(angles_rad: F64) -> F64:
    return np.stack([each.cos(angles_rad), each.sin(angles_rad)])
