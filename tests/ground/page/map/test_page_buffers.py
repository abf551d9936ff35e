"""Buffers of the 3D panel: points and heights as a browser gets them, their frame, number, and the time of a scan."""

import math
import struct

import numpy as np
import pytest

from ground.archive.store import Archive
from ground.page.map import buffers
from ground.page.map.maps import Maps
from ground.page.past.replay import Replay
from protocol import WireError
from protocol.link.bulk import Product
from protocol.products import LDEM_CODEC, LdemProduct, MapGrid, encode_ldem
from protocol.products.scan import SCAN_CODEC, ScanProduct, encode_scan

UTC = 1_700_000_000 * 10**9
LINE_NS, END_NS = 25_000_000, 9_000_000_000


def a_scan(lines=4, beams=5, range_m=2.0):
    """All beams of one range; scanner 0.7 m over a rover that stands at (10, 20) and looks north."""
    T_map_base, T_base_scanner = np.eye(4), np.eye(4)
    T_map_base[:2, :2], T_map_base[:2, 3] = [[0.0, -1.0], [1.0, 0.0]], (10.0, 20.0)
    T_base_scanner[2, 3] = 0.7
    start_ns = END_NS - LINE_NS * np.arange(lines, dtype=np.int64)[::-1]
    tilt_ns = np.append(start_ns, END_NS + LINE_NS)
    ranges_m = np.full((lines, beams), range_m, np.float32)
    return ScanProduct(
        6, -0.2, 0.4 / (beams - 1), ranges_m, np.zeros((lines, beams), np.uint8), start_ns, np.full(lines, 17361.1),
        tilt_ns, np.zeros(lines + 1), T_map_base, T_base_scanner,
    )  # fmt: skip


def opened(buffer):
    """Head and (n, 3) points of a cloud."""
    return struct.unpack_from("<4d", buffer), np.frombuffer(buffer, "<f4", offset=32).reshape(-1, 3)


def a_map(rows, columns):
    heights_m = np.arange(rows * columns, dtype=np.float32).reshape(rows, columns) / 1000
    heights_m[0, 0] = np.nan
    return LdemProduct(MapGrid(0.05, 1.05, 0.1, rows, columns), heights_m, np.full((rows, columns), 3, np.uint8))


def test_points_are_in_the_map_frame():
    head, points_m = opened(buffers.cloud_buffer(encode_scan(a_scan()), UTC, None))
    assert head[:3] == (20, 20, 6) and points_m.shape == (20, 3)
    away_m = points_m - [10.0, 20.0, 0.7]
    assert np.linalg.norm(away_m, axis=1) == pytest.approx(2.0, abs=2e-3)
    assert (away_m[:, 1] > 1.9).all() and np.abs(away_m[:, 2]).max() < 1e-3  # ahead is north, at the scanner's height


def test_a_large_scan_is_left_out_evenly_down_to_20000_points():
    head, points_m = opened(buffers.cloud_buffer(encode_scan(a_scan(300, 300)), UTC, None))
    assert head[1] == 90_000 and head[0] == len(points_m) == 18_000


@pytest.mark.parametrize(
    ("onboard_ns", "taken_utc_s"),
    [(END_NS, UTC / 1e9), (END_NS + 60 * 10**9, UTC / 1e9 - 60), (None, math.nan), (END_NS - 10**9, math.nan)],
    ids=["just taken", "a minute before", "no onboard time", "of another boot"],
)
def test_the_time_of_a_scan_is_that_of_its_measurement_and_not_of_its_arrival(onboard_ns, taken_utc_s):
    head, _ = opened(buffers.cloud_buffer(encode_scan(a_scan()), UTC, onboard_ns))
    assert head[3] == pytest.approx(taken_utc_s, nan_ok=True)


@pytest.mark.parametrize("data", [b"", b"SCN1", encode_scan(a_scan())[:-1]])
def test_bytes_that_are_no_scan_are_refused(data):
    with pytest.raises(WireError):
        buffers.cloud_buffer(data, UTC, None)


@pytest.mark.parametrize(("rows", "columns", "step"), [(4, 3, 1), (200, 200, 2), (300, 200, 2)])
def test_the_terrain_keeps_its_place_and_at_most_20000_cells(rows, columns, step):
    product = a_map(rows, columns)
    buffer = buffers.terrain_buffer(product)
    x0_m, y0_m, cell_m, sent_rows, sent_columns = struct.unpack_from("<5d", buffer)
    heights_m = np.frombuffer(buffer, "<f4", offset=40).reshape(int(sent_rows), int(sent_columns))
    assert (x0_m, y0_m, cell_m) == pytest.approx((0.05, 1.05, 0.1 * step))
    assert np.array_equal(heights_m, product.heights_m[::step, ::step], equal_nan=True)
    assert heights_m.size <= buffers.MOST_CELLS and np.isnan(heights_m[0, 0])


def test_the_newest_scan_and_map_are_served_and_another_codec_leaves_the_old():
    maps = Maps(None, None)
    for make in (maps.cloud, maps.terrain):
        with pytest.raises(LookupError):
            make()
    assert maps.tree()["scan"] is None
    maps.add(Product(1, "scan", SCAN_CODEC, encode_scan(a_scan())), UTC, END_NS)
    maps.add(Product(2, "scan", "another", b"no scan"), UTC + 10**9, END_NS)
    maps.add(Product(3, "ldem", LDEM_CODEC, encode_ldem(a_map(4, 3))), UTC, END_NS)
    assert maps.tree()["scan"] == {"utc_s": UTC / 1e9, "buffer": "/map/cloud.bin?scan=1"}
    assert opened(maps.cloud())[0] == (20, 20, 6, UTC / 1e9) and len(maps.terrain()) == 40 + 4 * 12


def test_a_past_run_has_its_own_scan_with_the_time_of_its_measurement(tmp_path):
    path = tmp_path / "archive.db"
    with Archive(path, UTC) as archive:
        archive.add("items", 5 * 10**9, END_NS + 2 * 10**9, "mode", 1.0, 1)  # onboard time is 6 s before the station's
        archive.add("products", 7 * 10**9, 1, "scan", SCAN_CODEC, encode_scan(a_scan()))
    replay = Replay(path)
    (row,) = replay.runs()
    part = replay.at(row, 7 * 10**9).maps["scan"]
    head, points_m = opened(replay.cloud(int(part["buffer"].rpartition("=")[2])))
    assert len(points_m) == 20 and head[3] == pytest.approx(UTC / 1e9 + 7 - 4)
    with pytest.raises(LookupError):
        replay.cloud(99)
