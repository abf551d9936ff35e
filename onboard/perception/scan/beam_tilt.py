"""Tilt angle of each beam at its own time, interpolated from samples of the axis, and the beams without a valid tilt.

    angle   o--o--o--o                    o--o--o     o  sample of the axis, in onboard time
                      \\   no samples   /              between two samples: linear, under 60 degrees/s and at 100 Hz
                       o              o                exact to 0.01 degrees
             steady    | turning |    | hole: no beam  before the first, after the last: nothing, never extrapolated

A beam is rejected where the axis starts, stops or reverses (load, backlash and lag differ there), and in a hole of the
samples across which the axis moved. From one segment of a sweep to the next the rate may rise up to 4 times; the
samples follow that change.
"""

from __future__ import annotations

import math

import numpy as np

from onboard.records import F64, Bool, TiltTrack

HOLE_NS = 30_000_000  # samples come each 5 ms while the axis moves, each 100 ms while it is parked
WINDOW_NS = 50_000_000  # before and after a sample: the motions in both are compared
_STEP_RAD = math.radians(0.2)  # two steps of a 12-bit encoder: smaller differences count as no motion


def tilt_at(track: TiltTrack, times_ns: F64, origin_ns: int) -> tuple[F64, Bool, Bool]:
    """Angle (rad), sampled flag and steady flag of beams fired at origin_ns + times_ns.

    times_ns: any shape, float64; the three results have the same shape. The angle of a beam that was not sampled has no
        meaning. With fewer than two samples in the track no beam is sampled.
    """
    if len(track.times_ns) < 2:
        return np.zeros(times_ns.shape), np.zeros(times_ns.shape, np.bool_), np.zeros(times_ns.shape, np.bool_)
    samples_ns = (track.times_ns - origin_ns).astype(np.float64)
    angles_rad = track.angles_rad
    after = np.clip(np.searchsorted(samples_ns, times_ns, side="right"), 1, len(samples_ns) - 1)
    gap_ns, moved_rad = np.diff(samples_ns), np.diff(angles_rad)
    whole = (gap_ns <= HOLE_NS) | (np.abs(moved_rad) <= _STEP_RAD)
    sampled = (times_ns >= samples_ns[0]) & (times_ns <= samples_ns[-1]) & whole[after - 1]
    share = (times_ns - samples_ns[after - 1]) / gap_ns[after - 1]
    angle = angles_rad[after - 1] + share * moved_rad[after - 1]
    steady = _steady(samples_ns, angles_rad)
    return angle, sampled, sampled & steady[after - 1] & steady[after]


def _steady(samples_ns: F64, angles_rad: F64) -> Bool:
    """Samples where the axis moved as much in the 50 ms after as in the 50 ms before, within a quarter.

    Near the ends of the track both windows are shortened to the time available on the shorter side.
    """
    window_ns = np.minimum(WINDOW_NS, np.minimum(samples_ns - samples_ns[0], samples_ns[-1] - samples_ns))
    before = angles_rad - np.interp(samples_ns - window_ns, samples_ns, angles_rad)
    after = np.interp(samples_ns + window_ns, samples_ns, angles_rad) - angles_rad
    most = np.maximum(np.abs(before), np.abs(after))
    steady: Bool = np.abs(after - before) <= np.maximum(0.75 * most, _STEP_RAD)
    return steady
