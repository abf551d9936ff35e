"""Product of a sweep, from which the ground computes points: the work of `get scan`, run outside the tick."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from onboard.config import Rover
from onboard.extrinsics import lidar_place, lidar_rotation
from onboard.records import BeamStatus, Pose, Scan, TiltTrack
from protocol.products.scan import ScanProduct, encode_scan


def pack(scans: Sequence[Scan], tilt: TiltTrack, entry: tuple[Pose, int], rover: Rover) -> bytes:
    """Bytes of the product.

    entry: the pose at which the sweep entered the map, and its stop. Scans whose geometry differs from that of most
        scans (the scanner restarted in mid-sweep) are left out: an image has one geometry.
    """
    geometry = Counter(_geometry(scan) for scan in scans).most_common(1)[0][0]
    kept = [scan for scan in scans if _geometry(scan) == geometry]
    pose, stop = entry
    mount = np.eye(4)
    turned = lidar_rotation(rover)
    mount[:3, :3], mount[:3, 3] = np.eye(3) if turned is None else turned, lidar_place(rover)
    ranges_m, status = np.stack([scan.ranges_m for scan in kept]), np.stack([scan.status for scan in kept])
    return encode_scan(
        ScanProduct(
            stop,
            geometry[1],
            geometry[2],
            ranges_m,
            np.where((status == BeamStatus.OK) & ~np.isfinite(ranges_m), BeamStatus.ERROR, status).astype(np.uint8),
            np.array([scan.start_ns for scan in kept], np.int64),
            np.array([scan.beam_ns for scan in kept], np.float64),
            tilt.times_ns,
            tilt.angles_rad,
            pose.matrix(),
            mount,
        )
    )


def _geometry(scan: Scan) -> tuple[int, float, float]:
    return len(scan.ranges_m), scan.first_angle_rad, scan.step_rad
