"""Tiles of the kept map: cut and joined without a changed bit; bytes that were not written so are never a tile."""

from __future__ import annotations

import hashlib
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.perception.map import ldem as maps
from onboard.perception.map import tiles
from onboard.perception.map.tiles import Tile, TileError
from onboard.records import Ldem

LAW = settings(max_examples=25, deadline=None, derandomize=True)
CELL_M = 2.0  # 5 x 5 cells to a tile: few bytes, and each of them can be cut off
NUMBER = st.integers(-30, 30)


def seen(seed: int, first_j: int = 0, first_i: int = 0, rows: int = 5, columns: int = 5) -> Ldem:
    """A map of random bits of every layer: NaN, infinities and -0.0 are among them."""
    rng = np.random.default_rng(seed)
    made = maps.empty(maps.lattice_grid(first_j, first_i, rows, columns, CELL_M))
    for name, kind, _ in maps.LAYERS:
        layer = getattr(made, name)
        layer[...] = np.frombuffer(rng.bytes(layer.nbytes), kind).reshape(layer.shape)
    return made


def points(seed: int, count: int, scale_m: float = 40.0) -> np.ndarray:
    return np.random.default_rng(seed).normal(0.0, scale_m, (count, 3)).astype(np.float32)


def tile(seed: int = 1) -> Tile:
    return next(tiles.cut(seen(seed, -5, 5), np.array([[12.0, -3.0, 0.5], [500.0, 0.0, 0.0]])))


def sealed(content: bytes) -> bytes:
    """The bytes with a checksum that fits them."""
    return content + hashlib.blake2b(content, digest_size=16).digest()


@LAW
@given(NUMBER, NUMBER, st.integers(1, 17), st.integers(1, 17), st.integers(0, 2**32))
def test_a_map_cut_packed_unpacked_and_joined_is_the_same_bit_by_bit(
    first_j: int, first_i: int, rows: int, columns: int, seed: int
) -> None:
    cells = seen(seed, first_j, first_i, rows, columns)
    joined, _ = tiles.join([tiles.decode(tiles.encode(t)) for t in tiles.cut(cells, np.empty((0, 3)))])
    assert tiles.same_cells(maps.crop(joined, cells.grid), cells)
    outside = maps.paste(joined, maps.empty(cells.grid)) if _within(cells, joined) else joined
    assert tiles.same_cells(outside, maps.empty(joined.grid))


def _within(part: Ldem, whole: Ldem) -> bool:
    (j, i), (at_j, at_i) = maps.first_cell(part.grid), maps.first_cell(whole.grid)
    return at_j <= j and at_i <= i


@LAW
@given(st.integers(0, 200), st.integers(0, 2**32))
def test_every_point_comes_back_in_the_tile_that_it_lies_over(count: int, seed: int) -> None:
    cells, given_points = seen(seed, -100, -100, 200, 200), points(seed, count)
    cut = list(tiles.cut(cells, given_points))
    for each in cut:
        low = np.array([each.i, each.j]) * tiles.TILE_M
        assert (np.floor((each.points_m[:, :2].astype(float) - low) / tiles.TILE_M) == 0).all()
    _, found = tiles.join([tiles.decode(tiles.encode(each)) for each in cut])
    assert sorted(map(tuple, found)) == sorted(map(tuple, given_points.astype(float)))


def test_tiles_are_10_m_long_and_number_0_begins_at_the_origin() -> None:
    assert tiles.side_cells(0.1) == 100
    grid = tiles.tile_grid(0, -1, 0.1)
    assert (grid.x0_m, grid.y0_m) == pytest.approx((-9.95, 0.05))
    assert (grid.rows, grid.columns) == (100, 100)


def test_a_tile_without_anything_seen_is_not_made() -> None:
    cells = maps.paste(maps.empty(maps.lattice_grid(-10, -10, 20, 20, CELL_M)), seen(1, -10, 5))
    assert [(t.j, t.i) for t in tiles.cut(cells, np.empty((0, 3)))] == [(-2, 1)]


def test_between_joined_tiles_that_do_not_touch_the_map_is_unseen() -> None:
    far = [Tile(j, i, seen(7, 5 * j, 5 * i), points(1, 0)) for j, i in ((-2, 3), (1, 0))]
    joined, _ = tiles.join(far)
    assert (joined.grid.rows, joined.grid.columns) == (20, 20)
    for each in far:
        assert tiles.same_cells(maps.crop(joined, each.cells.grid), each.cells)
    assert tiles.same_cells(maps.crop(joined, tiles.tile_grid(0, 0, CELL_M)), maps.empty(tiles.tile_grid(0, 0, CELL_M)))


