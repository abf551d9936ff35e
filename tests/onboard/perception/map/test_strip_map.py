"""The guard's strip map: lines levelled on the map, and a verdict that fills and widens but never replaces."""

from dataclasses import replace

import numpy as np
import pytest

from onboard import config
from onboard.perception.map import ldem, strip_map
from onboard.perception.map.cell_classes import classify
from onboard.records import Cloud, Pose

CELL = 0.1
MAPPING = config.Mapping_()
GRID = ldem.grid_around(0.0, 0.0, 6.0, CELL)
Y = np.arange(-1.5, 1.5001, 0.01)


def cells(z=0.0, n=50, view_m=1.0):
    """A map of even ground at height z, every cell hit n times without noise."""
    shape = (GRID.rows, GRID.columns)
    flat = np.full(shape, z, np.float32)
    return replace(
        ldem.empty(GRID),
        n=np.full(shape, n, np.int32),
        sum_z=np.full(shape, n * z),
        sum_z2=np.full(shape, n * z * z),
        z_hi=flat,
        z_lo=flat,
        view_m=np.full(shape, view_m, np.float32),
    )


def line(z, x=1.0, hit=None):
    """A line across the way at x, from a scanner 0.7 m over (0.2, 0)."""
    ends = np.column_stack([np.full(len(Y), x), Y, np.broadcast_to(z, Y.shape)]).astype(np.float32)
    return Cloud(np.array([0.2, 0.0, 0.7]), ends, np.ones(len(Y), bool) if hit is None else hit, 0.0)


def test_height_and_roll_of_a_tilted_line_are_taken_out():
    tilted = line(0.03 + np.tan(np.radians(1.0)) * Y)
    levelled = strip_map.level(tilted, classify(cells(), MAPPING))
    assert np.abs(levelled.cloud.ends_m[:, 2]).max() < 1e-6
    assert np.abs(levelled.residual_m).max() < 1e-6


def test_what_stands_in_the_way_is_no_part_of_the_line_s_height_and_roll():
    rock = np.where(np.abs(Y - 0.3) < 0.2, 0.15, 0.0)
    levelled = strip_map.level(line(rock + 0.02), classify(cells(), MAPPING))
    assert np.allclose(levelled.residual_m, rock, atol=1e-6)


def test_line_over_unknown_ground_stays_as_it_is_and_says_nothing_of_change():
    levelled = strip_map.level(line(0.04), classify(ldem.empty(GRID), MAPPING))
    assert np.allclose(levelled.cloud.ends_m[:, 2], 0.04)
    assert np.isnan(levelled.residual_m).all()


def test_height_between_cells_is_bilinear_and_unknown_beside_an_unknown_cell():
    slope = np.broadcast_to(np.arange(GRID.columns, dtype=float), (GRID.rows, GRID.columns)).copy()
    surface = replace(classify(cells(), MAPPING), z_mean=slope.astype(np.float32))
    x, y = GRID.centre(7, 4)
    assert strip_map.height_at(surface, np.array([x + 0.03]), np.array([y]))[0] == pytest.approx(4.3)
    slope[7, 5] = np.nan
    surface = replace(surface, z_mean=slope.astype(np.float32))
    assert np.isnan(strip_map.height_at(surface, np.array([x + 0.03, 99.0]), np.array([y, y]))).all()


def merged(memory, strip):
    """The strip's verdict in the map, the line far ahead of everything."""
    return strip_map.merge(memory, strip, Pose(0.0, 0.0), 99.0, MAPPING)


def at_origin(made):
    """Values of the cell that holds (0.05, 0.05)."""
    j, i = made.grid.cell(0.05, 0.05)
    return {name: getattr(made, name)[j, i] for name in ("n", "sum_z", "z_hi", "z_lo", "z_ray", "view_m")}


def test_strip_fills_cells_with_fewer_than_3_hits():
    found = at_origin(merged(cells(z=0.5, n=2, view_m=4.0), cells(z=0.1, n=9)))
    assert (found["n"], found["sum_z"]) == (9, pytest.approx(0.9))
    assert found["z_hi"] == pytest.approx(0.1)
    assert found["view_m"] == 1.0


@pytest.mark.parametrize(("strip_z", "low", "high"), [(0.1, 0.0, 0.1), (-0.1, -0.1, 0.0)])
def test_strip_widens_the_bounds_of_known_cells_and_replaces_nothing(strip_z, low, high):
    found = at_origin(merged(cells(z=0.0, n=50, view_m=4.0), cells(z=strip_z, n=9)))
    assert (found["n"], found["sum_z"]) == (50, 0.0)
    assert (found["z_lo"], found["z_hi"]) == (pytest.approx(low), pytest.approx(high))
    assert found["view_m"] == 1.0


@pytest.mark.parametrize("hits", [0, 50])
def test_next_sweep_from_near_replaces_what_the_strip_put_in(hits):
    map_ = replace(cells(n=hits, view_m=4.0), stop=np.full((GRID.rows, GRID.columns), 3, np.int16))
    with_strip = merged(map_, cells(z=0.3, n=9))
    sweep = Cloud(np.array([0.0, 0.0, 0.7]), np.full((5, 3), (0.05, 0.05, 0.0), np.float32), np.ones(5, bool), 0.0)
    found = at_origin(ldem.insert(with_strip, sweep, 4, MAPPING.near_m))
    assert (found["n"], found["z_lo"], found["z_hi"]) == (5, 0.0, 0.0)


def test_view_is_credited_only_where_its_data_went_in():
    none = at_origin(merged(cells(view_m=4.0), ldem.empty(GRID)))
    assert none["view_m"] == 4.0
    ahead = strip_map.merge(cells(view_m=4.0), cells(z=0.1), Pose(0.0, 0.0), 1.1, MAPPING)
    views = ahead.view_m[ahead.grid.cell(0.05, 0.05)[0]]
    x = ahead.grid.x0_m + np.arange(ahead.grid.columns) * CELL
    inside = np.abs(x) < 2.9
    assert (views[inside & (x < 0.89)] == 1.0).all()
    assert (views[inside & (x > 0.91)] == 4.0).all()  # the line has not passed them by 0.2 m
