"""Tests of the small rocks table: the placed rock has the required size, and poses that roll over it are counted."""

import math
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from hil.terrain.rocks import rock_of, rock_top
from onboard.config import Config, Rover
from onboard.records import BeamStatus, Grid, Pose
from tests.missions import __main__ as command
from tests.missions.proofs import commands as proofs
from tests.missions.proofs import dark_rock, rocks_proof
from tests.missions.proofs.dark_rock import DarkRow
from tests.missions.proofs.rocks_proof import (
    AWAYS_M,
    HEIGHTS_M,
    RockRow,
    RockRun,
    beams_on,
    rocky,
    rolling_over,
    shortfalls,
    thinned,
    top_of,
)
from tests.missions.world.scan_errors import DEFAULT
from tests.missions.world.scanner import scanner
from tests.missions.world.world import wheels

pytestmark = pytest.mark.tool

ROVER = Rover()
ROW = RockRow(2.0, 1, False, 0.08, 0.2, 90, 0, 32)
DARK = DarkRow(1, 3.0, 0, 0, 0, "arrived", "at the goal", 4, 9.3)


@pytest.mark.parametrize("width_m", [0.15, 0.4])
@pytest.mark.parametrize("height_m", HEIGHTS_M)
def test_a_rock_has_the_height_and_width_asked_for(height_m, width_m):
    rock = rock_of(3.0, -1.0, 0.5, width_m, height_m, np.random.default_rng(1))
    x_m, y_m = top_of(rock)
    assert rock_top(rock, np.array([x_m]), np.array([y_m]))[0] == pytest.approx(0.5 + height_m, abs=1e-5)
    away = np.hypot(rock.vertices_m[:, 0] - 3.0, rock.vertices_m[:, 1] + 1.0)
    assert 2 * away.max() == pytest.approx(width_m, abs=1e-5)
    assert rock.vertices_m[:, 2].min() < 0.5  # it does not float


def test_four_rocks_stand_at_their_distance_more_than_a_metre_apart():
    for away_m in AWAYS_M:
        field, _ = rocky(away_m, HEIGHTS_M, 5, np.random.default_rng(5))
        places = np.array([(rock.x_m, rock.y_m) for rock in field.rocks])
        assert np.hypot(*places.T) == pytest.approx(away_m)
        apart = np.hypot(*(places[:, None] - places[None, :]).transpose(2, 0, 1))
        assert apart[~np.eye(4, dtype=bool)].min() >= 1.0
        assert [rock.height_m for rock in field.rocks] == list(HEIGHTS_M)


def test_a_pose_that_rolls_over_a_point_has_it_under_a_wheel_and_no_other_pose_has():
    grid, point = Grid(-3.0, -3.0, 0.1, 61, 61), (0.43, -0.27)
    found = {tuple(pose) for pose in rolling_over(point, grid, ROVER).tolist()}
    assert len(found) >= 24
    for o in range(8):
        for j, i in np.ndindex(61, 61):
            x, y = grid.centre(j, i)
            yaw = o * math.pi / 8
            c, s = math.cos(yaw), math.sin(yaw)
            off = [(point[0] - at[0], point[1] - at[1]) for at in wheels(Pose(x, y, yaw_rad=yaw), ROVER)]
            under = any(abs(c * dx + s * dy) <= 0.05 and abs(c * dy - s * dx) <= 0.05 for dx, dy in off)
            assert ((o, j, i) in found) == under


def test_a_thinned_rock_keeps_5_to_12_beams_side_by_side_and_the_ground_keeps_all():
    made, rng = scanner(Config()), np.random.default_rng(7)
    field, world = rocky(4.0, (0.10,) * 4, 7, rng)
    pose = world.stand(world.start.x_m, world.start.y_m, world.start.yaw_rad, made.config.rover)
    scans = made.sweep(world, pose, rng)
    on_rock = [beams_on(rock, field, made, world, pose) for rock in field.rocks]
    before, after = (np.stack([s.status for s in of]) == BeamStatus.OK for of in (scans, thinned(scans, on_rock, rng)))
    for beams in on_rock:
        line, beam = np.unravel_index(beams, after.shape)
        left = after[line, beam]
        assert len(beams) > 40 and 5 <= left.sum() <= 12
        assert np.ptp(line[left]) <= 6 and np.ptp(beam[left]) <= 6
    others = np.ones(after.size, bool)
    others[np.concatenate(on_rock)] = False
    assert np.array_equal(before.ravel()[others], after.ravel()[others])


def test_a_high_rock_near_by_blocks_and_level_ground_does_not():
    rows = rocks_proof.fly(RockRun(4.0, errors=None), 1)
    assert [row.blocks for row in rows if row.height_m == 0.15] == [True]
    assert all(row.poses > 20 and row.beams > 20 for row in rows)


@pytest.mark.parametrize(("changes", "short"), [
    ({}, False), ({"free": 1}, True), ({"free": 1, "away_m": 4.0}, True), ({"free": 1, "away_m": 6.0}, False),
    ({"free": 1, "height_m": 0.07}, False), ({"free": 1, "few": True, "away_m": 4.0, "height_m": 0.10}, True),
    ({"free": 1, "few": True, "away_m": 6.0, "height_m": 0.10}, False),
    ({"free": 1, "few": True, "beams": 4}, False),
])  # fmt: skip
def test_each_rock_that_has_to_block_and_does_not_is_named(changes, short):
    said = shortfalls([replace(ROW, **changes)])
    assert len(said) == short and all("seed 1" in line for line in said)


@pytest.mark.parametrize("broken", [{"free": 1}, {"touched": 1}, {"hard": 1}])
def test_a_dark_rock_free_or_touched_falls_short(broken):
    assert dark_rock.shortfalls([DARK]) == []
    assert len(dark_rock.shortfalls([DARK, replace(DARK, **broken)])) == 1


@pytest.mark.parametrize(("seed", "errors"), [(2, None), (3, DEFAULT), (10, DEFAULT)])
def test_a_mission_goes_round_a_dark_rock_in_its_way(seed, errors):
    row = dark_rock.fly(dark_rock.DarkRun(errors=errors), seed)
    assert dark_rock.shortfalls([row]) == []
    assert row.way_m > 8.5 and row.outcome == "arrived"


@pytest.mark.parametrize(("free", "code"), [(0, 0), (3, 1)])
def test_the_command_shows_both_and_its_exit_code_is_the_promise(tmp_path, monkeypatch, free, code):
    def fly_all(fly, runs, workers):
        for run in runs:
            for seed in run.seeds:
                dark = isinstance(run, dark_rock.DarkRun)
                yield replace(DARK, seed=seed) if dark else (replace(ROW, away_m=run.away_m, free=free, few=run.few),)

    monkeypatch.setattr(proofs, "fly_all", fly_all)
    said = CliRunner().invoke(command.app, ["rocks", "--seeds", "1-2", "--out", str(tmp_path)])
    assert said.exit_code == code
    assert "2 dark rocks" in said.output
    table = (tmp_path / "rocks.md").read_text()
    assert f"| 0.08 m high | {2 * (free == 0)} of 2 |" in table and "dark, in the way" in table
    assert "<!-- begin rocks" in proofs.MAPS_PAGE.read_text()
