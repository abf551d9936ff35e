"""3D scans out of a run's record, as cloud, image and record, read by other people's readers."""

from __future__ import annotations

import base64
import json

import numpy as np
import pytest
from click.testing import CliRunner
from mcap.reader import make_reader

from onboard import config
from onboard.__main__ import app
from onboard.perception.scan.scan3d import points
from onboard.record.writer import Recorder
from tests.onboard.nodding import EXACT, ROVER, Nodding, latency_ns


@pytest.fixture(scope="module")
def nod(tmp_path_factory):
    """(record of a sweep down and one up, the two scans as the rig made them)"""
    path = tmp_path_factory.mktemp("run") / "onboard.mcap"
    bench = Nodding(EXACT)
    flown = config.Config(record=config.Record(path=str(path)), lidar=config.Lidar(latency_ns=latency_ns(EXACT)))
    with Recorder(flown, None) as bench.recorder:
        bench.settle(3)
        scans = bench.sweep(0, 40, 30), bench.sweep(40, 0, 30)
    return path, scans


def run(*words):
    return CliRunner().invoke(app, ["lidar", "scan", *map(str, words)])


def test_sweep_of_a_record_is_the_sweep_that_was_flown(nod, tmp_path):
    path, (down, up) = nod
    for number, flown in ((1, down), (2, up)):
        got = run(path, "--out", tmp_path / "s.npz", "--sweep", number, "--json")
        assert got.exit_code == 0, got.output
        image = np.load(tmp_path / "s.npz")
        first = int(np.flatnonzero(flown.pixels["time_ns"][:, 0] >= image["time_ns"][0, 0] - 1000)[0])
        part = flown.pixels[first : first + len(image["mask"])]
        moving = np.ptp(part["tilt_rad"], axis=1) > 1e-3
        assert moving.sum() > 45 and image["range_m"].shape == part.shape
        assert np.abs(image["time_ns"] - part["time_ns"])[moving].max() < 100_000  # a clock that began later
        assert np.array_equal(image["range_m"][moving], part["range_m"][moving])
        assert np.abs(image["tilt_rad"] - part["tilt_rad"])[moving].max() < 1e-4


def read_ply(path):
    """Any binary PLY of one element with plain properties, by its own header."""
    head, _, body = path.read_bytes().partition(b"end_header\n")
    lines = head.decode("ascii").splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    (count,) = (int(line.split()[2]) for line in lines if line.startswith("element vertex "))
    kinds = {"float": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4"}
    rows = [line.split() for line in lines if line.startswith("property ")]
    dtype = np.dtype([(name, kinds[kind]) for _, kind, name in rows])
    assert len(body) == count * dtype.itemsize
    return np.frombuffer(body, dtype)


def xyz(rows):
    return np.stack([rows["x"], rows["y"], rows["z"]], axis=1)


def test_ply_says_what_it_holds_and_holds_the_points(nod, tmp_path):
    path, _ = nod
    assert run(path, "--out", tmp_path / "s.npz").exit_code == run(path, "--out", tmp_path / "s.ply").exit_code == 0
    assert b"comment frame base_link (the rover's): metres, x ahead" in (tmp_path / "s.ply").read_bytes()
    rows = read_ply(tmp_path / "s.ply")
    read, image = xyz(rows), np.load(tmp_path / "s.npz")
    good = image["mask"] == 0
    assert np.array_equal(rows["tilt"], image["tilt_rad"][good]) and rows["time"].max() < 3.0
    np.testing.assert_allclose(np.linalg.norm(read - [0.30, 0, 0.70], axis=1), image["range_m"][good], atol=1e-5)
    assert len(read) == good.sum() > 50_000
    assert np.abs(read[:, 2]).min() < 1e-3 and read[:, 0].max() == pytest.approx(6.5, abs=0.01)  # floor, wall ahead


def test_mcap_holds_the_image_and_a_cloud_that_foxglove_shows(nod, tmp_path):
    path, _ = nod
    assert run(path, "--out", tmp_path / "s.mcap", "--sweep", 0).exit_code == 0
    with (tmp_path / "s.mcap").open("rb") as file:
        found = [(schema.name, message.data) for schema, _, message in make_reader(file).iter_messages("/cloud")]
    assert [name for name, _ in found] == ["foxglove.PointCloud"] * 2
    cloud = json.loads(found[0][1])
    assert [field["name"] for field in cloud["fields"]] == ["x", "y", "z", "intensity"] and cloud["point_stride"] == 16
    rows = np.frombuffer(base64.b64decode(cloud["data"]), "<f4").reshape(-1, 4)
    assert run(path, "--out", tmp_path / "s.ply").exit_code == 0
    read = xyz(read_ply(tmp_path / "s.ply"))
    np.testing.assert_allclose(rows[:, :3], read, atol=1e-6)
    assert (rows[:, 3] == -1).all()


def test_points_of_the_scan_are_those_of_the_rig(nod):
    _, (down, _) = nod
    made = points(down, ROVER)
    assert len(made.xyz_m) == down.valid.sum()
    assert np.array_equal(made.pixels, down.pixels[made.line, made.beam])


@pytest.mark.parametrize(("words", "code", "text"), [
    (("--out", "s.xyz"), 64, ".ply"), (("--out", "s.ply", "--sweep", "0"), 64, ".mcap"),
    (("--out", "s.ply", "--sweep", "99"), 65, "holds 2 sweeps, none is number 99"),
    (("--out", "/dev/null/s.ply"), 73, "cannot be written"),
])  # fmt: skip
def test_bad_requests_are_one_line(nod, words, code, text):
    got = run(nod[0], *words)
    assert got.exit_code == code and text in got.stderr and got.stderr.count("\n") == 1, got.output


def test_missing_and_damaged_records_are_one_line(nod, tmp_path):
    assert run(tmp_path / "none.mcap", "--out", "s.ply").exit_code == 66
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(nod[0].read_bytes()[:-200_000])
    got = run(cut, "--out", "s.ply")
    assert got.exit_code == 65 and got.stderr.count("\n") == 1
