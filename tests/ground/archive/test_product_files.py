"""`ground get` writes files that other tools open, with the numbers that were sent."""

import json
import math

import numpy as np
import pytest

from ground.__main__ import run
from ground.products import files as products
from protocol import WireError
from protocol.link.bulk import Product
from protocol.products import PRODUCTS, MapGrid, encode_ldem
from protocol.products.height_std import HeightStd, encode_height_std
from protocol.products.nsp import Candidate, Explanation, encode_nsp
from protocol.products.scan import ScanProduct, encode_scan
from tests.ground.toy_rover import a_map

HEIGHT_M = 0.9
LINES, BEAMS = 40, 61


def floor_scan() -> ScanProduct:
    """A sweep over level ground from HEIGHT_M up, the axis turning steadily; the rover at (5, 2), headed north."""
    start_ns = 25_000_000 * np.arange(1, LINES + 1)
    tilt_ns = 5_000_000 * np.arange(0, 5 * LINES + 20)
    rate_radps = 0.5
    phi = np.linspace(-1.0, 1.0, BEAMS)
    beam_ns = 17_000.0
    tilt = 0.4 + rate_radps * (start_ns[:, None] + beam_ns * np.arange(BEAMS)) / 1e9
    ranges = HEIGHT_M / (np.sin(tilt) * np.cos(phi))
    status = np.zeros((LINES, BEAMS), np.uint8)
    status[3, 7], ranges[3, 7] = 1, math.nan
    T_map_base = np.array([[0.0, -1, 0, 5], [1, 0, 0, 2], [0, 0, 1, 0], [0, 0, 0, 1]])
    T_base_scanner = np.eye(4)
    T_base_scanner[:3, 3] = 0.3, 0.0, HEIGHT_M
    return ScanProduct(
        4,
        -1.0,
        2.0 / (BEAMS - 1),
        ranges.astype(np.float32),
        status,
        start_ns,
        np.full(LINES, beam_ns),
        tilt_ns,
        0.4 + rate_radps * tilt_ns / 1e9,
        T_map_base,
        T_base_scanner,
    )


TOLD = Explanation(
    2, (1.0, 2.0, 0.5), (12.0, 3.0), (4.0, 2.5, math.pi / 2), 3.2, (1.0, 0.5), "explore", "drive", "R10", "it shrinks",
    34163, 40000, (Candidate(1, 2, 4.0, 2.5, 1.57, 0.9, 1.0, -0.1, 0.6, 50.0, math.inf),), {"not free": 5837},
)  # fmt: skip


def sent(name, data):
    return Product(7, name, next(row.codec for row in PRODUCTS if row.name == name), data)


def test_every_product_has_a_file_of_its_own_kind():
    names = [products.default_name(row.name) for row in PRODUCTS]
    assert names == ["ldem.npz", "scan.npz", "nsp.json", "record.mcap", "height_std.npz"]
    assert products.default_name("parameters") == "parameters.txt"


def test_the_map_as_npz_says_where_it_is_and_how_much_is_known(tmp_path):
    holds = products.save(sent("ldem", encode_ldem(a_map())), tmp_path / "maps" / "m.npz")
    with np.load(tmp_path / "maps" / "m.npz") as arrays:
        assert np.abs(arrays["heights_m"] - a_map().heights_m).max() <= 0.001
        assert float(arrays["cell_m"]) == 0.1
    assert "200 x 200 cells of 0.1 m around 10.00, 10.00, 100% known" in holds


def test_the_deviations_as_npz_say_where_they_are_and_how_many_are_known(tmp_path):
    std_m = np.full((20, 30), 0.004, np.float32)
    std_m[0] = np.nan
    data = encode_height_std(HeightStd(MapGrid(1.0, 2.0, 0.1, 20, 30), std_m))
    holds = products.save(sent("height_std", data), tmp_path / "s.npz")
    with np.load(tmp_path / "s.npz") as arrays:
        assert np.isnan(arrays["height_std_m"][0]).all() and (arrays["x0_m"], arrays["y0_m"]) == (1.0, 2.0)
        assert arrays["height_std_m"][5, 5] == pytest.approx(0.004, rel=0.19)
    assert "570 of 30 x 20 cells" in holds and "4.0 mm" in holds


