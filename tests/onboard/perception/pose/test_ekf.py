"""filterpy's filter from its one file: the same code and the same bits as from the package, without scipy.stats."""

import subprocess
import sys

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter as Whole

from onboard.perception.pose import ekf


def run(script):
    return subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True).stdout.split()


def test_the_filter_is_loaded_without_the_rest_of_filterpy_and_without_scipy_stats():
    loaded = run("import sys, onboard.perception.pose.ekf; print(*sys.modules)")
    assert "onboard.perception.pose.ekf" in loaded and "scipy.linalg" in loaded
    assert not [name for name in loaded if name.startswith(("filterpy", "scipy.stats", "matplotlib"))]


def test_the_whole_package_can_be_loaded_afterwards():
    assert run(
        "import onboard.perception.pose.ekf, filterpy.stats, filterpy.kalman; print(filterpy.stats.gaussian(0, 0, 1) "
        "> 0.3, filterpy.kalman.KalmanFilter(2, 1).x.shape)"
    ) == ["True", "(2,", "1)"]


def test_its_likelihood_still_finds_the_density_of_the_whole_package():
    assert run(
        "import numpy as np; from onboard.perception.pose.ekf import ExtendedKalmanFilter as F; f = F(1, 1); "
        "f.update(np.array([[1.0]]), lambda x: np.eye(1), lambda x: x); print(f.log_likelihood < 0)"
    ) == ["True"]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_it_predicts_and_corrects_to_the_same_bits_as_the_package(seed):
    draw = np.random.default_rng(seed)
    ours, whole = ekf.ExtendedKalmanFilter(dim_x=4, dim_z=2), Whole(dim_x=4, dim_z=2)
    for _ in range(20):
        motion, spread = draw.normal(size=(4, 4)), draw.normal(size=(4, 4))
        measures, measured = draw.normal(size=(2, 4)), draw.normal(size=(2, 1))
        for one in (ours, whole):
            one.F, one.Q = motion, spread @ spread.T
            one.predict()
            both = {"args": measures, "hx_args": measures}
            one.update(measured, lambda x, h: h, lambda x, h: np.tanh(h @ x), R=np.eye(2), **both)
    assert ours.x.tobytes() == whole.x.tobytes() and ours.P.tobytes() == whole.P.tobytes()
    assert np.abs(ours.x).max() > 0.0


def test_without_filterpy_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setattr(ekf, "find_spec", lambda name: None)
    with pytest.raises(ImportError, match=r"filterpy is not installed.*requirements\.lock"), ekf.folders_alone():
        pass
    assert sys.modules["filterpy.kalman"].ExtendedKalmanFilter is Whole  # what was loaded before is there again