def test_tiles_too_far_apart_to_be_held_are_refused() -> None:
    ends = [Tile(k, k, seen(1, 5 * k, 5 * k), points(1, 0)) for k in (0, 700)]
    with pytest.raises(ValueError, match=r"7010 m x 7010 m apart: 12285025 cells, 10000000 can be held"):
        tiles.join(ends)
    with pytest.raises(ValueError, match="no tiles"):
        tiles.join([])


def test_only_tiles_with_a_changed_cell_are_cut_again() -> None:
    before = seen(1, -10, -10, 20, 20)
    assert not list(tiles.cut(before, points(1, 9), before))
    after = maps.paste(before, seen(2, 3, -7, 1, 1))
    assert [(t.j, t.i) for t in tiles.cut(after, points(1, 9), before)] == [(0, -2)]
    grown = maps.crop(before, maps.lattice_grid(-20, -20, 40, 40, CELL_M))
    assert not list(tiles.cut(grown, points(1, 9), before))


def test_the_window_of_a_moving_rover_looks_the_same_on_the_map_and_on_its_joined_tiles() -> None:
    cells = seen(4, -23, -31, 60, 70)
    joined, _ = tiles.join(list(tiles.cut(cells, points(1, 0))))
    for x_m in np.arange(-50.0, 70.0, 7.3):
        ours, theirs = (maps.window(each, x_m, 0.6 * x_m, 20.0) for each in (joined, cells))
        assert ours.grid == theirs.grid and tiles.same_cells(ours, theirs)


def test_a_tile_torn_off_at_any_length_is_detected() -> None:
    whole = tiles.encode(tile())
    for size in range(len(whole)):
        with pytest.raises(TileError, match=r"^is (empty: )?torn"):
            tiles.decode(whole[:size])


def test_a_flipped_byte_anywhere_is_detected() -> None:
    whole = tiles.encode(tile())
    for at in range(len(whole)):
        with pytest.raises(TileError, match=r"no map tile" if at < 8 else r"version" if at < 10 else r"checksum"):
            tiles.decode(whole[:at] + bytes([whole[at] ^ 0x40]) + whole[at + 1 :])


def test_a_tile_of_a_later_version_is_named_even_where_its_form_is_unknown() -> None:
    later = b"ELDTILE\n" + struct.pack("<H", 2) + b"whatever version 2 holds, forty bytes and more of it"
    with pytest.raises(TileError, match=r"^is of version 2; this program reads 1$"):
        tiles.decode(later)


@pytest.mark.parametrize(
    ("at", "kind", "value", "said"),
    [
        (10, "<d", 1.0, "has 5 cells of 1 m to a side; a tile is 10 m long"),
        (10, "<d", float("nan"), "cells of nan m"),
        (10, "<d", -2.0, "cells of -2 m"),
        (26, "<I", 4, "has 4 cells of 2 m to a side"),
        (30, "<I", 2, "unpacks to 1162 bytes; its cells and points need 1174"),
        (36, "2s", b"m:", r"has the layers m:.*; this program reads n:"),
        (30, "<I", 0, "does not unpack|unpacks to"),
    ],
)
def test_bytes_with_a_good_checksum_but_wrong_inside_are_refused(at: int, kind: str, value: object, said: str) -> None:
    content = bytearray(tiles.encode(tile())[:-16])
    struct.pack_into(kind, content, at, value)
    with pytest.raises(TileError, match=said):
        tiles.decode(sealed(bytes(content)))


def test_a_body_that_is_not_packed_is_refused() -> None:
    content = tiles.encode(tile())[:-16].replace(b"\x28\xb5\x2f\xfd", b"raw?", 1)  # zstd's mark
    with pytest.raises(TileError, match=r"^does not unpack: "):
        tiles.decode(sealed(content))


def test_the_same_tile_gives_the_same_bytes_and_a_loaded_one_may_be_changed() -> None:
    assert tiles.encode(tile()) == tiles.encode(tile())
    loaded = tiles.decode(tiles.encode(tile()))
    assert (loaded.j, loaded.i) == (-1, 1)
    assert loaded.points_m.tolist() == [[12.0, -3.0, 0.5]]
    loaded.cells.n[0, 0] = 7
