"""The folder of the kept map: what cannot be used is dropped alone, a crash leaves the old tile, changes are saved."""

from __future__ import annotations

import os
import shutil
from collections import namedtuple
from pathlib import Path

import numpy as np
import pytest

from onboard.drivers.storage import map_tiles as disk
from onboard.perception.map import ldem as maps
from onboard.perception.map import tiles
from onboard.perception.map.stop_map import NO_POINTS, StopMap, recall
from onboard.records import Ldem
from onboard.records.status import SaveResult

CELL_M = 2.0


def seen(height_m: float, first_j: int = -5, first_i: int = -5, rows: int = 10, columns: int = 10) -> Ldem:
    made = maps.empty(maps.lattice_grid(first_j, first_i, rows, columns, CELL_M))
    made.n[...] = 1
    made.sum_z[...] = height_m
    return made


def keep(folder: Path, *memories: StopMap, start: StopMap | None = None) -> list[str]:
    told: list[str] = []
    keeper = disk.Keeper(str(folder), start, told.append)
    for memory in memories:
        keeper.keep(memory)
    keeper.close()
    return told


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    assert keep(tmp_path / "map", StopMap(seen(0.5), NO_POINTS)) == []
    return tmp_path / "map"


def test_a_kept_map_comes_back_from_four_files(folder: Path) -> None:
    names = ["x+0000_y+0000.tile", "x+0000_y-0001.tile", "x-0001_y+0000.tile", "x-0001_y-0001.tile"]
    assert sorted(path.name for path in folder.iterdir()) == names
    kept = disk.load(folder, CELL_M)
    memory = recall(kept.tiles)
    assert memory and kept.dropped == ()
    assert tiles.same_cells(memory.cells, seen(0.5))


