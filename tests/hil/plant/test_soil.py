"""The soil kernel against a plain numpy twin, and the law's properties."""

import math

import numpy as np
import pytest

from hil.plant.soil import CLASSES, SoilContacts
from hil.terrain.mesh import soil_height
from onboard.records import Grid

RADIUS_M, WIDTH_M, DT_S = 0.10, 0.10, 0.002
GRID = Grid(-0.975, -0.975, 0.05, 40, 40)


def rough_soil(seed):
    return np.random.default_rng(seed).normal(0, 0.004, (40, 40)).astype(np.float32)


def state(centre, velocity=(0, 0, 0), spin=(0, 0, 0), quaternion=(0, 0, 0, 1)):
    return (tuple(centre), tuple(quaternion), None, None, None, None, tuple(velocity), tuple(spin))


def twin(soil_z, soil, memory, row, dt_s):
    """soil.hpp in plain numpy: force, point, load, sinkage and the new memory (along, across, heading)."""
    centre, velocity, spin = (np.array(row[k], float) for k in (0, 6, 7))
    x, y, z, w = row[1]
    axis = np.array([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)])
    ahead = np.cross(axis, (0, 0, 1))
    ahead /= np.linalg.norm(ahead)
    up = np.cross(ahead, axis)
    ends = centre + np.outer((0.5, -0.5), RADIUS_M * ahead)
    fore, aft = soil_height(GRID, soil_z, ends[:, 0], ends[:, 1])
    reach = math.radians(50)
    middle = math.atan2(fore - aft, RADIUS_M)
    angles, step = np.linspace(middle - reach, middle + reach, 31), 2 * reach / 30
    inward = np.cos(angles)[:, None] * up - np.sin(angles)[:, None] * ahead
    across = WIDTH_M * ((np.arange(3) + 0.5) / 3 - 0.5)
    rim = centre + across[None, :, None] * axis - RADIUS_M * inward[:, None, :]
    depth = soil_height(GRID, soil_z, rim[..., 0].ravel(), rim[..., 1].ravel()).reshape(31, 3) - rim[..., 2]
    along_j, across_j, heading = memory
    loaded = 1 - (1 - soil.unloading_ratio) * np.clip(0.5 - heading * (angles - middle) / 0.2, 0, 1)
    heading = float(np.clip(heading + velocity @ ahead * dt_s / 0.01, -1, 1))
    touching = depth > 0
    piece = RADIUS_M * step * WIDTH_M / 3
    pressure = soil.stiffness_npm3 * np.where(touching, depth, 1) ** soil.exponent * loaded[:, None]
    pressure = pressure - soil.damping_paspm * (inward @ velocity)[:, None]
    pressure = np.where(touching, np.maximum(0, pressure), 0) * piece
    if pressure.sum() <= 0:
        return np.zeros(3), centre, 0.0, max(0.0, depth.max()), (0.0, 0.0, heading)
    push = (pressure[..., None] * inward[:, None]).sum((0, 1))
    point = (pressure[..., None] * rim).sum((0, 1)) / pressure.sum()
    load, used = np.linalg.norm(push), np.flatnonzero(touching.any(axis=1))
    normal = push / load
    forward = np.cross(axis, normal)
    forward /= np.linalg.norm(forward)
    left = np.cross(normal, forward)
    slip = velocity + np.cross(spin, -RADIUS_M * normal)
    length = RADIUS_M * (angles[used[-1]] - angles[used[0]] + step)
    fresh = max(abs(spin @ axis * RADIUS_M), abs(velocity @ ahead)) / length
    old = np.array([along_j, across_j])
    new = (old + dt_s * np.array([slip @ forward, slip @ left])) / (1 + dt_s * fresh)
    size, limit = np.linalg.norm(new), soil.cohesion_pa * touching.sum() * piece + load * soil.tan_phi
    spring = limit * -np.expm1(-size / soil.shear_length_m) / size if size > 1e-12 else limit / soil.shear_length_m
    shear = -spring * new - soil.shear_damping_spm * load * (new - old) / dt_s
    shear *= min(1, limit / max(np.linalg.norm(shear), 1e-300))
    new *= min(1, 6 * soil.shear_length_m / max(size, 1e-300))
    return push + shear[0] * forward + shear[1] * left, point, load, depth.max(), (*new, heading)


