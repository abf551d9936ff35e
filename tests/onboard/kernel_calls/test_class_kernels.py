"""The kernels of cell classes and poses: every build gives what numpy gives, and the doors say what is wrong."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard import config
from onboard.kernel_calls import cell_classes as cell_door
from onboard.kernel_calls import poses as pose_door
from onboard.native import variant
from onboard.perception.map import ldem as maps
from onboard.perception.map.cell_classes import SPREAD, classify
from onboard.planning.local import poses
from onboard.records import CellClass, Grid, Ldem, Surface
from tests.oracles import classes as oracles

MAPPING, ROVER, PLANNING = config.Mapping_(), config.Rover(), config.Planning()
LAW = settings(max_examples=40, deadline=None, derandomize=True)
SIZES = st.one_of(st.sampled_from([1, 2, 3, 8, 13, 17]), st.integers(1, 40))


def each_build():
    """The doors with one build after the other, by its name."""
    before = cell_door.kernels
    try:
        for name in variant.available():
            cell_door.kernels = pose_door.kernels = variant.load(name)
            yield name
    finally:
        cell_door.kernels = pose_door.kernels = before


def scanned(seed: int, rows: int, columns: int) -> Ldem:
    """Rough ground on a slope, hit here and there; beams, steps and holes of all sizes; some of it assumed."""
    rng, shape = np.random.default_rng(seed), (rows, columns)
    n = np.where(rng.random(shape) < rng.uniform(0.2, 1.0), rng.integers(1, 400, shape), 0).astype(np.int32)
    j, i = np.indices(shape)
    rough = rng.uniform(0.1, 1.0)
    mean = 30.0 + rough * rng.normal(0, 0.02, shape) + i * rng.uniform(-0.03, 0.03) + j * rng.uniform(-0.03, 0.03)
    mean += np.where(rng.random(shape) < 0.01, rng.uniform(-0.3, 0.3, shape), 0.0)
    crossed = rng.random(shape) < 0.8
    return dataclasses.replace(
        maps.empty(Grid(0.05, 0.05, 0.1, rows, columns)),
        n=n,
        sum_z=n * mean,
        z_hi=np.where(n > 0, mean + rough * rng.exponential(0.03, shape), np.nan).astype(np.float32),
        z_lo=np.where(n > 0, mean - rough * rng.exponential(0.03, shape), np.nan).astype(np.float32),
        sum_sigma=(n * 0.01).astype(np.float32),
        z_ray=np.where(crossed, mean + rng.normal(0.03, 0.06, shape), np.inf).astype(np.float32),
        assumed_z=np.where(rng.random(shape) < 0.1, 30.0, np.nan).astype(np.float32),
    )


@LAW
@given(st.integers(0, 10_000), SIZES, SIZES, st.integers(0, 5))
def test_classes_of_every_build_are_those_of_numpy(seed: int, rows: int, columns: int, fill_cells: int) -> None:
    ldem, mapping = scanned(seed, rows, columns), dataclasses.replace(MAPPING, fill_cells=fill_cells)
    want, found = oracles.classify(ldem, mapping), {}
    for name in each_build():
        got = classify(ldem, mapping)
        np.testing.assert_array_equal(got.cell_class, want.cell_class)
        np.testing.assert_array_equal(got.z_mean, want.z_mean)
        # numpy's logarithm may differ from the library's in its last bit
        np.testing.assert_allclose(got.z_top, want.z_top, rtol=2e-7)
        np.testing.assert_allclose(got.z_bot, want.z_bot, rtol=2e-7)
        found[name] = got.z_top.tobytes() + got.z_bot.tobytes()
    assert len(set(found.values())) == 1


@LAW
@given(st.integers(0, 10_000), SIZES, SIZES)
def test_freedom_of_every_build_is_that_of_numpy(seed: int, rows: int, columns: int) -> None:
    surface = classify(scanned(seed, rows, columns), MAPPING)
    want = oracles.pose_freedom(surface, ROVER, PLANNING)
    for _ in each_build():
        np.testing.assert_array_equal(poses.pose_freedom(surface, ROVER, PLANNING, tyres=False), want)


def test_the_random_ground_has_poses_of_all_kinds_and_cells_of_all_classes() -> None:
    kinds, freedoms = set(), set()
    for seed in range(20):
        surface = classify(scanned(seed, 40, 40), MAPPING)
        kinds |= set(np.unique(surface.cell_class))
        freedoms |= set(np.unique(poses.pose_freedom(surface, ROVER, PLANNING)))
    assert kinds == set(CellClass) and freedoms == set(poses.Freedom)


@pytest.mark.parametrize("cell_m", [0.04, 0.07, 0.15])
def test_freedom_equals_numpy_for_other_cells(cell_m: float) -> None:
    for seed in range(5):
        made = classify(scanned(seed, 30, 34), MAPPING)
        surface = dataclasses.replace(made, grid=dataclasses.replace(made.grid, cell_m=cell_m))
        want = oracles.pose_freedom(surface, ROVER, PLANNING)
        np.testing.assert_array_equal(poses.pose_freedom(surface, ROVER, PLANNING, tyres=False), want)


@LAW
@given(st.integers(0, 10_000), SIZES, SIZES, st.sampled_from([0.02, 0.1, 0.3, 1.0]))
def test_closeness_of_every_build_is_that_of_numpy(seed: int, rows: int, columns: int, cell_m: float) -> None:
    rng = np.random.default_rng(seed)
    blocked = rng.choice([0.0, 0.002, 0.1, 1.0])
    freedom = np.where(rng.random((8, rows, columns)) < blocked, 0, rng.integers(1, 3, (8, rows, columns)))
    want = oracles.closeness(freedom.astype(np.uint8), PLANNING, cell_m)
    for _ in each_build():
        np.testing.assert_array_equal(poses.closeness(freedom.astype(np.uint8), PLANNING, cell_m), want)


@LAW
@given(st.integers(0, 10_000), SIZES, SIZES)
def test_what_every_build_reaches_is_what_scipy_reaches(seed: int, rows: int, columns: int) -> None:
    rng = np.random.default_rng(seed)
    freedom = np.where(rng.random((8, rows, columns)) < rng.choice([0.1, 0.25, 0.4]), 2, 1).astype(np.uint8)
    pose = int(rng.integers(rows)), int(rng.integers(columns)), int(rng.integers(8))
    want = oracles.reachable(freedom, *pose)
    for _ in each_build():
        np.testing.assert_array_equal(poses.reachable(freedom, *pose), want)


def body_cells(o: int, cell_m: float) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """Those under the body, those it may touch."""
    wheels, body = poses.footprint(ROVER, cell_m)
    assert wheels[o].tolist() == [list(at) for at in poses.wheel_cells(o, ROVER, cell_m)]
    rows = [row[1:] for row in body.tolist() if row[0] == o]
    under = [(dj, di) for dj, first, last, _, _ in rows for di in range(first, last + 1)]
    return under, [(dj, di) for dj, _, _, first, last in rows for di in range(first, last + 1)]


@pytest.mark.parametrize("cell_m", [0.02, 0.1, 0.13])
def test_the_footprint_has_the_cells_under_the_body_and_those_within_half_a_cell_of_it(cell_m: float) -> None:
    for o in range(8):
        under, touched = body_cells(o, cell_m)
        assert under == list(oracles.body_cells(o, ROVER, cell_m))
        assert touched == list(oracles.body_cells(o, ROVER, cell_m, cell_m / 2))
        assert set(under) <= set(touched)


def flat(rows: int = 9, columns: int = 9) -> Surface:
    z = np.zeros((rows, columns), np.float32)
    kinds = np.full(z.shape, CellClass.HIT, np.uint8)
    return Surface(Grid(0.05, 0.05, 0.1, rows, columns), kinds, z, z, z, np.full(z.shape, np.inf, np.float32))


def test_the_door_of_the_classes_names_what_is_wrong() -> None:
    good, rules = scanned(1, 4, 5), cell_door.Rules(2, 0.02, 0.08, 0.06, 0.08, 0.036)
    cell_door.classify(good, rules, SPREAD)
    for changed, words in (
        ({"n": good.n.astype(np.int64)}, r"n: expected int32 \(4, 5\), given int64"),
        ({"z_ray": good.z_ray[:3]}, r"z_ray: expected float32 \(4, 5\), given float32 \(3, 5\)"),
        ({"sum_z": np.asfortranarray(good.sum_z)}, "sum_z: expected contiguous rows"),
        ({"n": [[1]]}, "n: expected an array"),
    ):
        with pytest.raises(ValueError, match=words):
            cell_door.classify(dataclasses.replace(good, **changed), rules, SPREAD)
    for wrong in (rules._replace(fill_cells=-1), rules._replace(hole_depth_m=math.nan)):
        with pytest.raises(ValueError, match="rules: expected finite numbers >= 0"):
            cell_door.classify(good, wrong, SPREAD)
    for none in (np.empty(0), np.array([math.nan])):
        with pytest.raises(ValueError, match="spread: expected finite numbers"):
            cell_door.classify(good, rules, none)


LIMITS = pose_door.Limits(0.07, 0.46, 0.36, 0.10, 4, 20)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"z_top": np.zeros((9, 8), np.float32)}, r"z_top: expected float32 \(9, 9\)"),
        ({"cell_class": np.zeros((9, 9), np.int32)}, r"cell_class: expected uint8"),
        ({"grid": Grid(0, 0, 0.0, 9, 9)}, "limits: expected finite numbers >= 0 and a cell > 0"),
    ],
)
def test_the_door_of_the_freedom_names_the_layer_that_is_wrong(changed: dict, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        pose_door.pose_freedom(dataclasses.replace(flat(), **changed), poses.footprint(ROVER, 0.1), LIMITS)


def test_the_door_of_the_freedom_names_what_is_wrong_with_footprint_and_limits() -> None:
    good = poses.footprint(ROVER, 0.1)
    pose_door.pose_freedom(flat(), good, LIMITS)
    far, one_line = good.wheels.copy(), good.wheels.copy()
    far[0, 0, 0], one_line[3] = 129, 1
    for footprint, limits, words in (
        (good._replace(wheels=far), LIMITS, "footprint: expected offsets of at most 128 cells"),
        (good._replace(wheels=one_line), LIMITS, "wheels: expected wheels that span an area"),
        (good._replace(body=np.ascontiguousarray(good.body[::-1])), LIMITS, "0 to 7 in rising order"),
        (good, LIMITS._replace(plane_half=129), "plane_half: expected at most 128 cells, given 129"),
        (good, LIMITS._replace(step_m=math.inf), "limits: expected finite numbers"),
    ):
        with pytest.raises(ValueError, match=words):
            pose_door.pose_freedom(flat(), footprint, limits)
    with pytest.raises(ValueError, match="cells are too large"):
        poses.pose_freedom(dataclasses.replace(flat(), grid=Grid(0, 0, 1.0, 9, 9)), ROVER, PLANNING)


def test_the_doors_of_closeness_and_of_what_is_reached_name_what_is_wrong() -> None:
    freedom, falloff = np.full((8, 3, 4), 2, np.uint8), np.zeros(9, np.float32)
    pose_door.closeness(freedom, falloff, 1.0)
    for wrong in (np.zeros(8, np.float32), np.zeros(4, np.float32), np.zeros(129 * 129, np.float32)):
        with pytest.raises(ValueError, match="falloff: expected the square of 3 to 128 values"):
            pose_door.closeness(freedom, wrong, 1.0)
    with pytest.raises(ValueError, match=r"freedom: expected uint8 \(8, any, any\)"):
        pose_door.closeness(freedom[:7], falloff, 1.0)
    for pose in ((3, 0, 0), (0, 4, 0), (0, 0, 8), (-1, 0, 0)):
        with pytest.raises(ValueError, match="pose: expected j, i, o within 3, 4, 8"):
            pose_door.reachable(freedom, 2, pose)
