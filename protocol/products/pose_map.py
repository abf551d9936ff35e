"""Pose map section after a map's bytes: freedom of all poses, and the rover's pose on the map.

A pose is a cell and one of 8 orientations of the body's axis (k * 22.5 degrees modulo 180); it is blocked, unknown or
free: 0, 1, 2. The eight poses of a cell are one 16-bit word, 2 bits each, orientation 0 lowest. Words become two byte
planes, zstandard compresses them. With this section the ground runs the rover's own planner on the same bits
(`onboard.planning.prediction`).
"""

from __future__ import annotations

import struct
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from protocol import WireError
from protocol.products.packing import check, compress, expand, within

_HEAD = struct.Struct("<4sB8sdddHHHI")
MAGIC = b"POS1"
_MOST_PLACES = 1000
MOST_PLACE_M, MOST_TURN_RAD = 1e7, 1e3
ORIENTATIONS = 8
U8 = NDArray[np.uint8]


class PoseMap(NamedTuple):
    """Freedom of poses and state of the rover.

    freedom: (8, rows, columns) uint8, 0 blocked, 1 unknown, 2 free.
    pose: x m, y m, yaw rad of the rover.
    slippery_m: places where the wheels slipped, x, y, with an error of at most 2 mm.
    known: True if the map covers the ground under the rover, so that a goto scans ahead only.
    settings: digest of the settings that planning reads.
    """

    freedom: U8
    pose: tuple[float, float, float]
    slippery_m: tuple[tuple[float, float], ...] = ()
    known: bool = True
    settings: bytes = bytes(8)


def encode_poses(poses: PoseMap) -> bytes:
    """Encode the section. Raises ValueError for a wrong shape or value of freedom."""
    freedom = poses.freedom
    if freedom.ndim != 3 or freedom.shape[0] != ORIENTATIONS or 0 in freedom.shape or int(freedom.max()) > 2:
        raise ValueError(f"freedom {freedom.shape} should be 8 layers of 0 to 2")
    if len(poses.slippery_m) > _MOST_PLACES or len(poses.settings) != 8:
        raise ValueError(f"{len(poses.slippery_m)} slippery places, a digest of {len(poses.settings)} B")
    word = np.zeros(freedom.shape[1:], np.uint16)
    for o in range(ORIENTATIONS):
        word |= freedom[o].astype(np.uint16) << np.uint16(2 * o)
    planes = (word & 0xFF).astype(np.uint8).tobytes() + (word >> 8).astype(np.uint8).tobytes()
    packed = compress(planes)
    head = _HEAD.pack(
        MAGIC, poses.known, poses.settings, *poses.pose, *freedom.shape[1:], len(poses.slippery_m), len(packed)
    )
    return head + np.array(poses.slippery_m, "<f4").tobytes() + packed


def decode_poses(data: bytes) -> PoseMap:
    """Decode the section. Raises WireError("product") if it is malformed."""
    try:
        magic, known, settings, x_m, y_m, yaw_rad, rows, columns, places, size = _HEAD.unpack_from(data)
        at = _HEAD.size + 8 * places
        if magic != MAGIC or not 0 < rows * columns <= 4_000_000 or len(data) != at + size:
            raise ValueError(f"{magic!r}, {rows} x {columns}, {len(data)} B")
        slippery = np.frombuffer(data, "<f4", 2 * places, _HEAD.size).astype(float).reshape(-1, 2)
    except (struct.error, ValueError) as error:
        raise WireError("product", f"poses: {error}") from error
    check(within(MOST_PLACE_M, x_m, y_m) and within(MOST_TURN_RAD, yaw_rad), "poses: a rover at no place")
    check(bool((np.abs(slippery) <= MOST_PLACE_M).all()), "poses: a slippery place that is none")
    check(known <= 1, f"poses: {known} for true or false")
    low, high = expand(data[at:], 2 * rows * columns).reshape(2, rows, columns).astype(np.uint16)
    word = low | high << np.uint16(8)
    freedom = np.stack([word >> np.uint16(2 * o) & np.uint16(3) for o in range(ORIENTATIONS)]).astype(np.uint8)
    if int(freedom.max()) > 2:
        raise WireError("product", "poses: a freedom over 2")
    return PoseMap(freedom, (x_m, y_m, yaw_rad), tuple((x, y) for x, y in slippery.tolist()), bool(known), settings)
