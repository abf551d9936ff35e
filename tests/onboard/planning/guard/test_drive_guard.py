"""The drive guard's triggers, by hand: a step, a hole, a rock, a change, a line without returns, a lost line."""

from dataclasses import replace

import numpy as np
import pytest

from onboard import config
from onboard.perception.map import ldem
from onboard.perception.map.cell_classes import classify
from onboard.planning.guard import drive_guard
from onboard.planning.guard.wheel_footprint import barred, driven, tracks
from onboard.planning.local.poses import Freedom, pose_index
from onboard.records import Cloud, Pose

ROVER, MAPPING = config.Rover(), config.Mapping_()
SETTINGS = drive_guard.GuardSettings(ROVER, MAPPING, config.DriveGuard(on=True))
GRID = ldem.grid_around(0.0, 0.0, 6.0, 0.1)
AHEAD_M = drive_guard.ahead_m(ROVER, SETTINGS.guard)
WAY = np.column_stack([np.arange(0.0, 2.6, 0.05), np.zeros(52), np.zeros(52)])
PHI = np.radians(np.arange(-30, 30.1, 0.25))
TRACK_Y = 0.23


def known(ground):
    """The map of ground z = ground(x, y), seen well."""
    columns, rows = np.arange(GRID.columns), np.arange(GRID.rows)
    z = ground(*np.meshgrid(GRID.x0_m + GRID.cell_m * columns, GRID.y0_m + GRID.cell_m * rows)).astype(np.float32)
    n, sum_z = np.full(z.shape, 9, np.int32), 9.0 * z.astype(np.float64)
    return classify(replace(ldem.empty(GRID), n=n, sum_z=sum_z, z_hi=z, z_lo=z, view_m=0 * z + 1), MAPPING)


def known_flat():
    return known(flat)


def line(x_m, ground, silent=lambda x, y: False):
    """The line of a rover at x on ground z = ground(x, y), walls steep; beams into `silent` return nothing."""
    origin = np.array([x_m + ROVER.lidar_x_m, 0.0, ROVER.lidar_z_m])
    down = SETTINGS.guard.tilt_rad
    ways = np.column_stack([np.cos(PHI) * np.cos(down), np.sin(PHI), -np.cos(PHI) * np.sin(down)])
    length = np.arange(0.8, 1.9, 0.003)
    points = origin + length[:, None, None] * ways
    below = points[..., 2] <= ground(points[..., 0], points[..., 1])
    first = below.argmax(axis=0)
    ends = points[first, np.arange(len(PHI))]
    quiet = np.array([silent(x, y) for x, y, _ in ends])
    ends[quiet] = origin + 8.0 * ways[quiet]
    return Cloud(origin, ends.astype(np.float32), ~quiet, 0.0)


def drive(ground, silent=lambda x, y: False, surface=None, path=WAY, trail=(), lost=lambda k: False):
    """Lines every 22 mm over ground the map calls even, until the first trigger: where the rover was, and the cells."""
    watch = drive_guard.begin(surface or known_flat())
    trail = np.array(trail, float).reshape(-1, 3)
    for k, x in enumerate(np.arange(0.3, 1.1, 0.022)):
        ahead = tracks(path[path[:, 0] >= x], trail, GRID, ROVER)
        if lost(k):
            continue
        watch, bad = drive_guard.hear(watch, line(x, ground, silent), Pose(float(x), 0.0), ahead, SETTINGS)
        if bad:
            return x, bad
    return None, ()


def flat(x, y):
    return np.zeros_like(x)


def dip(x, y, deep=0.15, wide=0.3, at=(1.85, TRACK_Y)):
    return np.where(np.hypot(x - at[0], y - at[1]) <= wide / 2, -deep, 0.0)


def rock(x, y):
    return np.where(np.hypot(x - 1.85, y - TRACK_Y) <= 0.15, 0.15, 0.0)


def test_even_ground_never_stops_the_rover():
    assert drive(flat) == (None, ())


def test_even_slope_that_the_map_does_not_know_never_stops_the_rover():
    unknown = classify(ldem.empty(GRID), MAPPING)
    assert drive(lambda x, y: 0.15 * (x - AHEAD_M) - 0.1 * y, surface=unknown) == (None, ())


@pytest.mark.parametrize(("ground", "reasons"), [
    (dip, {"depth", "step", "change"}),
    (rock, {"height", "step", "change"}),
    (lambda x, y: np.where(x > 1.85, 0.1, 0.0), {"step", "height", "change"}),
])  # fmt: skip
def test_hole_rock_and_step_on_a_track_stop_the_rover_well_before_a_wheel(ground, reasons):
    x, bad = drive(ground)
    assert {cell.why for cell in bad} <= reasons
    front_wheel = x + ROVER.half_wheelbase_m + ROVER.wheel_radius_m
    assert front_wheel + 0.3 < 1.7
    assert all(abs(cell.x_m - 1.85) <= 0.35 for cell in bad)


