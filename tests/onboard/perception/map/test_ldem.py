"""The map: merging scans by rule R3, growing by whole blocks, the window, the assumed disc."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.perception.map import ldem as maps
from onboard.records import Cloud, Grid, Ldem, Pose

LAW = settings(max_examples=20, deadline=None, derandomize=True)
LAYERS = ("n", "sum_z", "sum_z2", "z_hi", "z_lo", "sum_sigma", "z_ray", "view_m", "stop", "assumed_z")


def hits(x_m: float, y_m: float, heights_m: list[float], origin: tuple[float, float, float] = (0.0, 0.0, 0.7)) -> Cloud:
    ends = np.array([(x_m, y_m, z) for z in heights_m], np.float32)
    return Cloud(np.array(origin, float), ends, np.ones(len(ends), bool))


def same(one: Ldem, other: Ldem) -> None:
    assert one.grid == other.grid
    for name in LAYERS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


def test_an_empty_map_knows_nothing() -> None:
    ldem = maps.empty(Grid(0.05, 0.05, 0.1, 4, 5))
    assert ldem.n.shape == (4, 5) and ldem.n.dtype == np.int32 and ldem.stop.dtype == np.int16
    assert np.isnan(ldem.z_hi).all() and np.isinf(ldem.z_ray).all() and (ldem.stop == -1).all()


def test_a_cell_with_3_near_hits_takes_the_newest_scan_alone() -> None:
    ldem = maps.empty(maps.grid_around(0, 0, 4, 0.1))
    j, i = ldem.grid.cell(1.05, 0.05)
    ldem = maps.insert(ldem, hits(1.05, 0.05, [0.5] * 9), stop=0, near_m=5.0)
    ldem = maps.insert(ldem, hits(1.05, 0.05, [0.0, 0.1, 0.2], origin=(-0.5, 0.0, 0.7)), stop=1, near_m=5.0)
    assert ldem.n[j, i] == 3
    assert ldem.sum_z[j, i] == pytest.approx(0.3)
    assert ldem.z_hi[j, i] == pytest.approx(0.2)
    assert ldem.stop[j, i] == 1 and ldem.view_m[j, i] == pytest.approx(math.hypot(1.55, 0.05))


@pytest.mark.parametrize(("heights", "near_m"), [([0.0, 0.2], 5.0), ([0.0, 0.1, 0.2], 1.0)])
def test_two_hits_or_far_ones_are_added_to_what_was_seen(heights: list[float], near_m: float) -> None:
    ldem = maps.empty(maps.grid_around(0, 0, 4, 0.1))
    j, i = ldem.grid.cell(1.05, 0.05)
    ldem = maps.insert(ldem, hits(1.05, 0.05, [0.5, 0.5, 0.5, 0.6]), stop=0, near_m=near_m)
    ldem = maps.insert(ldem, hits(1.05, 0.05, heights, origin=(-0.5, 0.0, 0.7)), stop=1, near_m=near_m)
    assert ldem.n[j, i] == 4 + len(heights)
    assert (ldem.z_lo[j, i], ldem.z_hi[j, i]) == (np.float32(0.0), np.float32(0.6))
    assert ldem.stop[j, i] == 0  # the nearer view


def test_the_lowest_ray_of_all_scans_is_kept_until_a_near_scan_replaces_the_cell() -> None:
    ldem = maps.empty(maps.grid_around(0, 0, 4, 0.1))
    j, i = ldem.grid.cell(1.05, 0.05)
    ldem = maps.insert(ldem, hits(1.55, 0.05, [-0.3]), stop=0, near_m=5.0)
    low = ldem.z_ray[j, i]
    assert np.isfinite(low) and ldem.n[j, i] == 0
    assert maps.insert(ldem, hits(1.55, 0.05, [0.3]), 1, 5.0).z_ray[j, i] == low
    assert maps.insert(ldem, hits(1.05, 0.05, [0.0] * 3), 1, 5.0).z_ray[j, i] == np.inf


@LAW
@given(st.floats(-30, 30), st.floats(-30, 30), st.floats(-40, 40), st.floats(-40, 40))
def test_the_map_grows_by_whole_blocks_until_the_window_fits_and_keeps_every_cell(
    x0: float, y0: float, x: float, y: float
) -> None:
    ldem = maps.empty(maps.grid_around(x0, y0, 6, 0.1))
    ldem = maps.insert(ldem, hits(x0 + 1, y0, [0.1, 0.2], origin=(x0, y0, 0.7)), 0, 5.0)
    grown = maps.grow(ldem, x, y, 10.0)
    assert (grown.grid.rows - ldem.grid.rows) % 50 == 0 and (grown.grid.columns - ldem.grid.columns) % 50 == 0
    from_origin = grown.grid.x0_m / 0.1 - 0.5
    assert from_origin == pytest.approx(round(from_origin), abs=1e-6)
    seen = maps.window(grown, x, y, 20.0).grid
    assert grown.grid.contains(*grown.grid.cell(seen.x0_m, seen.y0_m))
    assert grown.grid.contains(*grown.grid.cell(*seen.centre(seen.rows - 1, seen.columns - 1)))
    same(maps.window(grown, x0, y0, 6.0), ldem)
    assert maps.grow(grown, x, y, 10.0) is grown


def test_the_window_is_200_by_200_with_the_rover_in_its_middle_cell() -> None:
    ldem = maps.grow(maps.empty(maps.grid_around(0, 0, 20, 0.1)), 3.21, -4.56, 10.0)
    view = maps.window(ldem, 3.21, -4.56, 20.0)
    assert view.n.shape == (200, 200)
    assert view.grid.cell(3.21, -4.56) == (100, 100)


def test_a_window_beyond_the_map_is_unseen_there() -> None:
    ldem = maps.insert(maps.empty(maps.grid_around(0, 0, 4, 0.1)), hits(1.05, 0.05, [0.0]), 0, 5.0)
    view = maps.window(ldem, 2.0, 0.0, 4.0)
    assert view.n.sum() == 1 and (view.n[view.grid.cell(1.05, 0.05)]) == 1
    assert np.isinf(view.z_ray[:, 30:]).all()
    assert maps.window(ldem, 100.0, 0.0, 4.0).n.sum() == 0


def test_the_assumed_disc_is_the_plane_of_the_wheels() -> None:
    pose = Pose(0.3, -0.2, z_m=1.0, roll_rad=0.1, pitch_rad=-0.2, yaw_rad=0.7)
    ldem = maps.assume_disc(maps.empty(maps.grid_around(0, 0, 6, 0.1)), pose, 0.9)
    rows, columns = np.nonzero(np.isfinite(ldem.assumed_z))
    assert abs(len(rows) - math.pi * 81) < 15
    points = np.stack(
        [ldem.grid.x0_m + columns * 0.1, ldem.grid.y0_m + rows * 0.1, ldem.assumed_z[rows, columns]], axis=1
    )
    in_base = (np.linalg.inv(pose.matrix()) @ np.c_[points, np.ones(len(points))].T)[2]
    np.testing.assert_allclose(in_base, 0.0, atol=1e-6)


def test_a_scan_entered_into_the_window_and_pasted_is_the_scan_entered_into_the_map() -> None:
    ground = maps.grow(maps.empty(maps.grid_around(0, 0, 4, 0.1)), 12.0, -3.0, 4.0)
    large = maps.insert(ground, hits(1.05, 0.05, [0.3]), 0, 5.0)
    seen = hits(11.03, -2.47, [0.1, 0.2, 0.15], origin=(12.03, -2.96, 0.7))
    part = maps.insert(maps.window(large, 12.0, -3.0, 6.0), seen, 1, 5.0)
    same(maps.paste(large, part), maps.insert(large, seen, 1, 5.0))


def test_a_part_beyond_the_map_is_refused() -> None:
    small = maps.empty(maps.grid_around(0, 0, 4, 0.1))
    with pytest.raises(ValueError, match="not within the map"):
        maps.paste(small, maps.window(small, 3.0, 0.0, 4.0))


def test_of_eight_hits_or_more_the_highest_and_the_lowest_bound_nothing() -> None:
    heights = [0.0, 0.01, 0.02, 0.03, 0.0, 0.01, 0.02, 0.5]
    for count, high in ((8, 0.03), (7, 0.5)):
        ends = np.array([(0.05, 0.05, z) for z in heights[-count:]], np.float32)
        seen = Cloud(np.array([-1.0, 0.0, 0.7]), ends, np.ones(count, bool), 0.02)
        cells = maps.insert(maps.empty(Grid(-0.95, -0.95, 0.1, 20, 20)), seen, 0, 5.0)
        j, i = cells.grid.cell(0.05, 0.05)
        assert cells.n[j, i] == count and cells.z_hi[j, i] == np.float32(high)
