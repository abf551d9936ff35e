"""The nod of a stop: spacing on the ground, limits of TILT_COMMAND, exact joints."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.config import Scanning
from onboard.perception.scan import sweep

DEFAULT = sweep.segments(Scanning(), 0.70)


def tilt_deg(segments, times_s):
    ends_s = np.cumsum([s.duration_ns * 1e-9 for s in segments])
    angles = np.array([segments[0].start_rad] + [s.end_rad for s in segments])
    return np.degrees(np.interp(times_s, np.concatenate(([0.0], ends_s)), angles))


def check_wire_limits(segments):
    assert len(segments) <= 24
    for s in segments:
        for angle in (s.start_rad, s.end_rad):
            assert math.degrees(angle) / 0.02 == pytest.approx(round(math.degrees(angle) / 0.02), abs=1e-6)
        rate_steps = math.degrees(s.rate_radps) / 0.125
        assert rate_steps == pytest.approx(round(rate_steps), abs=1e-6) and 1 <= abs(round(rate_steps)) <= 255
        assert s.duration_ns >= 200_000_000
        assert s.rate_radps * s.duration_ns * 1e-9 == pytest.approx(s.end_rad - s.start_rad, abs=1e-8)
    for before, after in itertools.pairwise(segments):
        assert before.end_rad == after.start_rad
        assert before.duration_ns % 1_000_000 == 0


def test_default_sweep_takes_460_lines_and_11_5_s_in_at_most_24_segments():
    assert len(sweep.line_angles(Scanning(), 0.70)) == pytest.approx(460, abs=5)
    assert sum(s.duration_ns for s in DEFAULT) * 1e-9 == pytest.approx(11.5, abs=0.15)
    assert math.degrees(DEFAULT[0].start_rad) == pytest.approx(60)
    assert math.degrees(DEFAULT[-1].end_rad) == pytest.approx(-20)


def test_default_sweep_fits_the_fields_of_tilt_command_and_joins_exactly():
    check_wire_limits(DEFAULT)


@pytest.mark.parametrize(
    ("angle_deg", "rate_dps"), [(40, 20), (15, 10.8), (10, 5.0), (8, 3.2), (2, 1.6), (-5, 6.5), (-15, 20)]
)
def test_rate_at_a_tilt_is_that_of_the_study(angle_deg, rate_dps):
    rate = next(abs(s.rate_radps) for s in DEFAULT if s.end_rad <= math.radians(angle_deg) <= s.start_rad)
    assert math.degrees(rate) == pytest.approx(rate_dps, rel=0.2)


def test_lines_on_flat_ground_lie_5_cm_apart_between_2_and_6_m():
    angles = np.radians(tilt_deg(DEFAULT, np.arange(0, 11.4, 0.025)))
    x_m = 0.70 / np.tan(angles[angles > math.radians(5.7)])
    spacing_m = np.diff(x_m)[(x_m[1:] > 2.1) & (x_m[1:] < 6.0)]
    assert spacing_m.max() < 0.065 and spacing_m.min() > 0.035
    assert spacing_m.mean() == pytest.approx(0.05, rel=0.05)


def test_segments_stay_within_a_tenth_of_a_second_of_the_smooth_profile():
    angles_deg = np.degrees(sweep.line_angles(Scanning(), 0.70))
    times_s = np.arange(len(angles_deg)) * 0.025
    ends_s = np.cumsum([s.duration_ns * 1e-9 for s in DEFAULT])
    for end_s, s in zip(ends_s, DEFAULT):
        assert abs(end_s - np.interp(-math.degrees(s.end_rad), -angles_deg, times_s)) < 0.1


def test_a_sweep_the_other_way_is_the_same_backwards():
    down = Scanning()
    up = sweep.segments(dataclasses.replace(down, start_rad=down.end_rad, end_rad=down.start_rad), 0.70)
    check_wire_limits(up)
    assert [s.duration_ns for s in up] == [s.duration_ns for s in reversed(DEFAULT)]
    assert all(s.rate_radps > 0 for s in up)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.floats(0.3, 1.5), st.floats(0.02, 0.2), st.floats(20, 80), st.floats(-40, 0))
def test_every_sensible_sweep_fits_the_wire(height_m, spacing_m, start_deg, end_deg):
    scanning = dataclasses.replace(
        Scanning(), spacing_m=spacing_m, start_rad=math.radians(start_deg), end_rad=math.radians(end_deg)
    )
    check_wire_limits(sweep.segments(scanning, height_m))
