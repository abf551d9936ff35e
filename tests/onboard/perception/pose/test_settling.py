"""Planes laid on planes: against a plain least squares fit, on faces whose normals are exact or noisy."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from onboard.perception.pose.settling import Faces, apart, settle, transform

SMALL = transform(np.array([0.01, -0.02, 0.03]), np.array([0.04, 0.05, -0.03]))


def search(target):
    tree = cKDTree(target)

    def nearest(points):
        distances, found = tree.query(points)
        return found.tolist(), (distances**2).tolist()

    return nearest


def box(rng, n=600, sides=(0, 1, 2), noise_rad=0.0):
    """Points on faces of a cube of 4 m about the origin, across the axes in `sides`, with normals of either sign."""
    points, normals = rng.uniform(-2, 2, (n, 3)), np.zeros((n, 3))
    for k in range(n):
        side = sides[k % len(sides)]
        points[k, side] = -2.0
        normals[k, side] = rng.choice([-1, 1])
    normals += noise_rad * rng.standard_normal((n, 3))
    return Faces(points, normals / np.linalg.norm(normals, axis=1, keepdims=True))


def moved(faces, T):
    return Faces(faces.points @ T[:3, :3].T + T[:3, 3], faces.normals @ T[:3, :3].T)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_three_faces_of_a_box_fix_all_six_directions(seed):
    rng = np.random.default_rng(seed)
    target, source = box(rng, 3000), box(rng)
    found = settle(moved(source, np.linalg.inv(SMALL)), target, search(target.points), 0.5, np.eye(4), np.eye(4))
    assert found.converged and found.loose[0].shape[1] == found.loose[1].shape[1] == 0
    assert found.T_target_source == pytest.approx(SMALL, abs=1e-6)
    assert found.apart_m < 1e-6 and found.matched > 500


def test_the_answer_is_that_of_a_plain_least_squares_fit_to_the_true_faces():
    rng = np.random.default_rng(4)
    target = box(rng, 3000)
    source = moved(box(rng), np.linalg.inv(SMALL))
    noise = 0.002 * rng.uniform(-1, 1, source.points.shape)  # within what Cauchy's weight hardly lowers
    source = Faces(source.points + noise, source.normals)
    found = settle(source, target, search(target.points), 0.5, np.eye(4), np.eye(4))

    def off(x):
        there = Rotation.from_rotvec(x[:3]).apply(source.points) + x[3:]
        return -2.0 - there[np.arange(len(there)), np.arange(len(there)) % 3]

    plain = least_squares(off, np.zeros(6), loss="linear", x_scale=0.01)
    T = transform(plain.x[:3], plain.x[3:])
    assert found.T_target_source == pytest.approx(T, abs=3e-4)
    J = plain.jac
    sigma = np.sqrt(np.diag(np.linalg.inv(J.T @ J)) * (plain.fun**2).mean())
    assert np.sqrt(np.diag(np.linalg.inv(found.information))) == pytest.approx(sigma, rel=0.3)


@pytest.mark.parametrize("noise_rad", [0.0, 0.02, 0.05])
def test_noise_of_the_normals_fixes_nothing_along_a_plane_which_keeps_the_guess(noise_rad):
    rng = np.random.default_rng(5)
    target, source = (box(rng, n, sides=(2,), noise_rad=noise_rad) for n in (4000, 2000))
    guess = transform(np.array([0.0, 0.0, 0.02]), np.array([0.1, -0.2, 0.0]))
    slid = transform(np.array([0.01, 0.0, 0.05]), np.array([0.3, 0.1, 0.04]))  # what came before has slid away
    found = settle(source, target, search(target.points), 0.5, guess, slid)
    assert (found.loose[0].shape[1], found.loose[1].shape[1]) == (1, 2)
    turned, way = apart(guess, found.T_target_source)
    assert np.hypot(*way[:2]) < 1e-3 and abs(turned[2]) < 1e-3


def test_a_step_across_a_plane_fixes_the_way_across_the_step_only():
    rng = np.random.default_rng(6)
    target, source = (box(rng, n, sides=(2, 2, 2, 0), noise_rad=0.02) for n in (4000, 2000))
    found = settle(moved(source, np.linalg.inv(SMALL)), target, search(target.points), 0.5, np.eye(4), np.eye(4))
    assert found.loose[1].shape[1] == 1 and abs(found.loose[1][1, 0]) > 0.99
    assert found.T_target_source[0, 3] == pytest.approx(SMALL[0, 3], abs=2e-3)


def test_stones_that_one_scan_alone_has_seen_pull_little():
    rng = np.random.default_rng(7)
    target, source = box(rng, 3000), box(rng)
    points = source.points.copy()
    points[::12] += np.array([0.3, 0.3, 0.3])  # one in twelve stands out by 0.3 m
    found = settle(
        moved(Faces(points, source.normals), np.linalg.inv(SMALL)),
        target,
        search(target.points),
        0.5,
        np.eye(4),
        np.eye(4),
    )
    assert apart(SMALL, found.T_target_source)[1] == pytest.approx(np.zeros(3), abs=1e-3)


def test_fewer_than_six_pairs_give_none():
    rng = np.random.default_rng(8)
    target, source = box(rng), box(rng, 5)
    assert settle(source, target, search(target.points), 0.5, np.eye(4), np.eye(4)) is None


@pytest.mark.parametrize("seed", range(5))
def test_apart_is_the_inverse_of_transform(seed):
    rng = np.random.default_rng(seed)
    rotation, way = rng.normal(0, 0.3, 3), rng.normal(0, 1, 3)
    T = transform(rotation, way)
    assert T[:3, :3] == pytest.approx(Rotation.from_rotvec(rotation).as_matrix(), abs=1e-12)
    turned, gone = apart(np.eye(4), T)
    assert turned == pytest.approx(rotation, abs=1e-9) and gone == pytest.approx(way)
