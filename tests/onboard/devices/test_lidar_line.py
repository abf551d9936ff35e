"""The line under the frames of a clock, against the hull walked point by point; the memory of the frames."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.devices.lidar.hull_fit import Frames, edge_under


def hull_edge(x, y, middle):
    """(slope, value at 0) of the lower convex hull's edge over `middle`."""
    hull = []
    for px, py in zip(x, y, strict=True):
        while len(hull) > 1:
            (ax, ay), (bx, by) = hull[-2:]
            if (bx - ax) * (py - ay) > (by - ay) * (px - ax):
                break
            hull.pop()
        hull.append((px, py))
    at = next(k for k in range(1, len(hull)) if hull[k][0] >= middle)
    (ax, ay), (bx, by) = hull[at - 1 : at + 1]
    slope = (by - ay) / (bx - ax)
    return slope, ay - slope * ax


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.lists(st.tuples(st.integers(1, 5), st.integers(0, 10**7)), min_size=2, max_size=60), st.floats(-1e6, 1e6))
def test_edge_is_that_of_the_hull_whatever_slope_is_guessed(steps, guess):
    x, y = np.cumsum([step for step, _ in steps]).astype(float), np.array([float(late) for _, late in steps])
    slope, height = edge_under(x, y, float(x.mean()), guess, np.empty(len(x)))
    want_slope, want_height = hull_edge(x.tolist(), y.tolist(), float(x.mean()))
    assert slope == pytest.approx(want_slope, abs=1e-3, rel=1e-9)
    assert height == pytest.approx(want_height, abs=1.0, rel=1e-9)


def test_frames_are_the_newest_of_their_size_in_order():
    frames = Frames(5)
    for k in range(23):
        frames.append(k, 25 * k, 10**9 * k)
        turns, stamps_ms, arrivals_ns = frames.columns()
        want = np.arange(max(0, k - 4), k + 1)
        assert len(frames) == len(want) and np.array_equal(turns, want)
        assert np.array_equal(stamps_ms, 25 * want) and np.array_equal(arrivals_ns, 10**9 * want)
    frames.clear()
    assert len(frames) == 0
