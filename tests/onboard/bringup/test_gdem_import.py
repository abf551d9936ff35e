"""`onboard gdem import`: measured ground, written as every kind of file, comes back as the map of a mission.

The ground is matplotlib's sample, the Jacksboro fault: 344 x 403 heights of 236 to 951 m. Oracles are block means and
scipy's linear interpolation, in coordinates worked out beside GDAL.
"""

import json
import subprocess
import sys

import numpy as np
import pytest
import rasterio
from rasterio import Affine
from scipy import ndimage

from onboard.bringup.maps import gdem_resample
from tests.onboard.elevation_files import HOLE, UTM, geotiff, imported, measured, run

MOON_M = 1_737_400.0


@pytest.fixture(scope="module")
def sample():
    return measured()


def linear(heights, rows, columns):
    """Plain bilinear interpolation at fractional rows and columns of cell centres."""
    return ndimage.map_coordinates(heights, np.meshgrid(rows, columns, indexing="ij"), order=1)


def north_up(heights, half, row, column):
    """The cells of the file up to `half` from a corner of cells, row 0 in the south as maps have it."""
    return heights[row - half : row + half, column - half : column + half][::-1]


# -- round trips -----------------------------------------------------------------------------------------------


def test_cells_of_the_same_size_come_back_as_they_are_around_the_start_in_place_and_height(tmp_path, sample):
    heights, _ = sample
    path = geotiff(tmp_path / "utm.tif", heights)
    gdem, back, told = imported(path, "--start-rowcol", 100, 200, "--size", 1600, "--cell", 80)
    np.testing.assert_allclose(back, north_up(heights, 10, 100, 200), atol=1e-4)
    grid = gdem.grid
    assert (grid.x0_m, grid.y0_m, grid.cell_m, grid.rows, grid.columns) == (-760.0, -760.0, 80.0, 20, 20)
    assert told["start_xy"] == [740_000 + 200 * 80, 4_040_000 - 100 * 80]
    assert gdem.heights_m[9:11, 9:11].mean() == pytest.approx(0.0, abs=1e-4)
    assert told["start_height_m"] == pytest.approx(heights[99:101, 199:201].mean())


