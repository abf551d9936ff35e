"""A damaged orbiter's map is refused in one line, bounded in memory; what is no height is unknown ground."""

import io
import os
import struct
import subprocess
import sys
import zipfile
import zlib

import numpy as np
import pytest

from onboard.maps.gdem_file import from_npz, to_npz
from onboard.records import Gdem, Grid

SOUND = Gdem(Grid(-5.0, -5.0, 10.0, 2, 3), np.arange(6, dtype=np.float32).reshape(2, 3), "made")


def npz(**changed):
    rows = {"heights_m": SOUND.heights_m, "x0_m": -5.0, "y0_m": -5.0, "cell_m": 10.0, "note": "made"} | changed
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **{name: row for name, row in rows.items() if row is not None})
    return buffer.getvalue()


def header(shape, descr="<f4"):
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"descr": descr, "fortran_order": False, "shape": shape})
    return buffer.getvalue()


def with_heights(data, size=None):
    """A sound map but for the bytes of its heights. size: that the zip's directory tells of them."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(npz())) as sound, zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as made:
        for name in sound.namelist():
            made.writestr(name, data if name == "heights_m.npy" else sound.read(name))
        if size is not None:
            made.getinfo("heights_m.npy").file_size = size
    return buffer.getvalue()


DAMAGED = {
    "empty": b"",
    "no zip": b"heights",
    "torn": npz()[:200],
    "one flipped byte": npz()[:80] + bytes([npz()[80] ^ 0xFF]) + npz()[81:],
    "without heights": npz(heights_m=None),
    "without a note": npz(note=None),
    "one row of heights": npz(heights_m=np.zeros((1, 3), np.float32)),
    "flat list of heights": npz(heights_m=np.zeros(6, np.float32)),
    "three axes": npz(heights_m=np.zeros((2, 2, 2), np.float32)),
    "texts": npz(heights_m=np.array([["a", "b"], ["c", "d"]])),
    "objects": npz(heights_m=np.array([[{}, 1], [2, 3]], dtype=object)),
    "complex numbers": npz(heights_m=np.zeros((2, 2), np.complex64)),
    "no known height": npz(heights_m=np.full((2, 2), np.nan, np.float32)),
    "too many rows": npz(heights_m=np.zeros((5001, 2), np.float32)),
    "cell of NaN": npz(cell_m=float("nan")),
    "cell of nothing": npz(cell_m=0.0),
    "cell below nothing": npz(cell_m=-10.0),
    "endless cell": npz(cell_m=float("inf")),
    "place NaN": npz(x0_m=float("nan")),
    "place out of the world": npz(y0_m=1e300),
    "cell is a list": npz(cell_m=[10.0, 10.0]),
    "cell is a text": npz(cell_m="10"),
    "long note": npz(note="a" * 100_000),
    "header of a huge array": with_heights(header((10**6, 10**6))),
    "header with an endless axis": with_heights(header((10**30, 2))),
    "negative axis": with_heights(header((-1, -6)) + bytes(24)),
    "fewer heights than told": with_heights(header((2, 3)) + bytes(20)),
    "more heights than told": with_heights(header((2, 3)) + bytes(28)),
    "header of brackets": with_heights(b"\x93NUMPY\x01\x00" + (9000).to_bytes(2, "little") + b"(" * 9000),
    "record of fields": with_heights(header((2, 3), "[('a', '<f4')]")),
    "directory lies about the size": with_heights(header((2, 3)) + bytes(24), 10),
}


@pytest.mark.parametrize("case", DAMAGED)
def test_a_damaged_map_is_refused_with_one_line(case):
    with pytest.raises(ValueError) as raised:
        from_npz(DAMAGED[case])
    assert "\n" not in str(raised.value) and 0 < len(str(raised.value)) < 300


@pytest.mark.parametrize("odd", [np.nan, np.inf, -np.inf, 1e30])
def test_what_is_no_height_is_unknown_ground(odd):
    heights = SOUND.heights_m.copy()
    heights[1, 2] = odd
    found = from_npz(npz(heights_m=heights)).heights_m
    assert np.isnan(found[1, 2]) and np.isfinite(found).sum() == 5


def test_a_sound_map_comes_back_as_it_was_and_in_other_kinds_of_numbers():
    found = from_npz(to_npz(SOUND))
    assert found.grid == SOUND.grid and found.note == "made" and np.array_equal(found.heights_m, SOUND.heights_m)
    for kind in (np.float64, np.int16, ">f4"):
        assert np.array_equal(from_npz(npz(heights_m=SOUND.heights_m.astype(kind))).heights_m, SOUND.heights_m)
    assert np.array_equal(from_npz(npz(heights_m=np.asfortranarray(SOUND.heights_m))).heights_m, SOUND.heights_m)


def bomb(path):
    """3 GB of zeros in 3 MB, as the heights: one compressed block, 3000 times."""
    deflate = zlib.compressobj(wbits=-zlib.MAX_WBITS)
    begin = deflate.compress(header((28_000, 28_000))) + deflate.flush(zlib.Z_FULL_FLUSH)
    block = deflate.compress(bytes(1 << 20)) + deflate.flush(zlib.Z_FULL_FLUSH)
    assert len(zlib.decompress(begin + 2 * block + deflate.flush(), wbits=-zlib.MAX_WBITS)) > 2 << 20
    with zipfile.ZipFile(path, "w") as made:
        made.writestr("heights_m.npy", begin + 3000 * block)
        member = made.getinfo("heights_m.npy")  # the directory is written at the end
        member.compress_type, member.file_size = zipfile.ZIP_DEFLATED, len(header((28_000, 28_000))) + (3000 << 20)


def crowd(path):
    """A zip of 200,000 members without a byte."""
    buffer, rows = io.BytesIO(), 200_000
    with zipfile.ZipFile(buffer, "w") as made:
        made.writestr("a", b"")
    one = buffer.getvalue()
    row = one[one.index(b"PK\x01\x02") : one.index(b"PK\x05\x06")]
    path.write_bytes(row * rows + struct.pack("<4s4H2LH", b"PK\x05\x06", 0, 0, 0, 0, rows * len(row), 0, 0))


def test_a_zip_of_very_many_members_is_refused_before_its_directory_is_read(tmp_path, monkeypatch):
    crowd(tmp_path / "gdem.npz")
    with zipfile.ZipFile(tmp_path / "gdem.npz") as file:
        assert len(file.infolist()) == 200_000
    monkeypatch.setattr(zipfile, "ZipInfo", None)  # one is made for each member
    with pytest.raises(ValueError, match="members"):
        from_npz((tmp_path / "gdem.npz").read_bytes())


READ = """
import resource, sys
from onboard.app import load_gdem
limit = 300 << 20
held = int(next(line for line in open("/proc/self/status") if line.startswith("VmSize")).split()[1]) << 10
resource.setrlimit(resource.RLIMIT_AS, (held + limit, held + limit))
try:
    load_gdem(sys.argv[1])
