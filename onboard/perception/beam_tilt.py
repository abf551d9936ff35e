"""The tilt of each beam at its own time, from samples of the axis; and which beams have none that can be trusted.

    angle   o--o--o--o                    o--o--o     o  sample of the axis, in onboard time
                      \\   no samples   /              between two samples: linear, under 60 degrees/s and at 100 Hz
                       o              o                exact to 0.01 degrees
             steady    | turning |    | hole: no beam  before the first, after the last: nothing, never extrapolated

A beam is turned down where the axis starts, stops or turns round (load, backlash and lag differ there), and in a hole
of the samples across which the axis moved. From one segment of a sweep to the next the rate may be up to 4 times as
high: that the samples show as it is.
"""

from __future__ import annotations

import math

import numpy as np

from onboard.records import F64, Bool, TiltTrack

HOLE_NS = 30_000_000  # samples come each 5 ms while the axis moves, each 100 ms while it is parked
WINDOW_NS = 50_000_000  # before and after: what the axis moved in them is compared
_STEP_RAD = math.radians(0.2)  # two steps of a 12-bit encoder: less is no motion and no change of it


def tilt_at(track: TiltTrack, times_ns: F64, origin_ns: int) -> tuple[F64, Bool, Bool]:
    """Angle (rad), whether it was sampled, whether the axis was steady, of beams fired at origin_ns + times_ns.

    times_ns: any shape, float64; all three results have it. Of beams that were not sampled the angle means nothing, and
    of a track with fewer than two samples no beam was.
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
    """Whether the axis moved as much in the 50 ms after each sample as in the 50 ms before, to a quarter.

    Near the ends of the track the windows are as long as both can be.
    """
    window_ns = np.minimum(WINDOW_NS, np.minimum(samples_ns - samples_ns[0], samples_ns[-1] - samples_ns))
    before = angles_rad - np.interp(samples_ns - window_ns, samples_ns, angles_rad)
    after = np.interp(samples_ns + window_ns, samples_ns, angles_rad) - angles_rad
    most = np.maximum(np.abs(before), np.abs(after))
    steady: Bool = np.abs(after - before) <= np.maximum(0.75 * most, _STEP_RAD)
    return steady
