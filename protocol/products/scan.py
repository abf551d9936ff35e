"""Scan product: one sweep of the tilting scanner as a predicted range image, and the tilt axis samples.

    head | statuses | ranges of the pixels that have one | starts of the lines | their beam times | tilt: times, angles

A range becomes an integer by an explicit step, minus the prediction from its neighbours (half of the one before in the
same turn, a quarter of two in the turn before: a scanner's noise is larger than the ground's steps). From pixels,
times and tilt the receiver computes the points, each beam at its own time (`onboard.perception.scan.scan3d`).
"""

from __future__ import annotations

import struct
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from protocol import WireError
from protocol.products.packing import check, compress, expand, pack_integers, unpack_integers, within
from protocol.products.pose_map import MOST_PLACE_M, MOST_TURN_RAD
from protocol.products.prediction import integers, mean_of_three, residuals

SCAN_CODEC = "scan-1"
STEP_M = 0.00199  # at most 0.995 mm off, float32 rounding included at most 1 mm up to 60 m
TILT_STEP_RAD = 1e-5
TIME_STEP_NS = 1000
MOST_RANGE_M = 1000.0
_MOST_TIME_NS, _MOST_BEAM_NS = 1 << 60, 1e9
_MAGIC = b"SCN1"
_HEAD = struct.Struct("<4sHHHHddd24d6I")
_MAX_PIXELS = 4_000_000

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]
I64 = NDArray[np.int64]


class ScanProduct(NamedTuple):
    """One sweep.

    Beam k of line j was fired at start_ns[j] + k * beam_ns[j] in direction first_angle_rad + k * step_rad of the
    scanner's plane.

    stop: number of the stop.
    first_angle_rad, step_rad: directions of the beams.
    ranges_m: (lines, beams) float32, NaN where status is not 0.
    status: (lines, beams) uint8.
    start_ns: (lines,) time of each line's first beam.
    beam_ns: (lines,) time between beams.
    tilt_ns, tilt_rad: (k,) samples of the tilt axis, positive down.
    T_map_base: (4, 4), pose at which the scan entered the map.
    T_base_scanner: (4, 4), mounting of the scanner at tilt 0.
    """

    stop: int
    first_angle_rad: float
    step_rad: float
    ranges_m: F32
    status: U8
    start_ns: I64
    beam_ns: F64
    tilt_ns: I64
    tilt_rad: F64
    T_map_base: F64
    T_base_scanner: F64


def encode_scan(product: ScanProduct, step_m: float = STEP_M) -> bytes:
    """Encode the product; decoded lossy fields are within the steps above. Raises ValueError if shapes differ."""
    lines, beams = product.ranges_m.shape
    samples = len(product.tilt_ns)
    if product.status.shape != (lines, beams) or {len(product.start_ns), len(product.beam_ns)} != {lines}:
        raise ValueError(
            f"{lines} lines of {beams} beams, statuses {product.status.shape}, "
            f"{len(product.start_ns)} starts, {len(product.beam_ns)} beam times"
        )
    if len(product.tilt_rad) != samples or not 0 < lines * beams <= _MAX_PIXELS or max(lines, beams, samples) > 0xFFFF:
        raise ValueError(f"{lines} x {beams} pixels, {samples} times and {len(product.tilt_rad)} angles of the axis")
    known = product.status == 0
    ranges_m = np.where(known, product.ranges_m, 0).astype(np.float64)
    if not (np.isfinite(ranges_m) & (np.abs(ranges_m) <= MOST_RANGE_M)).all():
        raise ValueError(f"a range of status 0 is not a number of at most {MOST_RANGE_M:g} m")
    quanta = np.rint(ranges_m / step_m).astype(np.int64)
    packed = [
        compress(product.status.astype(np.uint8).tobytes()),
        pack_integers(residuals(quanta, known, mean_of_three)[known]),
        _pack_times(product.start_ns),
        compress(product.beam_ns.astype("<f8").tobytes()),
        _pack_times(product.tilt_ns),
        _pack_steps(np.rint(product.tilt_rad / TILT_STEP_RAD).astype(np.int64)),
    ]
    head = _HEAD.pack(
        _MAGIC,
        product.stop & 0xFFFF,
        lines,
        beams,
        samples,
        product.first_angle_rad,
        product.step_rad,
        step_m,
        *_top(product.T_map_base),
        *_top(product.T_base_scanner),
        *(len(p) for p in packed),
    )
    return head + b"".join(packed)