except (ValueError, RuntimeError) as error:
    print(error)
"""


@pytest.mark.parametrize("kind", ["bomb", "device", "pipe", "large"])
def test_a_map_that_would_fill_the_memory_or_never_end_is_refused_before_it_is_read(tmp_path, kind):
    path = tmp_path / "gdem.npz"
    if kind == "bomb":
        bomb(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "pipe":
        os.mkfifo(path)
    else:
        with path.open("wb") as file:
            file.truncate(10 << 30)
    done = subprocess.run([sys.executable, "-c", READ, str(path)], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert str(path) in done.stdout and done.stdout.count("\n") == 1


RUN = ("run", "--set", "clock.mode=wall", "--set", "status.socket=off", "--set", "can.uri=virtual:a", "--set",
       "link.endpoint=tcp/127.0.0.1:1", "--set", "link.bench_seed=1", "--set", "lidar.address=nothing:")  # fmt: skip


def onboard(*words):
    """The flight program; where it gets past its map, the scanner's address ends it with 78."""
    command = [sys.executable, "-m", "onboard", *RUN, *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


@pytest.mark.parametrize(("data", "code"), [(b"damaged", 65), (None, 66)])
def test_it_does_not_fly_without_the_map_that_it_was_told_to_have(tmp_path, data, code):
    path = tmp_path / "gdem.npz"
    if data is not None:
        path.write_bytes(data)
    done = onboard("--set", f"mission.gdem={path}")
    assert done.returncode == code and str(path) in done.stderr
    assert done.stderr.count("\n") == 1 and "mission.gdem_needed" in done.stderr


def test_it_flies_without_a_damaged_map_where_the_configuration_says_so(tmp_path):
    path = tmp_path / "gdem.npz"
    path.write_bytes(b"damaged")
    done = onboard("--set", f"mission.gdem={path}", "--set", "mission.gdem_needed=false")
    first, *_, last = done.stderr.splitlines()
    assert str(path) in first and "flies without" in first
    assert done.returncode == 78 and "lidar.address" in last


def test_no_start_mends_a_damaged_map_so_the_service_is_not_started_anew():
    from pathlib import Path

    unit = (Path(__file__).parents[3] / "tools/installation/service/el-dorado.service").read_text()
    row = next(line for line in unit.splitlines() if line.startswith("RestartPreventExitStatus="))
    assert "65" in row.split("=")[1].split()
