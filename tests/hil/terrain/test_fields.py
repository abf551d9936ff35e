"""Accepted fields keep the ranges and rules that are printed at the head of hil/terrain/fields.py."""

import math
import zlib

import numpy as np
import pytest

from hil.terrain import real_ground
from hil.terrain.field import height_at, truth_height
from hil.terrain.fields import (
    STEP_M,
    crater_field,
    demo_field,
    free_with_room,
    goal_poses,
    make_field,
    pose_of,
    refusal,
    straight_line,
    true_surface,
)
from hil.terrain.mesh import block_mean
from hil.terrain.real_ground import real_field, scaled_heights
from onboard.config import Planning, Rover
from onboard.planning.local import poses


def real_window(seed):
    return real_ground.make_field(scaled_heights(), seed)


@pytest.fixture(scope="module", params=["demo 1", "demo 2", "demo 3", "real 1", "craters 1"])
def accepted(request):
    kind, index = request.param.split()
    return {"demo": demo_field, "real": real_field, "craters": crater_field}[kind](int(index))


def test_printed_ranges_hold(accepted):
    stats = accepted.field.stats
    assert 4.5 <= stats["median_slope_deg"] <= 7.5
    assert stats["p95_slope_deg"] <= (28 if "craters" in stats else 16)
    assert 0.75 <= stats["hurst"] <= 0.9
    assert 0.025 <= stats["rock_area_ratio"] <= 0.05


def test_start_is_the_origin_on_clear_ground_and_borders_are_multiples_of_the_cell(accepted):
    field = accepted.field
    assert (field.start.x_m, field.start.y_m) == (0, 0)
    assert abs(float(height_at(field, np.array([0.0]), np.array([0.0]))[0])) < 0.05
    assert min(math.hypot(rock.x_m, rock.y_m) - rock.diameter_m / 2 for rock in field.rocks) > 1.0
    for grid in (field.grid, true_surface(field).grid, field.gdem.grid):
        for origin in (grid.x0_m, grid.y0_m):
            steps = origin / grid.cell_m - 0.5
            assert steps == pytest.approx(round(steps), abs=1e-6)


def test_goal_is_15_or_40_metres_away_inside_the_fence(accepted):
    field = accepted.field
    side = field.grid.rows * field.grid.cell_m
    assert math.hypot(*field.goal_m) == pytest.approx(15 if side < 30 else 40)
    x, y = field.goal_m
    assert field.grid.x0_m + 1.5 < x < field.grid.x0_m + side - 1.5
    assert field.grid.y0_m + 1.5 < y < field.grid.y0_m + side - 1.5


def test_straight_line_is_blocked_and_a_way_with_room_leads_to_the_goal(accepted):
    field, rover, planning = accepted.field, Rover(), Planning(step_m=STEP_M)
    surface = true_surface(field)
    free = poses.pose_freedom(surface, rover, planning, tyres=False) == poses.Freedom.FREE
    start = pose_of(surface.grid, 0.0, 0.0, field.start.yaw_rad)
    assert free[start] and any(free[pose] for pose in goal_poses(surface.grid, field.goal_m))
    assert not all(free[pose] for pose in straight_line(surface.grid, field))
    roomy = free_with_room(surface, rover, planning)
    assert not (roomy & ~free).any()
    assert refusal(field) == ""


def test_orbital_map_is_the_ground_seen_coarsely(accepted):
    """Cells of the orbiter wholly inside the field hold the mean of its soil, on real ground to within the detail."""
    grid, gdem, soil_z = accepted.field.grid, accepted.field.gdem, accepted.field.soil_z.astype(float)
    factor = round(gdem.grid.cell_m / grid.cell_m)
    first = [math.ceil((origin - grid.cell_m / 2) / gdem.grid.cell_m) for origin in (grid.y0_m, grid.x0_m)]
    j, i = (
        round((border * gdem.grid.cell_m - origin) / grid.cell_m + 0.5)
        for border, origin in zip(first, (grid.y0_m, grid.x0_m))
    )
    coarse = block_mean(soil_z[j:, i:], factor)
    row, column = gdem.grid.cell(*((border + 0.5) * gdem.grid.cell_m for border in reversed(first)))
    seen = gdem.heights_m[row : row + coarse.shape[0], column : column + coarse.shape[1]]
    assert np.abs(seen - coarse).max() < (1e-5 if gdem.grid.cell_m < 5 else 0.6)
    assert gdem.grid.rows * gdem.grid.cell_m > grid.rows * grid.cell_m * 1.5


def test_top_surface_is_never_below_the_soil_and_rocks_stand_out(accepted):
    field = accepted.field
    above = truth_height(field) - field.soil_z
    assert above.min() >= 0
    assert (above > 0.01).mean() == pytest.approx(field.stats["rock_area_ratio"], rel=0.45)


def test_same_index_gives_the_same_field():
    first, second = demo_field(4), demo_field(4)
    assert first.field.soil_z.tobytes() == second.field.soil_z.tobytes()
    assert first.seed == second.seed and first.passed_over == second.passed_over
    assert 4000 <= first.seed < 5000


@pytest.mark.parametrize(("make", "seed", "soil", "rocks", "gdem"), [
    (make_field, 1000, 3005522356, 133129314, 1897790101),
    (make_field, 2000, 1382055639, 951683653, 3472778085),
    (real_window, 1001, 869870713, 366835138, 260207938),
])  # fmt: skip
def test_fields_that_missions_were_tuned_on_are_still_the_same(make, seed, soil, rocks, gdem):
    """In tenths of a millimetre, so that the last bits of another machine do not matter."""
    field = make(seed)
    stones = [(rock.x_m, rock.y_m, rock.diameter_m, rock.height_m) for rock in field.rocks]
    found = [
        zlib.crc32(np.rint(np.array(part, float) * 1e4).astype("<i8").tobytes())
        for part in (field.soil_z, stones, field.gdem.heights_m)
    ]
    assert found == [soil, rocks, gdem]


def test_real_heights_are_the_shipped_grid_scaled():
    heights = scaled_heights()
    assert heights.shape == (344, 403)
    assert np.ptp(heights) == pytest.approx((1076 - 236) * 10 / 84 * 0.6)
