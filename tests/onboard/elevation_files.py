"""Elevation files for the tests of `onboard gdem import`: matplotlib's measured sample, and GeoTIFFs of any heights."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import rasterio
from click.testing import CliRunner
from rasterio import Affine

from onboard.__main__ import app
from onboard.app import load_gdem

SAMPLE = Path("mpl-data") / "sample_data" / "jacksboro_fault_dem.npz"
UTM = {"crs": "EPSG:32616", "transform": Affine(80, 0, 740_000, 0, -80, 4_040_000)}
HOLE = -32768


def measured():
    """Heights (344, 403) float64, row 0 in the north, and the borders west, south, east, north in degrees."""
    with np.load(Path(importlib.util.find_spec("matplotlib").origin).parent / SAMPLE) as file:
        borders = float(file["xmin"]), float(file["ymax"]), float(file["xmax"]), float(file["ymin"])
        return file["elevation"].astype(np.float64), borders


def geotiff(path, heights, dtype="int16", scale=1.0, offset=0.0, unit="", **profile):
    bands = np.atleast_3d(heights).transpose(2, 0, 1) if heights.ndim == 2 else heights
    count, rows, columns = bands.shape
    profile = {**UTM, "nodata": HOLE, **profile}
    with rasterio.open(path, "w", "GTiff", columns, rows, count, dtype=dtype, **profile) as file:
        file.write(bands.astype(dtype))
        file.scales, file.offsets, file.units = [scale] * count, [offset] * count, [unit] * count
    return path


def run(*words):
    return CliRunner().invoke(app, ["gdem", "import", *map(str, words)])


def imported(path, *options):
    """The map that the flight program loads, heights as in the file again, and the summary."""
    out = path.with_name("gdem.npz")
    result = run(path, "--out", out, "--json", *options)
    assert result.exit_code == 0, result.stderr
    told = json.loads(result.stdout)
    gdem = load_gdem(str(out))
    return gdem, gdem.heights_m.astype(np.float64) + told["start_height_m"], told