def test_the_scan_as_npz_has_its_points_on_the_floor_they_were_measured_on(tmp_path):
    holds = products.save(sent("scan", encode_scan(floor_scan())), tmp_path / "s.npz")
    with np.load(tmp_path / "s.npz") as arrays:
        points = arrays["points_m"]
        assert len(points) == LINES * BEAMS - 1 == len(arrays["line"])
        assert np.abs(points[:, 2]).max() < 0.002
        assert points[:, 1].min() > 2.3  # north of the scanner, which is 0.3 m ahead of the rover's (5, 2)
        assert points[:, 0].mean() == pytest.approx(5.0, abs=0.05)
        assert arrays["range_m"].shape == arrays["mask"].shape == (LINES, BEAMS)
        assert arrays["mask"][3, 7] == 1
    assert f"{LINES * BEAMS - 1} points of {LINES} turns in 1.0 s, taken at stop 4 from 5.00, 2.00, 0.00" in holds


def test_the_scan_as_ply_has_the_same_points(tmp_path):
    products.save(sent("scan", encode_scan(floor_scan())), tmp_path / "s.npz")
    products.save(sent("scan", encode_scan(floor_scan())), tmp_path / "s.ply")
    head, _, body = (tmp_path / "s.ply").read_bytes().partition(b"end_header\n")
    with np.load(tmp_path / "s.npz") as arrays:
        rows = np.frombuffer(body, "<f4").reshape(-1, 4)
        assert f"element vertex {len(rows)}\n".encode() in head
        assert np.array_equal(rows[:, :3], arrays["points_m"])


def test_the_decision_as_json_has_every_term_and_says_it_in_a_line(tmp_path):
    holds = products.save(sent("nsp", encode_nsp(TOLD)), tmp_path / "why.json")
    tree = json.loads((tmp_path / "why.json").read_text())
    assert tree["rejected"] == {"not free": 5837}
    assert tree["places"][0]["gain_term"] == 1.0
    assert tree["places"][0]["cost_m"] is None  # no number in JSON says infinity
    assert holds.startswith("decision at stop 2: R10 drive to 4.00, 2.50, heading 90 degrees: it shrinks; 34163 places")


def test_any_product_can_be_kept_as_it_was_sent(tmp_path):
    for name in ("ldem", "scan", "nsp", "record", "fences"):
        product = Product(1, name, "x", b"any bytes")
        assert products.save(product, tmp_path / "p.bin") == "as it was sent"
        assert (tmp_path / "p.bin").read_bytes() == b"any bytes"


@pytest.mark.parametrize("name", [
    "ldem.npz", "scan.ply", "scan.npz", "nsp.json", "record.mcap", "height_std.npz",
])  # fmt: skip
def test_bytes_that_are_no_product_are_an_error_and_write_no_file(tmp_path, name):
    with pytest.raises((WireError, ValueError)):
        products.save(sent(name.partition(".")[0], b"cheese" * 40), tmp_path / name)
    assert not (tmp_path / name).exists()


@pytest.mark.parametrize(("argv", "part"), [
    (["scan", "--out", "s.npy"], "scan is written as .npz, .ply, .bin"),
    (["nsp", "--out", "why.npz"], "nsp is written as .json, .bin"),
    (["record", "ten"], "`from_s` should be a number, found `ten`"),
    (["record", "1", "2", "thin"], "should be one of all, slim"),
    (["cheese"], "should be one of ldem, scan, nsp, record"),
])  # fmt: skip
def test_a_wrong_get_is_one_line_before_anything_is_asked(capsys, argv, part):
    assert run(["get", *argv]) == 64
    told = capsys.readouterr().err
    assert part in told and told.count("\n") == 1