@pytest.mark.parametrize("ground", [dip, rock])
def test_strip_alone_finds_what_the_map_does_not_know(ground):
    _, bad = drive(ground, surface=classify(ldem.empty(GRID), MAPPING))
    assert {cell.why for cell in bad} & {"step", "depth", "height"}


def stone(x, y, high=0.4):
    """Beside the track, under no wheel."""
    return np.where((np.abs(x - 1.85) <= 0.2) & (np.abs(y - TRACK_Y - 0.4) <= 0.15), high, 0.0)


def test_stone_beside_a_track_that_the_map_shows_is_not_taken_for_a_hole_on_the_track():
    assert drive(stone, surface=known(stone)) == (None, ())
    assert drive(lambda x, y: stone(x, y) + dip(x, y), surface=known(stone))[0] is not None


def test_low_stone_that_the_plan_was_made_with_does_not_stop_the_rover_and_a_new_one_does():
    def low(x, y):
        return rock(x, y) * 0.07 / 0.15

    assert drive(low)[0] is not None
    assert drive(low, surface=known(low)) == (None, ())


@pytest.mark.parametrize("off_m", [-0.1, 0.1])
def test_strip_allows_a_known_stone_to_lie_a_cell_beside_where_the_map_has_it(off_m):
    def low(x, y):
        return rock(x, y) * 0.07 / 0.15

    def judged(surface):
        watch = drive_guard.begin(surface)
        ahead = tracks(WAY, np.empty((0, 3)), GRID, ROVER)
        for x in np.arange(0.3, 1.1, 0.022):
            watch, _ = drive_guard.hear(watch, line(x, low), Pose(float(x), 0.0), ahead, SETTINGS)
        return {why for why, cells in drive_guard.judge(watch, Pose(1.1, 0.0), ahead, SETTINGS).items() if cells.any()}

    assert judged(known_flat())
    assert judged(known(lambda x, y: low(x + off_m, y))) == set()


def test_hole_that_the_map_shows_less_deep_stops_the_rover():
    assert drive(lambda x, y: dip(x, y, 0.12), surface=known(lambda x, y: dip(x, y, 0.05)))[0] is not None


def test_step_below_its_limit_does_not_stop_the_rover():
    assert drive(lambda x, y: np.where(x > 1.85, 0.05, 0.0)) == (None, ())


def test_hole_between_the_tracks_does_not_stop_the_rover():
    middle = np.add(WAY, (0.0, 0.05, 0.0))  # of a row of cells
    assert drive(lambda x, y: dip(x, y, wide=0.09, at=(1.85, 0.05)), path=middle) == (None, ())


def test_poses_driven_over_never_trigger():
    assert drive(dip)[0] is not None
    assert drive(dip, trail=WAY) == (None, ())


def test_three_silent_beams_of_a_track_in_three_lines_running_count_as_a_hole():
    x, bad = drive(flat, silent=lambda x, y: 1.5 < x < 1.55 and abs(y - TRACK_Y) < 0.02)
    assert {cell.why for cell in bad} == {"no return"}
    assert x + AHEAD_M == pytest.approx(1.545, abs=0.03)


def test_two_silent_beams_and_two_silent_lines_do_not():
    spacing = 0.0047  # of the beams on the line
    assert drive(flat, silent=lambda x, y: x > 1.5 and abs(y - TRACK_Y) < 0.9 * spacing) == (None, ())
    assert drive(flat, silent=lambda x, y: 1.5 < x < 1.53) == (None, ())


def test_lost_lines_are_no_hole_and_forget_nothing():
    assert drive(flat, lost=lambda k: k % 3 > 0) == (None, ())
    assert drive(dip, lost=lambda k: k % 3 > 0)[0] is not None


def test_blocked_cell_bars_every_pose_that_puts_a_wheel_on_it_or_beside_it_and_no_other():
    freedom = np.full((8, GRID.rows, GRID.columns), Freedom.FREE, np.uint8)
    left = barred(freedom, [(0.425, 0.28)], GRID, ROVER)
    j, i, o = pose_index(GRID, 0.05, 0.05, 0.0)
    assert left[o, j, i] == left[o, j + 1, i] == Freedom.BLOCKED
    assert left[o, j, i + 3] == Freedom.FREE  # the body passes over it, no wheel does
    assert (left == Freedom.BLOCKED).sum() == 8 * 36
    again = tracks(np.array([[0.05, 0.05, 0.0]]), np.empty((0, 3)), GRID, ROVER)
    assert again.sum() == 36
    assert again[GRID.cell(0.425, 0.28)]


def test_pose_of_the_trail_is_known_by_its_lattice_pose_whichever_end_leads():
    stations = np.array([[0.02, 0.03, 0.0], [0.5, 0.0, 0.0]])
    assert driven(stations, np.array([[0.04, 0.01, np.pi]]), GRID).tolist() == [True, False]
