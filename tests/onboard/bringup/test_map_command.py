"""`onboard map`: what other tools read of the kept map is what the map says; what is wrong is one line."""

from __future__ import annotations

import json
import os
import re
import warnings

import numpy as np
import pytest
import rasterio
from click.testing import CliRunner

from onboard.__main__ import app
from onboard.bringup.maps.map_export import FORMATS, shade
from onboard.config import Mapping_
from onboard.drivers.storage.map_tiles import save
from onboard.maps.gdem_file import from_npz
from onboard.perception.map import ldem as maps
from onboard.perception.map import tiles
from onboard.perception.map.cell_classes import classify
from onboard.perception.map.height_spread import height_std_m
from onboard.records import CellClass

ROWS, COLUMNS = 30, 40
WEST_M, SOUTH_M = -1.0, 2.0  # corner of the part that was seen
POINT = np.dtype([("x", "<f8"), ("y", "<f8"), ("z", "<f4"), ("cell_class", "u1"), ("height_std", "<f4")])
SPREAD_M = 0.02  # of the four hits of each cell


def onboard(*arguments):
    return CliRunner().invoke(app, ["map", *map(str, arguments)])


def hill():
    """A map of 4 x 3 m over the border of two tiles: a slope that rises to the east, and a spot nobody saw."""
    made = maps.empty(maps.lattice_grid(20, -10, ROWS, COLUMNS, 0.1))
    made.n[...] = 4
    made.n[10:20, 10:20] = 0
    made.sum_z[...] = np.where(made.n, 4 * 0.05 * np.arange(COLUMNS), 0.0)
    made.sum_z2[...] = np.where(made.n, made.sum_z**2 / 4 + 4 * SPREAD_M**2, 0.0)
    heights = np.where(made.n, made.sum_z / 4, np.nan).astype(np.float32)
    made.z_hi[...], made.z_lo[...] = heights, heights
    made.view_m[...] = 1.0
    return made