def test_larger_cells_are_the_mean_of_the_area_also_where_borders_do_not_meet(tmp_path, sample):
    heights, _ = sample
    path = geotiff(tmp_path / "utm.tif", heights)
    _, back, _ = imported(path, "--start-rowcol", 100, 200, "--size", 4800, "--cell", 120)
    halves = heights.repeat(2, 0).repeat(2, 1)  # cells of 40 m: three of them are 120 m
    blocks = north_up(halves, 60, 200, 400).reshape(40, 3, 40, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(back, blocks, atol=1e-4)


def test_smaller_cells_are_interpolated_between_four_centres(tmp_path, sample):
    heights, _ = sample
    path = geotiff(tmp_path / "utm.tif", heights)
    _, back, told = imported(path, "--start-xy", 756_000, 4_032_000)
    at_m = (np.arange(50) - 24.5) * 10.0
    oracle = linear(heights, 100 - at_m / 80 - 0.5, 200 + at_m / 80 - 0.5)
    np.testing.assert_allclose(back, oracle, atol=1e-3)
    assert told["source_cell_m"] == pytest.approx(80.0)


@pytest.mark.parametrize("turns_deg", [0.0, 360.0])
def test_degrees_become_metres_on_the_files_own_ball(tmp_path, sample, turns_deg):
    """The oracle is the azimuthal equidistant projection of a sphere of the Moon's radius (Snyder 1987, 20-14)."""
    heights, (west, south, east, north) = sample
    transform = rasterio.transform.from_bounds(west + turns_deg, south, east + turns_deg, north, 403, 344)
    path = geotiff(tmp_path / "deg.tif", heights, crs=f"+proj=longlat +R={MOON_M} +no_defs", transform=transform)
    _, back, told = imported(path, "--start-lonlat", -84.25, 36.6)
    assert f"+R={MOON_M}" in told["projection"] and "azimuthal equidistant" in told["projection"]
    at_m = (np.arange(50) - 24.5) * 10.0
    y, x = np.meshgrid(at_m, at_m, indexing="ij")
    away, sine, cosine = np.hypot(x, y), np.sin(np.deg2rad(36.6)), np.cos(np.deg2rad(36.6))
    c = away / MOON_M
    lat = np.rad2deg(np.arcsin(np.cos(c) * sine + y * np.sin(c) * cosine / away))
    lon = -84.25 + np.rad2deg(np.arctan2(x * np.sin(c), away * cosine * np.cos(c) - y * sine * np.sin(c)))
    rows, columns = (north - lat) / (north - south) * 344 - 0.5, (lon - west) / (east - west) * 403 - 0.5
    np.testing.assert_allclose(back, ndimage.map_coordinates(heights, (rows, columns), order=1), atol=1e-3)


@pytest.mark.parametrize("west_deg", [-180.0, 0.0])
@pytest.mark.parametrize("lon_deg", [179.999, -179.999, -90.0, 90.0])
def test_longitudes_may_be_counted_either_way(tmp_path, west_deg, lon_deg):
    """Heights are the file's column: the start lies in the one that its longitude says."""
    ramp = np.broadcast_to(np.arange(3600), (100, 3600))
    transform = rasterio.transform.from_bounds(west_deg, 0.0, west_deg + 360.0, 10.0, 3600, 100)
    path = geotiff(tmp_path / "all.tif", ramp, crs=f"+proj=longlat +R={MOON_M} +no_defs", transform=transform)
    gdem, _, told = imported(path, "--start-lonlat", lon_deg, 5.0)
    column = (lon_deg - west_deg) % 360.0 * 10
    expected = min(max(column - 0.5, 0.0), 3599.0)
    assert told["start_height_m"] == pytest.approx(expected, abs=0.1) and np.isfinite(gdem.heights_m[:, 24:26]).any()


def test_metres_that_are_none_on_the_ground_are_put_right(tmp_path, sample):
    """Mercator at 60 degrees: its metre is half a metre of ground."""
    heights, _ = sample
    mercator = f"+proj=merc +R={MOON_M} +units=m +no_defs"
    y_at_60 = MOON_M * np.log(np.tan(np.deg2rad(75)))
    transform = Affine(160, 0, 0, 0, -160, y_at_60 + 160 * 172)
    path = geotiff(tmp_path / "merc.tif", heights, crs=mercator, transform=transform)
    _, back, told = imported(path, "--start-rowcol", 172, 200)
    at_m = (np.arange(50) - 24.5) * 10.0
    np.testing.assert_allclose(back, linear(heights, 171.5 - at_m / 80, 199.5 + at_m / 80), atol=0.1)
    assert told["source_cell_m"] == pytest.approx(80.0, rel=1e-3) and told["start_xy"] == [0.0, 0.0]


def test_scale_offset_and_unit_of_the_heights_are_taken(tmp_path, sample):
    heights, _ = sample
    path = geotiff(tmp_path / "feet.tif", (heights - 500) * 4, scale=0.25, offset=500.0, unit="ft")
    _, back, _ = imported(path, "--start-rowcol", 100, 200, "--size", 800, "--cell", 80)
    np.testing.assert_allclose(back, 0.3048 * north_up(heights, 5, 100, 200), atol=1e-4)


def test_an_ascii_grid_and_an_npy_give_the_map_that_the_geotiff_gives(tmp_path, sample):
    heights, _ = sample
    words = ("--start-xy", 756_000, 4_032_000, "--size", 1000, "--cell", 20)
    south_m = 4_040_000 - 344 * 80
    expected, _, _ = imported(geotiff(tmp_path / "utm.tif", heights), *words)
    head = f"ncols 403\nnrows 344\nxllcorner 740000\nyllcorner {south_m}\ncellsize 80\nNODATA_value {HOLE}\n"
    lines = "\n".join(" ".join(map(str, row)) for row in heights.astype(int))
    (tmp_path / "site.asc").write_text(f"{head}{lines}\n")
    np.save(tmp_path / "south.npy", heights[::-1])
    np.save(tmp_path / "north.npy", heights.astype(np.float32))
    place = ("--source-cell", 80, "--source-corner", 740_000, south_m)
    for name, options in (("site.asc", ()), ("south.npy", place), ("north.npy", (*place, "--north-first"))):
        gdem, _, told = imported(tmp_path / name, *words, *options)
        np.testing.assert_allclose(gdem.heights_m, expected.heights_m, atol=1e-4)
        assert gdem.grid == expected.grid
        assert told["start_lonlat_deg"] is None and "plain metres" in gdem.note


def test_where_it_came_from_stays_with_the_map(tmp_path, sample):
    path = geotiff(tmp_path / "lunar.tif", sample[0], crs="EPSG:32616+5773")
    gdem, _, told = imported(path)
    for text in ("lunar.tif", "WGS 84 / UTM zone 16N", "EGM96 height", "no data -32768", "longitude", "80 m"):
        assert text in gdem.note
    assert told["vertical_datum"] == "EGM96 height"


# -- no data ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cell_m", [20, 80, 200])
def test_heights_never_mix_with_no_data_and_never_spread_over_it(tmp_path, cell_m):
    """Ground of 100 m in the west, holes in the east: every height is 100 m, and the border stays where it is."""
    heights = np.full((60, 60), 100.0)
    heights[:, 30:] = HOLE
    path = geotiff(tmp_path / "half.tif", heights)
    gdem, back, _ = imported(path, "--start-rowcol", 30, 30, "--size", 1600, "--cell", cell_m)
    known = np.isfinite(back)
    np.testing.assert_allclose(back[known], 100.0, atol=1e-5)
    x_m = gdem.grid.x0_m + np.arange(gdem.grid.columns) * cell_m
    assert known.all(axis=0)[x_m < 0].all() and not known[:, x_m > 0].any()


def test_holes_of_float_files_may_be_nan_and_edges_of_the_file_are_no_data(tmp_path):
    heights = np.full((20, 20), 7.5)
    heights[3, 4] = np.nan
    path = geotiff(tmp_path / "nan.tif", heights, dtype="float32", nodata=None)
    _, back, _ = imported(path, "--start-rowcol", 0, 0, "--size", 1600, "--cell", 80)
    known = np.zeros((20, 20), bool)
    known[:10, 10:] = True  # the file begins at the start and goes south and east
    known[9 - 3, 10 + 4] = False
    np.testing.assert_array_equal(np.isfinite(back), known)


# -- large files -----------------------------------------------------------------------------------------------


def test_tiles_leave_no_seam(tmp_path, sample, monkeypatch):
    path = geotiff(tmp_path / "utm.tif", sample[0], crs="EPSG:4326", transform=Affine(1e-3, 0, 10, 0, -1e-3, 50))
    words = ("--size", 12_000, "--cell", 150)
    whole, _, _ = imported(path, *words)
    monkeypatch.setattr(gdem_resample, "TILE_SIDE", 64)
    tiled, _, told = imported(path, *words)
    np.testing.assert_allclose(tiled.heights_m, whole.heights_m, atol=1e-4)
    assert told["source_cells_read"] > whole.heights_m.size


def test_of_a_file_of_3_gigabytes_only_what_lies_under_the_map_is_read(tmp_path):
    """Its tiles are not even on the disk but for those around the start; the process grows by a few megabytes."""
    path, side = tmp_path / "large.tif", 40_000
    size = {"width": side, "height": side, "count": 1, "dtype": "int16", "tiled": True, "sparse_ok": True}
    with rasterio.open(path, "w", "GTiff", blockxsize=512, blockysize=512, **size, **UTM, nodata=HOLE) as file:
        window = rasterio.windows.Window(29_900, 9_900, 200, 200)
        file.write(np.full((200, 200), 42, np.int16), 1, window=window)
    words = [str(path), "--out", str(tmp_path / "gdem.npz"), "--json", "--start-rowcol", "10000", "30000"]
    code = (
        "import resource, sys; from click.testing import CliRunner; from onboard.__main__ import app;"
        "import onboard.bringup.maps.gdem_import, rich.progress;"
        "peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss;"
        "before = peak(); result = CliRunner().invoke(app, ['gdem', 'import', *sys.argv[1:]]);"
        "print(peak() - before); print(result.stdout)"
    )
    done = subprocess.run([sys.executable, "-c", code, *words], check=True, capture_output=True, text=True)
    grown_kb, told = done.stdout.split("\n", 1)
    told = json.loads(told)
    assert told["known_ratio"] == 1.0 and told["start_height_m"] == 42.0
    assert told["source_cells_read"] < 200 and told["source_rows"] * told["source_columns"] == side**2
    assert int(grown_kb) < 64_000  # 3.2 GB would be 3,200,000


def test_the_table_for_people_tells_what_the_json_tells(tmp_path, sample):
    path = geotiff(tmp_path / "utm.tif", sample[0])
    result = run(path, "--out", tmp_path / "gdem.npz")
    assert result.exit_code == 0 and result.stderr == ""
    for text in ("50 x 50 cells of 10 m (500 m)", "344 x 403 cells of 80 m", "UTM zone 16N", "100.0 % of the cells"):
        assert text in result.stdout
