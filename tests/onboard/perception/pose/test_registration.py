"""Registration on synthetic ground whose truth is known: fBm-like waves seen by a nodding scanner, with range noise."""

import math

import numpy as np
import pytest

from onboard.config import Localisation
from onboard.perception.pose.registration import difference, merge_target, register

CONFIG = Localisation()
DEG = math.pi / 180


def ground(seed, rms_m, n=384, cell=0.1):
    """Self-similar heights (Hurst 0.8), waves up to 8 m, of the given root mean square."""
    rng = np.random.default_rng(seed)
    k = np.hypot(np.fft.fftfreq(n)[:, None], np.fft.rfftfreq(n)[None])
    k[0, 0] = 1.0
    spectrum = np.fft.rfft2(rng.standard_normal((n, n))) * k**-1.8
    spectrum[k < cell / 8] = 0.0
    spectrum[0, 0] = 0.0
    z = np.fft.irfft2(spectrum, (n, n))
    return z * (rms_m / z.std())


def height(z, x, y, cell=0.1):
    i, j = x / cell + len(z) / 2, y / cell + len(z) / 2
    a, b = np.floor(i).astype(int), np.floor(j).astype(int)
    u, v = i - a, j - b
    return z[b, a] * (1 - u) * (1 - v) + z[b, a + 1] * u * (1 - v) + z[b + 1, a] * (1 - u) * v + z[b + 1, a + 1] * u * v


def scan(z, pose, rng, lines=200, noise_m=0.02):
    """Points (n, 3) in the map: a sweep ahead and one behind, to 10 m, from 0.7 m above the ground at x, y, yaw."""
    x, y, yaw = pose
    depression, azimuth = np.meshgrid(np.geomspace(60 * DEG, 4 * DEG, lines), np.arange(-65, 65.1, 0.5) * DEG)
    depression, azimuth = (np.concatenate(p) for p in ((depression, depression), (azimuth, azimuth + np.pi)))
    reach = 0.7 / np.tan(depression)
    px, py = x + reach * np.cos(azimuth + yaw), y + reach * np.sin(azimuth + yaw)
    eye = np.array([x, y, 0.7])
    beams = np.stack([px, py, height(z, px, py)], -1).reshape(-1, 3) - eye
    length = np.linalg.norm(beams, axis=1, keepdims=True)
    return (eye + beams * (1 + noise_m * rng.standard_normal(length.shape) / length))[length[:, 0] < 10.0]