def north_first(path):
    """The bands of a picture as they stand in the file."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        with rasterio.open(path) as file:
            return file.read()


@pytest.fixture(scope="module")
def surface():
    return classify(hill(), Mapping_())


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("map")
    for tile in tiles.cut(hill(), np.array([[1.0, 3.0, 0.0]])):
        save(made, tile)
    return made


def exported(folder, out, *options):
    result = onboard("export", folder, "--out", out, *options)
    assert result.exit_code == 0, result.stderr
    return result.stdout


def test_a_geotiff_has_heights_and_classes_in_their_places(folder, surface, tmp_path):
    exported(folder, tmp_path / "map.tif")
    with rasterio.open(tmp_path / "map.tif") as file:
        assert (file.width, file.height, file.dtypes) == (COLUMNS, ROWS, ("float32",) * 3)
        assert file.descriptions == ("height", "class", "height_std") and np.isnan(file.nodata)
        assert tuple(file.bounds) == pytest.approx((WEST_M, SOUTH_M, WEST_M + 4.0, SOUTH_M + 3.0))
        assert file.crs.to_wkt().startswith("LOCAL_CS[") and 'UNIT["metre",1' in file.crs.to_wkt()
        np.testing.assert_array_equal(file.read(1)[::-1], surface.z_mean)
        np.testing.assert_array_equal(np.nan_to_num(file.read(2)[::-1]), surface.cell_class)
        hit = hill().n > 0
        np.testing.assert_allclose(file.read(3)[::-1][hit], SPREAD_M, rtol=1e-5)
        assert np.isnan(file.read(3)[::-1][~hit]).all()
        (height,) = next(file.sample([(2.95, 2.05)], indexes=1))
        assert height == np.float32(0.05 * 39)


def test_a_geotiff_of_the_map_can_be_imported_as_an_orbiters_map(folder, tmp_path):
    exported(folder, tmp_path / "map.tif")
    result = CliRunner().invoke(
        app,
        [
            "gdem",
            "import",
            str(tmp_path / "map.tif"),
            "--band",
            "1",
            "--size",
            "2",
            "--cell",
            "1",
            "--start-xy",
            "1.5",
            "3.5",
            "--out",
            str(tmp_path / "gdem.npz"),
        ],
    )
    assert result.exit_code == 0, result.stderr


def test_an_npy_holds_the_heights_and_the_summary_tells_where_they_lie(folder, surface, tmp_path):
    told = json.loads(exported(folder, tmp_path / "heights", "--format", "npy", "--json"))
    np.testing.assert_array_equal(np.load(tmp_path / "heights"), surface.z_mean)
    assert (told["rows"], told["columns"], told["cell_m"], told["tiles"]) == (ROWS, COLUMNS, 0.1, 2)
    assert (told["x0_m"], told["y0_m"]) == pytest.approx((WEST_M + 0.05, SOUTH_M + 0.05))


def test_an_npz_is_an_orbiters_map_with_classes_beside(folder, surface, tmp_path):
    exported(folder, tmp_path / "map.npz")
    gdem = from_npz((tmp_path / "map.npz").read_bytes())
    assert (gdem.grid.x0_m, gdem.grid.y0_m) == pytest.approx((surface.grid.x0_m, surface.grid.y0_m))
    np.testing.assert_array_equal(gdem.heights_m, surface.z_mean)
    np.testing.assert_array_equal(np.load(tmp_path / "map.npz")["cell_class"], surface.cell_class)
    np.testing.assert_array_equal(np.load(tmp_path / "map.npz")["height_std_m"], height_std_m(hill()))


def test_a_ply_is_the_cloud_of_the_centres_of_known_cells(folder, surface, tmp_path):
    exported(folder, tmp_path / "map.ply")
    head, _, body = (tmp_path / "map.ply").read_bytes().partition(b"end_header\n")
    words = head.decode("ascii").split("\n")
    assert words[:2] == ["ply", "format binary_little_endian 1.0"]
    assert [line.split()[1:] for line in words if line.startswith("property")] == [
        ["double", "x"],
        ["double", "y"],
        ["float", "z"],
        ["uchar", "cell_class"],
        ["float", "height_std"],
    ]
    known = int(np.isfinite(surface.z_mean).sum())
    assert f"element vertex {known}" in words and len(body) == known * POINT.itemsize
    points = np.frombuffer(body, POINT)
    j, i = np.round((points["y"] - SOUTH_M - 0.05) / 0.1), np.round((points["x"] - WEST_M - 0.05) / 0.1)
    assert len(set(zip(j, i))) == known
    np.testing.assert_array_equal(points["z"], surface.z_mean[j.astype(int), i.astype(int)])
    assert set(points["cell_class"]) == {CellClass.HIT}


def test_a_png_is_a_shaded_picture_that_is_clear_where_nothing_is_known(folder, surface, tmp_path):
    exported(folder, tmp_path / "map.PNG")
    assert [path.name for path in tmp_path.iterdir()] == ["map.PNG"]
    grey, alpha = north_first(tmp_path / "map.PNG")
    np.testing.assert_array_equal(alpha[::-1] == 255, np.isfinite(surface.z_mean))
    assert set(np.unique(alpha)) == {0, 255}
    east_side_away = grey[alpha == 255]
    assert (east_side_away == east_side_away[0]).all()  # one slope, one shade


def test_the_sun_stands_in_the_north_west():
    y, x = np.mgrid[0:9, 0:9].astype(np.float32)
    flat, to_sun, away = (shade(slope.astype(np.float32), 1.0)[4, 4] for slope in (0 * x, 0.3 * (x - y), 0.3 * (y - x)))
    assert away < flat < to_sun
    assert flat == round(255 * np.sin(np.deg2rad(40.0)))


def test_the_record_of_a_run_and_its_folder_give_the_same_file(folder, tmp_path):
    from onboard.config import load
    from onboard.perception.map.stop_map import StopMap
    from onboard.record.writer import Recorder

    record = tmp_path / "onboard.mcap"
    with Recorder(load(None, {"record.path": str(record)}), None) as recorder:
        recorder.end(StopMap(hill(), np.empty((0, 3))))
    for name, source in (("a.ply", record), ("b.ply", folder)):
        exported(source, tmp_path / name)
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()


def test_info_lists_tiles_with_place_size_and_age_and_what_was_dropped(folder, tmp_path):
    for path in folder.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
        os.utime(tmp_path / path.name, (0, 0))
    (tmp_path / "x+0007_y+0000.tile").write_bytes(b"")
    told = json.loads(onboard("info", tmp_path, "--json").stdout)
    assert [(row["x_m"], row["y_m"], row["points"]) for row in told["tiles"]] == [(0.0, 0.0, 1), (-10.0, 0.0, 0)]
    assert told["tiles"][0]["hit_ratio"] == pytest.approx(0.08)
    assert told["tiles"][0]["bytes"] == (tmp_path / "x+0000_y+0000.tile").stat().st_size
    assert told["tiles"][0]["age_s"] > 1e9
    assert told["dropped"] == [f"{tmp_path / 'x+0007_y+0000.tile'} is empty: torn off while it was written"]
    text = onboard("info", tmp_path).stdout
    assert re.search(r"x-0001_y\+0000.tile +-10 +0 +3 % +0 +\d+ +\d+ d", text), text
    assert "dropped: " in text and f"{tmp_path}: 2 tiles, 0.00 MB" in text


def complaint(result, code):
    assert result.exit_code == code and "Traceback" not in result.stderr
    return result.stderr


def test_a_folder_that_is_not_there_exits_66(tmp_path):
    for command in (["info", tmp_path / "no"], ["export", tmp_path / "no", "--out", tmp_path / "a.tif"]):
        said = complaint(onboard(*command), 66)
        assert said == f"onboard: {tmp_path / 'no'} cannot be read: No such file or directory\n"


def test_a_folder_without_a_tile_exits_65(tmp_path):
    told = onboard("info", tmp_path)
    assert "holds no map tile that can be used" in complaint(told, 65) and told.stdout == ""
    assert "holds no map to export: no tiles" in complaint(onboard("export", tmp_path, "-o", tmp_path / "a.tif"), 65)


def test_info_of_a_record_names_the_command_for_it_and_exits_66(tmp_path):
    record = tmp_path / "onboard.mcap"
    record.write_bytes(b"")
    said = complaint(onboard("info", record), 66)
    assert f"`onboard map export {record} --out site.tif`" in said and said.count("\n") == 1


def test_a_map_without_a_height_exits_65(tmp_path):
    made = maps.empty(tiles.tile_grid(0, 0, 0.1))
    made.z_ray[...] = 1.0
    save(tmp_path, next(tiles.cut(made, np.empty((0, 3)))))
    assert "no cell has a height" in complaint(onboard("export", tmp_path, "-o", tmp_path / "a.tif"), 65)


def test_a_file_that_is_no_record_exits_65(tmp_path):
    (tmp_path / "file").write_text("no record")
    assert "is no record of a run" in complaint(onboard("export", tmp_path / "file", "-o", tmp_path / "a.tif"), 65)


@pytest.mark.parametrize(("name", "options"), [("map.jpg", ()), ("map", ()), ("map.tif", ("--format", "tiff"))])
def test_a_format_nobody_knows_exits_64_and_names_those_that_are_known(folder, tmp_path, name, options):
    said = complaint(onboard("export", folder, "--out", tmp_path / name, *options), 64)
    assert "geotiff, npy, npz, ply, png" in said and not list(tmp_path.iterdir())


@pytest.mark.parametrize("form", FORMATS)
def test_a_place_that_cannot_be_written_exits_73(folder, tmp_path, form):
    said = complaint(onboard("export", folder, "--format", form, "--out", tmp_path / "no" / "map"), 73)
    assert f"{tmp_path / 'no' / 'map'} cannot be written" in said
