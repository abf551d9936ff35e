"""A run that begins with the map of an earlier one: it knows its ground, and its record replays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from onboard import config
from onboard.__main__ import app
from onboard.app import load_tiles, recall_map
from onboard.config import ConfigError
from onboard.drivers.storage.map_tiles import Keeper, save
from onboard.perception.map import ldem as maps
from onboard.perception.map import tiles
from onboard.perception.map.stop_map import recall
from onboard.record.replay import last_map, replay
from onboard.record.writer import Recorder
from protocol.tables.modes import Phase
from tests.onboard.core_bench import QUICK, CoreBench, first_map

GOAL = (3.0, 0.5)


def kept_in(folder):
    return replace(QUICK, mapping=replace(QUICK.mapping, folder=str(folder)))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("kept") / "map"
    keeper = Keeper(str(made), None, pytest.fail)
    keeper.keep(first_map())
    keeper.close()
    return made


@pytest.fixture(scope="module")
def record(folder, tmp_path_factory):
    """A goto on the kept map up to the first way, recorded."""
    path = tmp_path_factory.mktemp("record") / "onboard.mcap"
    settings = replace(kept_in(folder), record=config.Record(path=str(path)))
    kept = load_tiles(settings)
    rover = CoreBench(settings=settings, memory=recall_map(settings, kept))
    with Recorder(settings, None, kept.tiles) as recorder:
        while rover.phase is not Phase.DRIVING:
            if rover.tick == 200:
                rover.goto(*GOAL)
            rover.step()
            recorder.write(rover.inputs, rover.outputs)
        recorder.end(rover.rover.executive.memory)
    return path, rover


def test_a_mission_on_a_kept_map_begins_with_one_scan_that_is_registered_to_it(record):
    _, rover = record
    assert [phase for _, phase in rover.phases] == [Phase.SCANNING, Phase.MAPPING, Phase.PLANNING, Phase.DRIVING]
    assert [event.name for event in rover.events].count("REGISTERED") == 1
    assert rover.rover.executive.mission.scans_taken == 1


def test_cells_behind_the_rover_are_those_of_the_run_before(record, folder):
    _, rover = record
    before, now = recall_map(QUICK, load_tiles(kept_in(folder))).cells, rover.rover.executive.memory.cells
    behind = maps.window(now, -3.0, 0.0, 3.0)
    assert (behind.n > 0).mean() > 0.5
    assert tiles.same_cells(behind, maps.window(before, -3.0, 0.0, 3.0))


def test_a_kept_map_of_elsewhere_does_not_stand_for_the_ground_here(folder):
    memory = first_map()
    grid = memory.cells.grid
    away = replace(memory, cells=replace(memory.cells, grid=replace(grid, x0_m=grid.x0_m + 30.0)))
    rover = CoreBench(memory=away)
    rover.settle()
    rover.goto(*GOAL)
    rover.until_phase(Phase.PLANNING)
    assert [phase for _, phase in rover.phases].count(Phase.SCANNING) == 2
    cells = rover.rover.executive.memory.cells
    assert np.isfinite(maps.window(cells, 0.0, 0.0, 1.0).assumed_z).all()
    assert maps.knows(cells, 30.0, 0.0, 0.4) and maps.knows(cells, 0.0, 0.0, 0.4)


def test_a_run_that_began_with_a_kept_map_replays_without_the_folder(record, folder, tmp_path):
    path, rover = record
    folder.rename(tmp_path / "moved")
    try:
        verdict = replay(path)
    finally:
        (tmp_path / "moved").rename(folder)
    assert verdict.identical and verdict.ticks == rover.tick


def test_without_its_tiles_the_same_inputs_would_replay_to_something_else(record, monkeypatch):
    monkeypatch.setattr("onboard.record.replay.recall", lambda _: recall(()))
    assert not replay(record[0]).identical


def test_the_record_holds_the_map_that_the_run_left(record):
    path, rover = record
    joined, _ = tiles.join(last_map(path))
    cells = rover.rover.executive.memory.cells
    assert tiles.same_cells(maps.crop(joined, cells.grid), cells)


def test_no_folder_named_or_none_there_yet_is_no_map(tmp_path):
    for settings in (QUICK, kept_in(tmp_path / "none")):
        kept = load_tiles(settings)
        assert (kept.files, kept.dropped) == ((), ())
        assert recall_map(settings, kept) is None


def test_a_file_in_place_of_the_folder_and_tiles_too_far_apart_refuse_the_start(folder, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match=r"mapping.folder = .*file' cannot be read: Not a directory"):
        load_tiles(kept_in(tmp_path / "file"))
    settings = kept_in(tmp_path / "far")
    (tmp_path / "far").mkdir()
    for k in (0, 70):
        made = maps.empty(tiles.tile_grid(k, k, 0.1))
        made.n[...] = 1
        save(tmp_path / "far", next(tiles.cut(made, np.empty((0, 3)))))
    with pytest.raises(ConfigError, match=r"mapping.folder = .*710 m x 710 m apart"):
        recall_map(settings, load_tiles(settings))
    told = CliRunner().invoke(app, ["run", "--set", f"mapping.folder={tmp_path / 'far'}"])
    assert told.exit_code == 78 and told.stderr.count("\n") == 1