def transform(x, y, z, yaw):
    T = np.eye(4)
    T[:2, :2] = [[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]
    T[:3, 3] = x, y, z
    return T


def case(seed, rms_m=0.08, pose=(1.7, 0.3, 15 * DEG)):
    """(source in base, target in map, true T_map_base)."""
    rng, z = np.random.default_rng(seed), ground(seed, rms_m)
    target, seen = scan(z, (0.0, 0.0, 0.0), rng), scan(z, pose, rng)
    truth = transform(pose[0], pose[1], 0.0, pose[2])
    return (seen - truth[:3, 3]) @ truth[:3, :3], target, truth


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_0_20_m_and_3_degrees_are_found_to_within_10_mm_and_0_05_degrees(seed):
    source, target, truth = case(seed)
    result = register(source, target, truth @ transform(0.15, 0.13, 0.02, 3 * DEG), CONFIG)
    assert result.accepted and result.converged and result.reason == ""
    x, y, z, yaw = difference(result.T_map_base, truth)
    assert math.hypot(x, y) < 0.010 and abs(z) < 0.010
    assert abs(yaw) < 0.05 * DEG
    assert result.moved_m == pytest.approx(0.2, abs=0.02)
    assert result.moved_rad == pytest.approx(3 * DEG, abs=0.1 * DEG)
    assert result.degenerate == ()
    assert result.inlier_ratio > 0.6


def test_covariance_covers_the_errors_and_is_not_wider_than_5_cm():
    for seed in (21, 22, 23):
        source, target, truth = case(seed)
        result = register(source, target, truth @ transform(-0.1, 0.1, 0.0, -2 * DEG), CONFIG)
        sigma = np.sqrt(np.diag(result.covariance))
        assert (np.abs(difference(result.T_map_base, truth)) < 3 * sigma).all()
        assert (sigma[:3] < 0.05).all() and sigma[3] < 0.01


@pytest.mark.parametrize(("rms_m", "most_mm"), [(0.01, 15), (0.02, 4), (0.05, 2)])
@pytest.mark.parametrize("seed", [24, 25])
def test_gentle_waves_fix_the_place_with_no_pull_towards_the_place_of_the_scan_before(seed, rms_m, most_mm):
    source, target, truth = case(seed, rms_m)
    result = register(source, target, truth @ transform(-0.1, 0.1, 0.0, -2 * DEG), CONFIG)
    assert result.sure
    assert 1e3 * np.linalg.norm(difference(result.T_map_base, truth)[:2]) < most_mm  # GICP alone: 75, 20 and 4 mm off


def test_half_a_metre_off_is_found_as_well():
    source, target, truth = case(26)
    result = register(source, target, truth @ transform(-0.3, 0.35, 0.0, 4 * DEG), CONFIG)
    assert result.sure
    assert np.linalg.norm(difference(result.T_map_base, truth)[:3]) < 0.005


def test_roll_and_pitch_of_the_guess_are_corrected_too():
    source, target, truth = case(14)
    tilt = np.eye(4)
    tilt[1:3, 1:3] = [[math.cos(0.01), -math.sin(0.01)], [math.sin(0.01), math.cos(0.01)]]
    result = register(source, target, truth @ tilt, CONFIG)
    assert result.accepted
    assert np.abs(result.T_map_base - truth)[:3, :3].max() < 0.001


def test_featureless_plane_is_not_trusted_in_x_y_and_yaw_and_is_refused():
    source, target, truth = case(15, rms_m=1e-9)
    guess = truth @ transform(0.15, 0.13, 0.02, 3 * DEG)
    result = register(source, target, guess, CONFIG)
    assert not result.accepted and not result.told
    assert "featureless" in result.reason
    assert set(result.degenerate) == {"x", "y", "rotation about z"}
    assert (result.T_map_base == guess).all()
    assert (np.diag(result.covariance)[[0, 1, 3]] > 50).all()


def test_a_trench_fixes_all_but_its_own_direction_which_keeps_the_guess():
    rng = np.random.default_rng(3)
    z = ground(3, 0.08)[:, :1] * np.ones((1, 384))  # heights change along y only
    truth = transform(1.7, 0.3, 0.0, 0.0)
    target, seen = scan(z, (0.0, 0.0, 0.0), rng), scan(z, (1.7, 0.3, 0.0), rng)
    guess = truth @ transform(0.1, 0.1, 0.0, 0.02)
    result = register((seen - truth[:3, 3]) @ truth[:3, :3], target, guess, CONFIG)
    assert result.degenerate == ("x",)
    assert result.accepted
    x, y, _, yaw = difference(result.T_map_base, truth)
    assert abs(x - 0.1) < 0.02 and abs(y) < 0.01 and abs(yaw) < 0.1 * DEG
    assert result.covariance[0, 0] > 50 > 0.01 > result.covariance[1, 1]


def test_more_than_the_gates_is_refused_and_the_guess_kept():
    source, target, truth = case(16)
    guess = truth @ transform(0.25, 0.2, 0.0, 0.0)
    tight = Localisation(gate_m=0.2)
    result = register(source, target, guess, tight)
    assert not result.accepted and result.told and "0.2 m" in result.reason
    assert (result.T_map_base == guess).all()
    assert result.moved_m == pytest.approx(0.32, abs=0.02)


def test_the_same_clouds_give_the_same_bits():
    source, target, truth = case(17)
    guess = truth @ transform(0.1, 0.0, 0.0, 1 * DEG)
    one, two = register(source, target, guess, CONFIG), register(source.copy(), target.copy(), guess.copy(), CONFIG)
    assert one.T_map_base.tobytes() == two.T_map_base.tobytes()
    assert one.covariance.tobytes() == two.covariance.tobytes()


@pytest.mark.parametrize(("n", "m"), [(0, 0), (0, 5000), (5000, 0), (100, 5000)])
def test_too_few_points_are_refused_by_number(n, m):
    source, target, truth = case(18)
    result = register(source[:n], target[:m], truth, CONFIG)
    assert not result.accepted and not result.told and "too few" in result.reason
    assert (result.T_map_base == truth).all()


# Beside each other there is nothing to compare; above each other, what should fit does not.
@pytest.mark.parametrize(("shift", "told"), [((25.0, 0.0, 0.0), False), ((0.0, 0.0, 5.0), True)])
def test_clouds_that_do_not_meet_are_refused(shift, told):
    source, target, truth = case(19)
    result = register(source, target + np.array(shift), truth, CONFIG)
    assert not result.accepted and result.told is told
    assert (result.T_map_base == truth).all()


@pytest.mark.parametrize(("turn_deg", "accepted"), [(180, False), (130, False), (80, True), (0, True)])
def test_sectors_of_65_degrees_register_only_where_a_fifth_is_shared(turn_deg, accepted):
    rng, z = np.random.default_rng(31), ground(31, 0.08)
    pose = (0.5, 0.2, turn_deg * DEG)
    target, seen = (scan(z, p, rng) for p in ((0.0, 0.0, 0.0), pose))
    target, seen = target[: len(target) // 2], seen[: len(seen) // 2]  # the sweep ahead alone
    truth = transform(*pose[:2], 0.0, pose[2])
    guess = truth @ transform(0.1, -0.1, 0.0, 1 * DEG)
    result = register((seen - truth[:3, 3]) @ truth[:3, :3], target, guess, CONFIG)
    assert result.accepted is accepted
    if accepted:
        x, y, _, yaw = difference(result.T_map_base, truth)
        assert math.hypot(x, y) < 0.03 and abs(yaw) < 0.2 * DEG
    else:
        assert "lie where the target is" in result.reason


def test_merged_target_holds_one_point_a_voxel_within_its_radius_and_does_not_grow_by_repetition():
    rng = np.random.default_rng(5)
    points = np.concatenate([scan(ground(5, 0.08), (0.0, 0.0, 0.0), rng), [[30.0, 0.0, 0.0]]])
    once = merge_target(np.empty((0, 3)), points, (0.0, 0.0))
    again = merge_target(once, points, (0.0, 0.0))
    assert len(once) == len(again)
    assert np.hypot(*once[:, :2].T).max() < CONFIG.registration_range_m
    voxels = {tuple(v) for v in np.floor(once / 0.1).astype(int)}
    assert len(voxels) > 0.95 * len(once)
    assert len(merge_target(once, points, (100.0, 0.0))) == 0
