r"""Sweep of a stop: constant spacing on the ground, as a short list of constant-rate segments for the tilt node.

A line at depression a lies on flat ground at x = h / tan a, so lines `spacing` apart are spacing * sin(a)**2 / h apart
in angle, limited to a floor and a cap; from 3 degrees above the horizon on, the step grows to the cap again:

    rate  cap ____                              ____ cap
                  \                           /
                    \___                   /
                         \____floor____ /
    tilt  +60 deg   20    10   6        -3    -10    -20

TILT_COMMAND carries angles in 0.02 degrees, rates in 0.125 degrees/s and start times in ms. A segment over n angle
steps at m rate steps lasts 160 n / m ms, so segments join exactly if that is whole.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from onboard.config import Scanning
from onboard.native.elementary import sin
from onboard.records import F64

LINE_S = 0.025
ANGLE_STEP_RAD = math.radians(0.02)
RATE_STEP_RADPS = math.radians(0.125)
MOST_RATE_STEPS = 255
MOST_SEGMENTS = 24
SHORTEST_MS = 200
_MS_PER_STEP = 160  # 0.02 degrees at 0.125 degrees/s
_HORIZON_RAD = math.radians(-3.0)
_GROWTH_RATIO = 1.061  # ratio of the step from line to line, beyond the horizon


class TiltSegment(NamedTuple):
    """One constant-rate part of a sweep; the next begins where and when it ends. Positive angles are down.

    start_rad, end_rad: angles at its ends.
    rate_radps: signed rate.
    duration_ns: duration.
    """

    start_rad: float
    end_rad: float
    rate_radps: float
    duration_ns: int


def line_angles(scanning: Scanning, height_m: float) -> F64:
    """Tilt at the start of each line, (lines,) float64 rad, falling: the smooth profile that the segments follow.

    From the higher of start_rad and end_rad to the first angle at or below the lower one, a line every 25 ms
    (`10-navigation` section 3).
    height_m: height of the tilt axis above the ground, > 0.
    """
    angle = max(scanning.start_rad, scanning.end_rad)
    end = min(scanning.start_rad, scanning.end_rad)
    angles, step = [angle], 0.0
    while angle > end:
        if angle > _HORIZON_RAD:
            step = scanning.spacing_m * sin(angle) * sin(angle) / height_m
        else:
            step *= _GROWTH_RATIO
        step = min(max(step, scanning.floor_rad), scanning.cap_rad, MOST_RATE_STEPS * RATE_STEP_RADPS * LINE_S)
        angle -= step
        angles.append(angle)
    return np.array(angles)


def segments(scanning: Scanning, height_m: float) -> tuple[TiltSegment, ...]:
    """The sweep of a stop for a scanner at `height_m` over the ground: at most 24 segments of at least 0.2 s.

    Angles rad and rates rad/s in the steps of TILT_COMMAND, times ns; each follows the mean rate of `line_angles`
    (`10-navigation` section 3). Upwards (start_rad > end_rad) as drawn above; with start_rad < end_rad the same
    backwards.
    """
    profile = _Profile(line_angles(scanning, height_m), min(scanning.start_rad, scanning.end_rad))
    ratio = 1.10
    while len(pieces := _cut(profile, ratio)) > MOST_SEGMENTS:
        ratio *= 1.05
    made, at = [], profile.first
    for steps, rate in pieces:
        start_rad, end_rad = at * ANGLE_STEP_RAD, (at - steps) * ANGLE_STEP_RAD
        duration_ns = round(_MS_PER_STEP * steps * 1_000_000 / rate)
        made.append(TiltSegment(start_rad, end_rad, -rate * RATE_STEP_RADPS, duration_ns))
        at -= steps
    if scanning.start_rad < scanning.end_rad:
        made = [TiltSegment(s.end_rad, s.start_rad, -s.rate_radps, s.duration_ns) for s in reversed(made)]
    return tuple(made)


class _Profile:
    """Smooth profile over the angle steps of TILT_COMMAND, counted down from `first` to `last`."""

    def __init__(self, angles_rad: F64, end_rad: float) -> None:
        self.first = round(float(angles_rad[0]) / ANGLE_STEP_RAD)
        self.last = min(round(end_rad / ANGLE_STEP_RAD), self.first - 1)
        falling = np.arange(self.first, self.last - 1, -1) * ANGLE_STEP_RAD
        lines_ms = np.arange(len(angles_rad)) * LINE_S * 1e3
        rates = np.interp(-falling, -angles_rad[:-1], -np.diff(angles_rad)) / LINE_S / RATE_STEP_RADPS
        # lists, because they are read one by one
        self.rates: list[float] = rates.tolist()
        self.times_ms: list[float] = np.interp(-falling, -angles_rad, lines_ms).tolist()  # of each angle step, rising

    def time_ms(self, steps: int) -> float:
        """Time at which the profile is `steps` angle steps below its start."""
        return self.times_ms[steps]


def _cut(profile: _Profile, ratio: float) -> list[tuple[int, int]]:
    """(angle steps, rate steps) of each segment; in it the smooth rate changes by at most `ratio`, if 0.2 s allow."""
    total, done, now_ms = profile.first - profile.last, 0, 0.0
    pieces: list[tuple[int, int]] = []
    while done < total:
        target = _reach(profile, done, ratio)
        steps, rate = _fit(profile, done, target, now_ms)
        pieces.append((steps, rate))
        done += steps
        now_ms += _MS_PER_STEP * steps / rate
    return pieces


def _reach(profile: _Profile, done: int, ratio: float) -> int:
    """End step of the segment that begins at step `done`."""
    total = profile.first - profile.last
    low = high = profile.rates[done]
    end = done
    while end < total:
        end += 1
        low, high = min(low, profile.rates[end]), max(high, profile.rates[end])
        if high > ratio * low and profile.time_ms(end) - profile.time_ms(done) > 1.1 * SHORTEST_MS:
            break
    if profile.time_ms(total) - profile.time_ms(end) < 1.3 * SHORTEST_MS:
        return total
    return end


def _fit(profile: _Profile, done: int, target: int, now_ms: float) -> tuple[int, int]:
    """(angle steps, rate steps) of the segment to about `target`: whole milliseconds, its end on the profile's time."""
    total = profile.first - profile.last
    final = target == total
    slack = 0 if final else max(8, (target - done) // 8)
    best, best_score = (target - done, 1), math.inf
    for end in range(max(done + 1, target - slack), min(total, target + slack) + 1):
        steps, wanted_ms = end - done, profile.time_ms(end) - now_ms
        middle = _MS_PER_STEP * steps / max(wanted_ms, 1.0)
        for rate in range(max(1, int(middle * 0.9)), min(MOST_RATE_STEPS, int(middle * 1.1) + 1) + 1):
            if (_MS_PER_STEP * steps) % rate and not final:  # the duration must be whole milliseconds
                continue
            lasts_ms = _MS_PER_STEP * steps / rate
            if lasts_ms >= SHORTEST_MS or final:
                score = abs(lasts_ms - wanted_ms) / lasts_ms + 0.05 * abs(end - target) / max(1, target - done)
                if score < best_score:
                    best, best_score = (steps, rate), score
    return best
