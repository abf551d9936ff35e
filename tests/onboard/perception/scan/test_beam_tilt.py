"""The tilt of each beam: linear between samples, and nothing where there are none or the axis turns."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.perception.scan.beam_tilt import HOLE_NS, tilt_at
from onboard.records import TiltTrack

MS = 1_000_000


def track(times_ms, angles_deg):
    return TiltTrack(np.round(np.array(times_ms) * MS).astype(np.int64), np.radians(angles_deg))


def nod(rate_dps, until_ms=2000, turn_ms=1000, step_deg=0.0):
    """Up for a second, down for a second; sampled each 5 ms, cut to the encoder's steps."""
    times_ms = np.arange(0, until_ms + 1, 5)
    angles = rate_dps * 1e-3 * (turn_ms - np.abs(times_ms - turn_ms))
    return track(times_ms, np.round(angles / step_deg) * step_deg if step_deg else angles)


def at(samples, times_ms):
    angles_rad, sampled, steady = tilt_at(samples, np.array(times_ms, float) * MS, 0)
    return np.degrees(angles_rad), sampled, steady


@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.lists(st.tuples(st.integers(1, 29), st.floats(-1, 1)), min_size=1, max_size=40), st.integers(0, 2**62))
def test_sampled_beams_have_numpys_interpolation_and_the_others_none(steps, origin_ns):
    gaps, moves = zip(*steps)
    samples = track(np.cumsum((0, *gaps)), np.cumsum((0, *moves)))
    samples = TiltTrack(samples.times_ns + origin_ns, samples.angles_rad)
    times_ns = np.linspace(-5 * MS, (sum(gaps) + 5) * MS, 300)
    angles_rad, sampled, steady = tilt_at(samples, times_ns, origin_ns)
    own_ns = (samples.times_ns - origin_ns).astype(float)
    assert (sampled == ((times_ns >= 0) & (times_ns <= own_ns[-1]))).all()
    want_rad = np.interp(times_ns[sampled], own_ns, samples.angles_rad)
    np.testing.assert_allclose(angles_rad[sampled], want_rad, atol=1e-12)
    assert not (steady & ~sampled).any()


@pytest.mark.parametrize("rate_dps", [10, 30])
@pytest.mark.parametrize("step_deg", [0.0, 360 / 4096])
def test_beams_about_the_turn_are_turned_down_and_all_others_kept(rate_dps, step_deg):
    times_ms = np.arange(0, 2000, 0.7)
    _, sampled, steady = at(nod(rate_dps, step_deg=step_deg), times_ms)
    assert sampled.all()
    about = np.abs(times_ms - 1000)
    assert not steady[about < 15].any() and steady[about > 60].all()


def test_start_from_rest_is_turned_down_and_a_parked_axis_is_steady():
    times_ms = np.arange(0, 1001, 5)
    samples = track(times_ms, np.maximum(0, times_ms - 500) * 0.020)  # 20 degrees/s
    _, _, steady = at(samples, [100, 400, 495, 505, 600, 900])
    assert steady.tolist() == [True, True, False, False, True, True]


def test_segments_of_a_sweep_join_without_a_gap():
    times_ms = np.arange(0, 1001, 5)
    samples = track(times_ms, np.where(times_ms < 500, 0.010 * times_ms, 5 + 0.030 * (times_ms - 500)))
    assert at(samples, np.arange(0, 1000, 1.7))[2].all()


@pytest.mark.parametrize("rate_dps", [1.6, 4.0, 20.0])
def test_encoder_steps_of_a_slow_axis_are_no_turn(rate_dps):
    times_ms = np.arange(0, 2001, 5)
    angles = np.round(rate_dps * 1e-3 * times_ms / (360 / 4096)) * 360 / 4096
    assert at(track(times_ms, angles), np.arange(100, 1900, 1.3))[2].all()


def test_hole_of_lost_samples_holds_no_beam_if_the_axis_moved_and_all_if_it_is_parked():
    assert HOLE_NS < 100 * MS
    moved = track([0, 5, 10, 110, 115, 120], [0, 0.05, 0.10, 1.10, 1.15, 1.20])
    assert at(moved, [7, 50, 109, 117])[1].tolist() == [True, False, False, True]
    assert at(track([0, 100, 200], [40, 40, 40]), [50, 150])[2].all()


@pytest.mark.parametrize("samples", [track([], []), track([5], [1.0])])
def test_track_without_two_samples_gives_no_tilt(samples):
    assert not at(samples, [[1, 5, 9]])[1].any()
