"""The filter's two equations against filterpy, and what must hold of any covariance."""

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter
from hypothesis import given
from hypothesis import strategies as st

from onboard.perception.kalman import corrected, predicted


def covariance(rng, size, scale=1.0):
    root = rng.normal(size=(size, size)) * scale
    return root @ root.T + 1e-6 * np.eye(size)


@given(st.integers(0, 2**32 - 1), st.integers(1, 4))
def test_both_equations_are_filterpys(seed, measures):
    rng = np.random.default_rng(seed)
    P, F, Q = covariance(rng, 6), rng.normal(size=(6, 6)), covariance(rng, 6, 0.1)
    H, R = rng.normal(size=(measures, 6)), covariance(rng, measures)
    x, z = rng.normal(size=6), rng.normal(size=measures)
    theirs = ExtendedKalmanFilter(dim_x=6, dim_z=measures)
    theirs.x, theirs.P, theirs.F, theirs.Q = x, P, F, Q
    theirs.predict_x = lambda u: None
    theirs.predict()
    ours = predicted(P, F, Q)
    np.testing.assert_allclose(ours, theirs.P, rtol=1e-9, atol=1e-12)
    theirs.update(z, lambda at: H, lambda at: H @ at, R=R)
    gain, ours = corrected(ours, H, R)
    np.testing.assert_allclose(x + gain @ (z - H @ x), theirs.x, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(ours, theirs.P, rtol=1e-6, atol=1e-6)


@given(st.integers(0, 2**32 - 1))
def test_a_measurement_never_makes_the_state_less_certain(seed):
    rng = np.random.default_rng(seed)
    P, H, R = covariance(rng, 6), rng.normal(size=(4, 6)), covariance(rng, 4)
    _, after = corrected(P, H, R)
    assert np.linalg.eigvalsh(P - after).min() > -1e-9 and np.linalg.eigvalsh(after).min() > -1e-9


def test_an_exact_measurement_is_believed_and_a_worthless_one_is_not():
    P, H = np.diag([4.0, 9.0]), np.array([[1.0, 0.0]])
    gain, after = corrected(P, H, np.array([[0.0]]))
    assert gain.ravel().tolist() == [1.0, 0.0] and after[0, 0] == 0.0 and after[1, 1] == 9.0
    gain, after = corrected(P, H, np.array([[1e12]]))
    assert np.abs(gain).max() < 1e-10 and after == pytest.approx(P)