def _tear(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


def _flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[200] ^= 1
    path.write_bytes(data)


def _from_the_future(path: Path) -> None:
    data = path.read_bytes()
    path.write_bytes(data[:8] + b"\x07\x00" + data[10:])


def _foreign(path: Path) -> None:
    path.write_bytes(b"\x89PNG\r\n\x1a\n and so on")


def _another_cell(path: Path) -> None:
    made = maps.empty(tiles.tile_grid(0, 0, 1.0))
    made.n[...] = 1
    path.write_bytes(tiles.encode(next(tiles.cut(made, NO_POINTS))))


def _another_place(path: Path) -> None:
    shutil.copy(path.with_name("x-0001_y-0001.tile"), path)


def _a_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


@pytest.mark.parametrize(
    ("harm", "said"),
    [
        (_tear, "is torn or damaged: its checksum does not fit"),
        (_flip, "is torn or damaged: its checksum does not fit"),
        (_from_the_future, "is of version 7; this program reads 1"),
        (_foreign, "is no map tile"),
        (_another_cell, "has cells of 1 m; this map's are 2 m"),
        (_another_place, "holds the tile of x-0001_y-0001.tile: it was renamed or copied"),
        (_a_folder, "cannot be read: Is a directory"),
    ],
)
def test_a_tile_that_cannot_be_used_is_dropped_alone_with_the_reason(folder: Path, harm, said: str) -> None:
    harm(folder / "x+0000_y+0000.tile")
    for kept in (disk.load(folder, CELL_M), disk.load(folder)):
        assert kept.dropped == (f"{folder / 'x+0000_y+0000.tile'} {said}",)
        assert [(t.j, t.i) for t in kept.tiles] == [(-1, 0), (0, -1), (-1, -1)]


def test_a_file_of_somebody_else_is_dropped_and_left_in_place(folder: Path) -> None:
    (folder / "notes.txt").write_text("not ours")
    assert disk.load(folder, CELL_M).dropped == (f"{folder / 'notes.txt'} is no map tile",)
    keep(folder, StopMap(seen(0.7), NO_POINTS))
    assert (folder / "notes.txt").read_text() == "not ours"


def test_only_changed_tiles_are_written_again(folder: Path) -> None:
    before = {path.name: path.stat().st_ino for path in folder.iterdir()}
    start = recall(disk.load(folder, CELL_M).tiles)
    assert start
    changed = StopMap(maps.paste(start.cells, seen(0.9, 1, 1, 1, 1)), NO_POINTS)
    assert keep(folder, start, changed, changed, start=start) == []
    after = {path.name: path.stat().st_ino for path in folder.iterdir()}
    assert {name for name in after if after[name] != before[name]} == {"x+0000_y+0000.tile"}
    memory = recall(disk.load(folder, CELL_M).tiles)
    assert memory and tiles.same_cells(memory.cells, changed.cells)


@pytest.mark.parametrize("broken", ["fsync", "replace"])
def test_a_crash_before_the_rename_leaves_the_old_tile(folder: Path, monkeypatch, broken: str) -> None:
    class PowerLostError(BaseException):
        """Nothing cleans up after it."""

    def lost(*_: object) -> None:
        raise PowerLostError

    monkeypatch.setattr(*((os, "fsync") if broken == "fsync" else (Path, "replace")), lost)
    tile = next(tiles.cut(seen(0.9), NO_POINTS))
    with pytest.raises(PowerLostError):
        disk.save(folder, tile)
    monkeypatch.undo()
    assert (folder / "x-0001_y-0001.new").exists()
    kept = disk.load(folder, CELL_M)
    memory = recall(kept.tiles)
    assert memory and tiles.same_cells(memory.cells, seen(0.5)) and kept.dropped == ()
    keep(folder)  # the next start
    assert not list(folder.glob("*.new")) and len(list(folder.iterdir())) == 4


def test_the_tile_and_then_its_name_are_forced_to_the_disk(folder: Path, monkeypatch) -> None:
    steps: list[str] = []
    fsync, replace = os.fsync, Path.replace

    def forced(descriptor: int) -> None:
        steps.append(Path(os.readlink(f"/proc/self/fd/{descriptor}")).name)
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", forced)
    monkeypatch.setattr(Path, "replace", lambda a, b: (steps.append("rename"), replace(a, b)))
    disk.save(folder, next(tiles.cut(seen(0.9), NO_POINTS)))
    assert steps == ["x-0001_y-0001.new", "rename", "map"]


def test_a_nearly_full_disk_is_told_and_the_next_map_tries_again(folder: Path, monkeypatch) -> None:
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(1 << 40, 0, 3 << 20))
    told: list[str] = []
    start = recall(disk.load(folder, CELL_M).tiles)
    keeper = disk.Keeper(str(folder), start, told.append, wait=True)
    keeper.keep(StopMap(seen(0.9), NO_POINTS))
    why = "3 MB are free on the disk, and 64 MB are to stay free"
    assert keeper.collect() == (SaveResult("map", f"not kept: {why}"),)
    assert told == [f"the map is not saved in {folder}: {why}"]
    monkeypatch.undo()
    keeper.keep(StopMap(seen(0.9), NO_POINTS))
    keeper.close()
    assert len(told) == 1
    memory = recall(disk.load(folder, CELL_M).tiles)
    assert memory and tiles.same_cells(memory.cells, seen(0.9))


def test_without_a_folder_nothing_is_kept(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    keeper = disk.Keeper("", None, print)
    keeper.keep(StopMap(seen(0.9), NO_POINTS))
    keeper.close()
    assert not list(tmp_path.iterdir())


def test_points_to_register_to_come_back_in_single_precision(tmp_path: Path) -> None:
    points = np.random.default_rng(3).uniform(-9.9, 9.9, (500, 3))
    keep(tmp_path, StopMap(seen(0.5), points))
    memory = recall(disk.load(tmp_path, CELL_M).tiles)
    assert memory and memory.target_points.dtype == np.float64
    ours, theirs = (each[np.lexsort(each.T)] for each in (memory.target_points, points.astype(np.float32)))
    np.testing.assert_array_equal(ours, theirs)
