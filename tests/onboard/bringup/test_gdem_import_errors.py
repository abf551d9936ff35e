"""`onboard gdem import` says of a bad file what is wrong, where, and what to do: one line, and an exit code."""

import subprocess
import sys

import numpy as np
import pytest
import rasterio
from rasterio import Affine

from tests.onboard.elevation_files import HOLE, UTM, geotiff, run


def picture(path):
    return geotiff(path, np.zeros((3, 4, 4)))


def cut(path):
    with rasterio.open(path, "w", "GTiff", 500, 500, 1, dtype="float32", **UTM) as file:  # its directory comes first
        file.write(np.arange(250_000, dtype=np.float32).reshape(1, 500, 500))
    path.write_bytes(path.read_bytes()[:300_000])
    return path


def cut_npy(path):
    np.save(path, np.zeros((50, 50)))
    path.write_bytes(path.read_bytes()[:-8])
    return path


def written(path, data):
    path.write_bytes(data)
    return path


def saved(path, array):
    np.save(path, array)
    return path


FLAT = np.full((20, 20), 5.0)
ROTATED = Affine(80, 9, 0, 9, -80, 0)
WORLD = {"crs": "EPSG:4326", "transform": Affine(18, 0, -180, 0, -9, 90)}
BAD = {
    "empty": (lambda p: written(p / "a.tif", b""), (), "is empty"),
    "text": (lambda p: written(p / "a.tif", b"no heights here"), (), "is no whole elevation file"),
    "text as npy": (lambda p: written(p / "a.npy", b"no heights here"), (), "is no whole .npy file"),
    "npy cut short": (lambda p: cut_npy(p / "a.npy"), (), "is no whole .npy file"),
    "npy of texts": (lambda p: saved(p / "a.npy", np.array([["a"]])), (), "heights are numbers"),
    "npy of three axes": (lambda p: saved(p / "a.npy", np.zeros((2, 2, 2))), (), "rows and columns"),
    "npy without cells": (lambda p: saved(p / "a.npy", FLAT), (), "--source-cell"),
    "asc without rows": (lambda p: written(p / "a.asc", b"ncols 4\nnrows 4\n"), (), "is no whole elevation file"),
    "asc cut short": (
        lambda p: written(p / "a.asc", b"ncols 9\nnrows 9\nxllcorner 0\nyllcorner 0\ncellsize 80\n1 2 3\n"),
        (), "is cut short or damaged at rows",
    ),
    "three bands": (lambda p: picture(p / "a.tif"), (), "has 3 bands; choose with --band, 1 to 3"),
    "no such band": (lambda p: picture(p / "a.tif"), ("--band", 4), "has 3 bands; choose"),
    "complex": (lambda p: geotiff(p / "a.tif", FLAT, dtype="complex64", nodata=None), (), "plain numbers"),
    "cut short": (lambda p: cut(p / "a.tif"), (), "is cut short or damaged at rows"),
    "all no data": (lambda p: geotiff(p / "a.tif", np.full((20, 20), HOLE)), (), "has no data within the 500 m"),
    "start outside": (lambda p: geotiff(p / "a.tif", FLAT), ("--start-xy", 0, 0), "the start at 0 0: its x"),
    "row outside": (lambda p: geotiff(p / "a.tif", FLAT), ("--start-rowcol", -3, 0), "does not hold the start"),
    "other side": (lambda p: geotiff(p / "a.tif", FLAT), ("--start-lonlat", 100, -40), "does not hold the start"),
    "rotated": (lambda p: geotiff(p / "a.tif", FLAT, transform=ROTATED), (), "rotated"),
    "no place": (lambda p: geotiff(p / "a.tif", FLAT, transform=Affine.identity()), (), "--source-cell"),
    "unknown unit": (lambda p: geotiff(p / "a.tif", FLAT, unit="fathom"), (), "'fathom', which is no known unit"),
    "unknown projection": (lambda p: geotiff(p / "a.tif", FLAT), ("--crs", "EPSG:nowhere"), "'EPSG:nowhere'"),
    "lonlat of nowhere": (
        lambda p: saved(p / "a.npy", FLAT), ("--source-cell", 80, "--start-lonlat", 1, 2), "names no projection",
    ),
    "pole in degrees": (lambda p: geotiff(p / "a.tif", FLAT, **WORLD), ("--start-lonlat", 7, 89.999), "has a pole"),
    "too many cells": (lambda p: geotiff(p / "a.tif", FLAT), ("--size", 60_000), "6000 cells a side, of 5000 at most"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_gets_one_line_that_names_it_and_exit_code_65(tmp_path, case):
    make, options, said = BAD[case]
    path, out = make(tmp_path), tmp_path / "gdem.npz"
    result = run(path, "--out", out, *options)
    assert (result.exit_code, type(result.exception)) == (65, SystemExit)
    assert result.stdout == "" and result.stderr.startswith(f"onboard: {path} ") and result.stderr.count("\n") == 1
    assert said in result.stderr and not out.exists()


def test_a_damaged_file_says_nothing_else_in_a_process_of_its_own(tmp_path):
    """GDAL has its own ways to standard error; none of them is open."""
    words = [str(cut(tmp_path / "a.tif")), "--out", str(tmp_path / "gdem.npz")]
    done = subprocess.run([sys.executable, "-m", "onboard", "gdem", "import", *words], capture_output=True, text=True)
    assert done.returncode == 65 and done.stderr.count("\n") == 1 and done.stdout == ""


@pytest.mark.parametrize("crs", ["EPSG:999999", "+proj=bogus"])
def test_a_projection_nobody_knows_lets_proj_say_nothing_else(tmp_path, crs):
    words = [str(geotiff(tmp_path / "a.tif", FLAT)), "--crs", crs, "--out", str(tmp_path / "gdem.npz")]
    done = subprocess.run([sys.executable, "-m", "onboard", "gdem", "import", *words], capture_output=True, text=True)
    assert done.returncode == 65 and done.stderr.count("\n") == 1 and f"{crs!r}" in done.stderr


def test_no_file_a_folder_and_no_place_to_write_have_their_own_codes(tmp_path):
    path = geotiff(tmp_path / "utm.tif", FLAT)
    for words, code, said in (
        ((tmp_path / "none.tif",), 66, "No such file"),
        ((tmp_path,), 66, "Is a directory"),
        ((path, "--out", tmp_path / "none" / "gdem.npz"), 73, "cannot be written"),
        ((path, "--out", tmp_path / "gdem.tif"), 64, "the map is an .npz; name it"),
        ((path, "--start-xy", 0, 0, "--start-rowcol", 0, 0), 64, "--start-xy and --start-rowcol; name it once"),
    ):
        result = run(*words)
        assert result.exit_code == code and said in result.stderr and result.stderr.count("\n") == 1


def test_the_flight_program_never_loads_rasterio():
    code = "import sys, onboard.__main__, onboard.app; assert 'rasterio' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def doubts(path, *options):
    result = run(path, "--out", path.with_name("gdem.npz"), *options)
    assert result.exit_code == 0, result.stderr
    return result.stderr.splitlines()


def test_a_value_for_no_data_that_nobody_named_gets_a_warning_until_it_is_named(tmp_path):
    heights = np.full((50, 50), 5.0, np.float32)
    heights[3, 3] = -9999
    path, size = saved(tmp_path / "a.npy", heights), ("--source-cell", 2, "--size", 100)
    (line,) = doubts(path, *size)
    assert line.startswith("onboard: warning: heights from -9999 to 5 m within 100 m; ") and "--nodata -9999" in line
    assert doubts(path, *size, "--nodata", -9999) == []
    with np.load(tmp_path / "gdem.npz") as made:
        assert np.nanmin(made["heights_m"]) == np.nanmax(made["heights_m"]) == 0.0


def test_a_value_for_no_data_is_compared_before_the_unit_and_beside_the_files_own(tmp_path):
    heights = np.full((20, 20), 5.0)
    heights[:, 0], heights[:, -1] = -9999, HOLE
    path = geotiff(tmp_path / "a.tif", heights, unit="cm")
    assert doubts(path, "--size", 1600, "--cell", 80, "--nodata", -9999) == []
    with np.load(tmp_path / "gdem.npz") as made:
        absent = np.isnan(made["heights_m"])
    assert absent[:, [0, -1]].all() and not absent[:, 1:-1].any()


def test_a_map_that_reaches_beyond_the_file_and_a_raised_size_get_a_line_each(tmp_path):
    path = geotiff(tmp_path / "a.tif", FLAT)  # 1600 m a side
    (line,) = doubts(path, "--size", 3200, "--cell", 80)
    assert line == "onboard: warning: the map of 3200 m reaches beyond the file; 75.0 % of its cells are unknown"
    (line,) = doubts(path, "--size", 100, "--cell", 80)
    assert line.startswith("onboard: warning: --size 100 was raised to 160 m")
    assert doubts(path, "--size", 1600, "--cell", 80) == []