def decode_scan(data: bytes) -> ScanProduct:
    """Decode the product. Raises WireError("product") if it is malformed."""
    if len(data) < _HEAD.size:
        raise WireError("product", f"{len(data)} B are no scan")
    magic, stop, lines, beams, samples, first_rad, step_rad, step_m, *rest = _HEAD.unpack_from(data)
    shape = (lines, beams)
    if magic != _MAGIC or not 0 < lines * beams <= _MAX_PIXELS:
        raise WireError("product", f"{magic!r}, {lines} lines of {beams} beams")
    check(within(MOST_TURN_RAD, first_rad, step_rad) and within(1.0, step_m), f"beams at {first_rad:g}, {step_rad:g}")
    check(within(MOST_PLACE_M, *rest[:24]), "a pose of the scanner or rover that is none")
    ends = np.cumsum([_HEAD.size, *rest[24:]])
    if len(data) != ends[-1]:
        raise WireError("product", f"{len(data)} B instead of {ends[-1]}")
    parts = [data[a:b] for a, b in pairwise(ends)]
    status = expand(parts[0], lines * beams).reshape(shape)
    known = status == 0
    left = np.zeros(shape, np.int64)
    left[known] = unpack_integers(parts[1], int(known.sum()))
    quanta = integers(left, known, mean_of_three)
    tilt_rad: F64 = np.multiply(_unpack_steps(parts[5], samples), TILT_STEP_RAD, dtype=np.float64)
    beam_ns: F64 = expand(parts[3], 8 * lines).view(np.float64)
    ranges_m = np.where(known, quanta * step_m, np.nan)
    check(bool((np.abs(ranges_m[known]) <= 2 * MOST_RANGE_M).all()), "a range beyond every scanner")
    check(bool((np.abs(tilt_rad) <= MOST_TURN_RAD).all()), "a tilt of many turns")
    check(bool(((beam_ns >= 0) & (beam_ns <= _MOST_BEAM_NS)).all()), "beams that take no time or a second")
    start_ns, tilt_ns = _unpack_times(parts[2], lines), _unpack_times(parts[4], samples)
    return ScanProduct(
        stop,
        first_rad,
        step_rad,
        ranges_m.astype(np.float32),
        status,
        start_ns,
        beam_ns,
        tilt_ns,
        tilt_rad,
        _whole(rest[:12]),
        _whole(rest[12:24]),
    )


def _top(T: F64) -> list[float]:
    rows: list[float] = T[:3].reshape(-1).tolist()
    return rows


def _whole(rows: list[float]) -> F64:
    return np.vstack([np.array(rows, np.float64).reshape(3, 4), [0.0, 0.0, 0.0, 1.0]])


def _pack_times(times_ns: I64) -> bytes:
    """Pack times as second differences in microseconds: a steady rate takes almost no bytes."""
    steps = (times_ns + TIME_STEP_NS // 2) // TIME_STEP_NS
    return pack_integers(np.diff(np.diff(steps, prepend=0), prepend=0))


def _unpack_times(data: bytes, count: int) -> I64:
    steps: I64 = np.cumsum(np.cumsum(unpack_integers(data, count)))
    check(bool(((steps >= 0) & (steps <= _MOST_TIME_NS // TIME_STEP_NS)).all()), "a time before the start, or never")
    return steps * TIME_STEP_NS


def _pack_steps(steps: I64) -> bytes:
    return pack_integers(np.diff(np.diff(steps, prepend=0), prepend=0))


def _unpack_steps(data: bytes, count: int) -> I64:
    steps: I64 = np.cumsum(np.cumsum(unpack_integers(data, count)))
    return steps
