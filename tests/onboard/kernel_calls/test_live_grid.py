"""The live grid, by points and by turns of the scanner: the plain twin, the cloud's way, every build, and its door."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.config import Rover, Scanning
from onboard.kernel_calls import cells as door
from onboard.kernel_calls import raster
from onboard.native import variant
from onboard.perception.map.live import LiveGrid, mount_of, turn_of
from onboard.perception.scan.cloud import cloud
from onboard.records import BeamStatus, Cloud, Grid, Pose, Scan, TiltTrack
from tests.oracles import cells as oracles

GRID = Grid(x0_m=-0.55, y0_m=-0.75, cell_m=0.1, rows=16, columns=12)
FIELD = Grid(x0_m=-9.95, y0_m=-9.95, cell_m=0.1, rows=200, columns=200)
NAMES = ("n", "sum_z", "sum_z2", "z_hi", "z_lo")
LAW = settings(max_examples=20, deadline=None, derandomize=True)
ROVER, SCANNING = Rover(), Scanning()
BEAM_NS = 25e6 / 1440


def points(seed: int, count: int) -> np.ndarray:
    """Some on the grid, some beside it, some not finite."""
    rng = np.random.default_rng(seed)
    made = rng.uniform([-1, -1, -0.3], [1, 1, 0.4], (count, 3)).astype(np.float32)
    made[rng.random(made.shape) < 0.02] = rng.choice([np.nan, np.inf, -np.inf, 3e38])
    return made


def scan(seed: int = 0, start_ns: int = 0) -> Scan:
    """Returns of all kinds from 0.1 m (the rover itself) to 12 m, in threes: each has a witness."""
    rng = np.random.default_rng(seed)
    status = np.repeat(rng.choice(4, 361, p=(0.85, 0.07, 0.04, 0.04)), 3)[:1081].astype(np.uint8)
    ranges_m = np.repeat(0.1 * 120 ** rng.random(361), 3)[:1081]
    ranges_m = np.where(status == BeamStatus.OK, ranges_m, np.nan).astype(np.float32)
    return Scan(start_ns, BEAM_NS, -0.75 * math.pi, math.pi / 720, ranges_m, status)


def down(first_deg: float = 60, last_deg: float = 20, until_ns: int = 200_000_000) -> TiltTrack:
    times_ns = np.arange(0, until_ns + 1, 5_000_000, np.int64)
    return TiltTrack(times_ns, np.radians(np.interp(times_ns, [0, until_ns], [first_deg, last_deg])))


def filled(grid: Grid, *parts: np.ndarray) -> LiveGrid:
    live = LiveGrid(grid)
    for part in parts:
        live.add_points(part)
    return live


@LAW
@given(st.integers(0, 10_000), st.integers(0, 60))
def test_points_give_the_statistics_of_the_plain_twin(seed: int, count: int) -> None:
    made = points(seed, count)
    got = filled(GRID, made).cells
    good = made[np.isfinite(made).all(axis=1)]
    want = oracles.rasterise(GRID, Cloud(np.array([0.0, 0.0, 0.7]), good, np.ones(len(good), bool)))
    for name in NAMES:
        np.testing.assert_allclose(got[name], want[name], rtol=1e-6, atol=1e-6, err_msg=name)


def test_no_cell_lies_across_two_cache_lines() -> None:
    grids = [LiveGrid(replace(GRID, columns=columns)) for columns in range(1, 60)]  # numpy's arrays begin anywhere
    assert {live.cells.ctypes.data % door.CELL.itemsize for live in grids} == {0}


@LAW
@given(st.integers(0, 10_000), st.lists(st.integers(0, 500), max_size=4))
def test_what_comes_in_parts_has_the_bits_of_what_comes_at_once(seed: int, cuts: list[int]) -> None:
    made = points(seed, 500)
    parts = filled(GRID, *map(np.ascontiguousarray, np.split(made, sorted(cuts))))
    assert parts.cells.tobytes() == filled(GRID, made).cells.tobytes()


def test_points_and_rasterised_hits_have_the_same_five_layers_bit_for_bit() -> None:
    made = points(3, 5000)
    beams = raster.rasterise(GRID, Cloud(np.array([0.0, 0.0, 0.7]), made, np.ones(len(made), bool)))
    got = filled(GRID, made).cells
    for name in NAMES:
        np.testing.assert_array_equal(got[name], getattr(beams, name), err_msg=name)


def test_points_on_the_borders_belong_to_the_cell_above_and_those_on_the_outer_ones_to_none() -> None:
    grid = Grid(0.5, 0.5, 1.0, 2, 3)  # 0 to 3, 0 to 2
    on = np.array([(0, 0, 1), (1, 0, 2), (2, 1, 3), (3, 0, 4), (0, 2, 5), (-1e-6, 0, 6), (0, -1e-6, 7)], np.float32)
    np.testing.assert_array_equal(filled(grid, on).cells["sum_z"], [[1, 2, 0], [0, 0, 3]])


@pytest.mark.parametrize("seed", range(4))
def test_a_turn_gives_what_the_cloud_and_the_rasteriser_give(seed: int) -> None:
    taken, T = scan(seed), Pose(0.3, -0.2, 0.4, 0.1, -0.15, 2.0 + seed).matrix()
    beams = cloud([taken], down(), T, ROVER, SCANNING, 0.02)
    want = raster.rasterise(FIELD, beams)
    live = LiveGrid(FIELD)
    live.add_turn(turn_of(taken, down(), SCANNING), mount_of(T, ROVER))
    assert 200 < beams.hit.sum() < 521  # some are the rover itself, too far, or none
    np.testing.assert_array_equal(live.cells["n"], want.n)
    for name in NAMES[1:]:
        np.testing.assert_allclose(live.cells[name], getattr(want, name), rtol=1e-6, atol=1e-6, err_msg=name)


def test_turns_one_by_one_give_what_one_cloud_of_them_all_gives() -> None:
    scans, T = [scan(k, k * 25_000_000) for k in range(8)], Pose(0.3, -0.2, 0.4, yaw_rad=1.0).matrix()
    want = raster.rasterise(FIELD, cloud(scans, down(), T, ROVER, SCANNING, 0.02))
    live, mount = LiveGrid(FIELD), mount_of(T, ROVER)
    for one in scans:
        live.add_turn(turn_of(one, down(), SCANNING), mount)
    np.testing.assert_array_equal(live.cells["n"], want.n)
    np.testing.assert_allclose(live.cells["sum_z2"], want.sum_z2, rtol=1e-6, atol=1e-6)


def test_beams_outside_the_tilt_track_or_the_sector_are_not_in_a_turn() -> None:
    first_ns, last_ns = round(500.5 * BEAM_NS), round(600.5 * BEAM_NS)
    track = TiltTrack(np.array([first_ns, last_ns]), np.array([0.100, 0.101]))
    assert len(turn_of(scan(), track, SCANNING).ranges_m) == 100
    assert len(turn_of(scan(), down(), SCANNING).ranges_m) == 521
    live = LiveGrid(GRID)
    live.add_turn(turn_of(scan(), TiltTrack(np.empty(0, np.int64), np.empty(0)), SCANNING), mount_of(np.eye(4), ROVER))
    assert live.cells["n"].sum() == 0


def test_a_turn_without_returns_changes_no_bit() -> None:
    live = filled(FIELD, points(1, 50))
    before = live.cells.copy()
    silent = replace(scan(), ranges_m=np.full(1081, np.nan, np.float32))
    live.add_turn(turn_of(silent, down(), SCANNING), mount_of(np.eye(4), ROVER))
    assert live.cells.tobytes() == before.tobytes()


@pytest.mark.parametrize("name", variant.available())
def test_every_build_gives_the_bits_of_the_baseline(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def made() -> bytes:
        live = filled(FIELD, points(7, 2001) * np.float32(9))
        live.add_turn(turn_of(scan(7), down(), SCANNING), mount_of(Pose(0.1, 0.2, 0.3, 0.1, 0.2, 0.3).matrix(), ROVER))
        return live.cells.tobytes()

    monkeypatch.setattr(door, "kernels", variant.load("baseline"))
    want = made()
    monkeypatch.setattr(door, "kernels", variant.load(name))
    assert made() == want


@pytest.mark.parametrize(
    ("broken", "words"),
    [
        (np.zeros((4, 3)), r"points_m: expected float32 \(any, 3\), given float64 \(4, 3\)"),
        (np.zeros((4, 2), np.float32), r"points_m: expected float32 \(any, 3\), given float32 \(4, 2\)"),
        (np.zeros((4, 3), ">f4"), "points_m: expected float32"),
        (np.zeros((3, 4), np.float32).T, "points_m: expected contiguous rows"),
        (np.frombuffer(bytes(49), np.float32, 12, 1).reshape(4, 3), "points_m: expected memory aligned for float32"),
        ([[0.0, 0.0, 0.0]], "points_m: expected an array"),
    ],
)
def test_the_door_for_points_names_what_is_wrong(broken: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        LiveGrid(GRID).add_points(broken)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"ranges_m": np.zeros(5)}, r"ranges_m: expected float32 \(any\), given float64 \(5,\)"),
        ({"azimuths": np.zeros((2, 4))}, r"azimuths: expected float64 \(2, 5\), given float64 \(2, 4\)"),
        ({"tilts": np.zeros((5, 2)).T}, "tilts: expected contiguous rows"),
        ({"tilts": np.zeros(5)}, r"tilts: expected float64 \(2, 5\), given float64 \(5,\)"),
    ],
)
def test_the_door_for_turns_names_what_is_wrong(changed: dict, words: str) -> None:
    good = door.BeamBlock(np.zeros(5, np.float32), np.zeros((2, 5)), np.zeros((2, 5)), 8.0)
    with pytest.raises(ValueError, match=words):
        LiveGrid(GRID).add_turn(good._replace(**changed), mount_of(np.eye(4), ROVER))


def test_a_mount_or_a_grid_that_cannot_be_is_refused_when_it_is_made() -> None:
    with pytest.raises(ValueError, match=r"T_map_base: expected float64 \(4, 4\)"):
        mount_of(np.eye(3), ROVER)
    with pytest.raises(ValueError, match="at least one cell"):
        LiveGrid(replace(GRID, rows=0))
    with pytest.raises(ValueError, match="finite numbers"):
        LiveGrid(replace(GRID, x0_m=math.nan))
    with pytest.raises(ValueError, match="expected at most 2147483647 cells"):
        LiveGrid(replace(GRID, rows=2**16, columns=2**16))