@pytest.mark.parametrize("name", CLASSES)
def test_kernel_equals_its_numpy_twin_over_50_steps_of_any_motion(name):
    rng, soil_z, memory = np.random.default_rng(5), rough_soil(5), (0.0, 0.0, 0.0)
    kernel = SoilContacts(GRID, soil_z, RADIUS_M, WIDTH_M, (name,))
    for _ in range(50):
        quaternion = np.array([*rng.normal(0, 0.1, 3), 1.0])
        quaternion /= np.linalg.norm(quaternion)
        place = (*rng.uniform(-0.5, 0.5, 2), rng.uniform(0.088, 0.104))
        row = state(place, rng.normal(0, 0.05, 3), rng.normal(0, 1, 3), quaternion)
        force, point, load, sinkage, memory = twin(soil_z, CLASSES[name], memory, row, DT_S)
        (found,) = kernel.step((row,), DT_S)
        np.testing.assert_allclose(found[0], force, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(found[1], point, atol=1e-9)
        assert found[2] == pytest.approx(load, rel=1e-7) and found[3] == pytest.approx(sinkage, rel=1e-7)
        np.testing.assert_allclose(kernel.shear(0), memory, atol=1e-9)


def flat(name="nominal"):
    return SoilContacts(GRID, np.zeros((40, 40), np.float32), RADIUS_M, WIDTH_M, (name,))


def test_wheel_above_the_soil_feels_nothing():
    ((force, _, load, sinkage),) = flat().step((state((0, 0, 0.1001)),), DT_S)
    assert force == (0, 0, 0) and load == 0 and sinkage == 0


def test_resting_wheel_is_pushed_straight_up_and_more_the_deeper():
    forces = [flat().step((state((0, 0, 0.1 - depth)),), DT_S)[0][0] for depth in (0.002, 0.004, 0.006)]
    assert all(abs(f[0]) < 1e-9 and abs(f[1]) < 1e-9 for f in forces)
    assert 0 < forces[0][2] < forces[1][2] < forces[2][2]


def test_driving_slip_pulls_ahead_and_side_slip_pulls_back():
    drive = flat().step((state((0, 0, 0.095), (0.1, 0, 0), (0, 1.5, 0)),), DT_S)[0][0]
    aside = flat().step((state((0, 0, 0.095), (0.1, 0.05, 0), (0, 1.0, 0)),), DT_S)[0][0]
    assert drive[0] > 0 and aside[1] < 0


def test_shear_never_exceeds_cohesion_and_friction():
    contacts = flat()
    for _ in range(500):
        ((force, _, load, _),) = contacts.step((state((0, 0, 0.095), (0, 0, 0), (0, 20, 0)),), DT_S)
    soil, area = CLASSES["nominal"], RADIUS_M * math.radians(100) * WIDTH_M
    assert 0.9 * load * soil.tan_phi < force[0] <= load * soil.tan_phi + soil.cohesion_pa * area


def test_parked_wheel_keeps_its_shear_and_rolling_renews_the_soil():
    contacts = flat()
    for _ in range(100):
        contacts.step((state((0, 0, 0.095), (-0.02, 0, 0)),), DT_S)
    held = contacts.shear(0)
    contacts.step((state((0, 0, 0.095)),), 60.0)
    assert contacts.shear(0) == held and held[0] < -0.002
    for _ in range(1000):
        contacts.step((state((0, 0, 0.095), (0.1, 0, 0), (0, 1.0, 0)),), DT_S)
    assert abs(contacts.shear(0)[0]) < 0.1 * abs(held[0])


def test_unknown_soil_is_an_error_that_names_the_rows():
    with pytest.raises(ValueError, match="firm, nominal, soft"):
        flat("mud")


def test_a_field_without_a_whole_square_is_refused():
    with pytest.raises(ValueError, match="at least 2 x 2 nodes, given 1 x 3"):
        SoilContacts(Grid(0.0, 0.0, 0.1, 1, 3), np.zeros((1, 3), np.float32), 0.1, 0.1, ("firm",))
