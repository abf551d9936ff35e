"""Elevation files: GeoTIFF, ESRI ASCII grid, PDS image and .npy; and writing of rasters.

The only module that imports rasterio, so a little over 300 lines: reading, placing and writing share its projections.
GDAL below it knows 155 formats, some of which are lists of addresses that it would fetch. Only the DRIVERS named here
open a file, those that fetch are not even loaded, and readers of remote files are disabled (CLOSED). A projection is a
name or a text.

    file --open_dem--> Dem --read--> heights of a window of cells, in metres, NaN where there are none
    start --place--> Site: the projection of the map, and where the mission starts in it

The map is in the file's own projection if a metre of it is a metre of ground to 0.2 %, else in an azimuthal
equidistant one around the start, on the file's own ellipsoid (also for the Moon): +y is the projection's north.
`onboard.bringup.maps.gdem_resample` resamples the heights to the cells of the map.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
import rasterio
from rasterio import Affine
from rasterio.crs import CRS
from rasterio.errors import NotGeoreferencedWarning, RasterioError
from rasterio.warp import transform
from rasterio.windows import Window

from onboard.bringup.maps.dem_words import DemError, ellipsoid, projection_name, unit_m, vertical_datum
from onboard.records import F64, Grid
from protocol.visible import visible

TRUE_RATIO = 0.002
_MOST_WORDS = 200  # of numpy's error text
DRIVERS = ("GTiff", "AAIGrid", "PDS")
CLOSED = {
    "GDAL_SKIP": "VRT,DERIVED,GTI,HTTP,WMS,WMTS,WCS,EEDA,EEDAI,DAAS,PLMOSAIC,STACIT,STACTA,MRF,ESRIC,Zarr,GeoJSON,"
                 "GeoJSONSeq,ESRIJSON,TopoJSON",
    "CPL_VSIL_CURL_ALLOWED_FILENAME": "none",  # the only address that may be fetched
}  # fmt: skip
CRS_FORMS = re.compile(r"\s*(\w+:\w+$|\+|[A-Z][A-Z_]+\s*[\[(]|\{)", re.DOTALL)  # EPSG:number, PROJ, WKT, PROJJSON
# projection of files that name none
PLAIN = CRS.from_wkt('LOCAL_CS["no projection named",UNIT["metre",1],AXIS["x",EAST],AXIS["y",NORTH]]')


@dataclass(frozen=True, slots=True)
class Reading:
    """Settings for data that a file lacks.

    band: number of the band; 0: the only one.
    cell_m: size of a cell; 0: the file has it.
    corner: x, y of the south-west corner of a file without georeference.
    crs: any name that rasterio knows; overrides the file's.
    unit_m: metres per unit of height; 0: as the file states.
    north_first: the first row of an .npy is the north.
    nodata: a value that means "no data", in addition to the file's.
    """

    band: int = 0
    cell_m: float = 0.0
    corner: tuple[float, float] = (0.0, 0.0)
    crs: str = ""
    unit_m: float = 0.0
    north_first: bool = False
    nodata: float | None = None


@dataclass(frozen=True, slots=True)
class Dem:
    """An open file.

    to_xy: takes (column, row), counted from the outer corner of cell (0, 0), to coordinates of `crs`.
    nodata: the file's value for "no data"; None if it has none.
    read(row, column, height, width): heights of a window inside the file, float64 metres, NaN without data.
    """

    rows: int
    columns: int
    to_xy: Affine
    crs: CRS
    nodata: float | None
    read: Callable[[int, int, int, int], F64]

    @property
    def vertical(self) -> str:
        """Name of the vertical datum; empty if the file has none."""
        return "" if self.crs == PLAIN else vertical_datum(self.crs.to_dict(projjson=True))

    @property
    def projection(self) -> str:
        """Name of the file's projection, or its PROJ text if it has no name."""
        if self.crs == PLAIN:
            return "none named: plain metres"
        return projection_name(self.crs.to_dict(projjson=True)) or str(self.crs.to_string())


@dataclass(frozen=True, slots=True)
class Site:
    """A file and a start in it.

    to_xy, crs: of the file; longitudes, if any, count from the start.
    map_crs, projection: projection of the map, and its name.
    x_m, y_m: the start in it.
    lonlat_deg: the start on the file's ellipsoid; None without a projection.
    cell_m: the longer side of the file's cells there.
    """

    dem: Dem
    to_xy: Affine
    crs: CRS
    map_crs: CRS
    projection: str
    x_m: float
    y_m: float
    lonlat_deg: tuple[float, float] | None

    @property
    def cell_m(self) -> float:
        """The longer side of the file's cells around the start, in metres of the map."""
        column, row = ~self.to_xy @ _moved(self.map_crs, self.crs, self.x_m, self.y_m)
        corners = [self.to_xy @ (column + i, row + j) for i, j in ((0, 0), (1, 0), (0, 1))]
        here, *others = [_moved(self.crs, self.map_crs, *corner) for corner in corners]
        return max(math.dist(here, there) for there in others)

    @property
    def pole_m(self) -> tuple[float, float] | None:
        """In a file in degrees, x and y of the nearer pole from the start: around it the cells are no rectangles."""
        if not (self.crs.is_geographic and self.lonlat_deg):
            return None
        return _moved(self.crs, self.map_crs, 0.0, math.copysign(90.0, self.lonlat_deg[1]))

    def rows_columns(self, x_m: F64, y_m: F64) -> tuple[F64, F64]:
        """Fractional rows and columns of the file (k,) at places of the map (k,), counted from the start.

        Raises DemError if the file's projection ends there.
        """
        x, y = self.x_m + x_m, self.y_m + y_m
        if self.map_crs != self.crs:
            x, y = (np.array(axis) for axis in transform(self.map_crs, self.crs, x, y))
        columns, rows = ~self.to_xy @ (x, y)
        if not (np.isfinite(columns).all() and np.isfinite(rows).all()):
            raise DemError("has a projection that ends inside the region; ask for a smaller --size")
        return rows, columns


# -- opening ---------------------------------------------------------------------------------------------------


@contextmanager
def open_dem(path: Path, how: Reading) -> Iterator[Dem]:
    """Open the file for reading. Raises DemError, or OSError if the file cannot be opened."""
    with path.open("rb") as file:
        if not file.read(1):
            raise DemError("is empty; copy it again")
    with rasterio.Env(**CLOSED):  # it also stops PROJ from writing to standard error
        crs = _named_crs(how.crs)
        if path.suffix == ".npy":
            yield _array(path, how, crs)
            return
        with _opened(path) as raster:
            yield _raster(raster, how, crs)


def _named_crs(text: str) -> CRS | None:
    """Return the projection that a user named; None for an empty text."""
    if not text:
        return None
    try:
        if CRS_FORMS.match(text):  # GDAL would also accept an address or a file name
            return CRS.from_user_input(text)
    except ValueError:  # CRSError is one
        pass
    raise DemError(f"is in no projection called {text!r}; write EPSG:number, PROJ text or WKT")


def _opened(path: Path) -> Any:
    for driver in DRIVERS:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", NotGeoreferencedWarning)
                return rasterio.open(path.absolute(), driver=driver)
        except RasterioError:
            continue
    raise DemError("is no whole elevation file: GeoTIFF, ESRI ASCII grid, PDS image or .npy can be read")


def _array(path: Path, how: Reading, crs: CRS | None) -> Dem:
    try:
        array = np.load(path, mmap_mode="r")
    except (ValueError, EOFError, OSError, SyntaxError, TokenError, TypeError, OverflowError) as error:  # numpy's own
        why = visible(str(error))[:_MOST_WORDS]
        raise DemError(f"is no whole .npy file of numbers ({why}); write it by numpy.save") from None
    if array.ndim != 2 or array.dtype.kind not in "iuf" or not array.size:
        raise DemError(f"holds {array.dtype} of shape {array.shape}; heights are numbers in rows and columns")
    rows, columns = array.shape

    def read(row: int, column: int, height: int, width: int) -> F64:
        with np.errstate(invalid="ignore"):  # a NaN may be a signalling one
            raw = array[row : row + height, column : column + width].astype(np.float64)
        return _measured(raw, how.nodata) * (how.unit_m or 1.0)

    return Dem(rows, columns, _given_place(how, rows, how.north_first), crs or PLAIN, how.nodata, read)


def _raster(file: Any, how: Reading, crs: CRS | None) -> Dem:
    band = _band(file, how.band)
    if file.transform.is_identity:
        to_xy = _given_place(how, file.height, True)
    elif file.transform.b or file.transform.d:
        raise DemError("has rows that do not run along its x axis (rotated); straighten it by gdalwarp")
    else:
        to_xy = file.transform
    metres = how.unit_m or unit_m(file.units[band - 1])
    scale, offset = file.scales[band - 1] * metres, file.offsets[band - 1] * metres

    def read(row: int, column: int, height: int, width: int) -> F64:
        try:
            raw = file.read(band, window=Window(column, row, width, height), masked=True)
        except RasterioError:
            where = f"rows {row} to {row + height}, columns {column} to {column + width}"
            raise DemError(f"is cut short or damaged at {where}; copy it again") from None
        with np.errstate(invalid="ignore"):  # a NaN may be a signalling one
            heights: F64 = _measured(raw.astype(np.float64).filled(np.nan), how.nodata) * scale + offset
        return heights

    nodata = file.nodatavals[band - 1] if how.nodata is None else how.nodata
    return Dem(file.height, file.width, to_xy, crs or file.crs or PLAIN, nodata, read)


def _band(file: Any, wanted: int) -> int:
    if wanted > file.count or (not wanted and file.count > 1):
        raise DemError(f"has {file.count} band{'s' * (file.count > 1)}; choose with --band, 1 to {file.count}")
    band = wanted or 1
    if np.dtype(file.dtypes[band - 1]).kind not in "iuf":
        raise DemError(f"holds {file.dtypes[band - 1]} in band {band}; heights are plain numbers")
    return band


def _given_place(how: Reading, rows: int, north_first: bool) -> Affine:
    if not how.cell_m:
        raise DemError("does not say how large its cells are; give --source-cell (and --source-corner to place it)")
    x, y = how.corner
    up = -how.cell_m if north_first else how.cell_m
    return Affine(how.cell_m, 0.0, x, 0.0, up, y + rows * how.cell_m if north_first else y)


def _measured(raw: F64, nodata: float | None) -> F64:
    """Set NaN where the value is not finite or equals `nodata` to the digits of a float32."""
    absent = ~np.isfinite(raw)
    if nodata is not None:
        absent |= np.isclose(raw, nodata, rtol=1e-6, atol=0.0)
    raw[absent] = np.nan
    return raw


# -- placing ---------------------------------------------------------------------------------------------------


def place(dem: Dem, kind: str, first: float, second: float) -> Site:
    """Place the start, by `kind`: 'rowcol' (from the outer corner of cell (0, 0)), 'xy' (the file's) or 'lonlat'
    (degrees).

    Raises DemError if it lies outside the file.
    """
    if dem.crs == PLAIN and kind == "lonlat":
        raise DemError("names no projection, so longitudes mean nothing; give --crs, or the start by --start-xy")
    ball = "" if dem.crs == PLAIN else ellipsoid(dem.crs.to_dict(projjson=True))
    x, y = _file_xy(dem, ball, kind, first, second)
    column, row = ~dem.to_xy @ (x, y)
    if not (0 <= column <= dem.columns and 0 <= row <= dem.rows):
        (west, south), (east, north) = dem.to_xy @ (0, dem.rows), dem.to_xy @ (dem.columns, 0)
        raise DemError(
            f"does not hold the start at {x:.10g} {y:.10g}: its x are {west:.10g} to {east:.10g}, "
            f"its y {south:.10g} to {north:.10g}"
        )
    if not ball:
        return Site(dem, dem.to_xy, PLAIN, PLAIN, dem.projection, x, y, None)
    if dem.crs.is_geographic:  # longitudes from the start: no seam at 180 degrees; 0..360 works like -180..180
        to_xy, crs = Affine.translation(-x, 0.0) @ dem.to_xy, _degrees(ball)
        return Site(dem, to_xy, crs, _local(ball, 0.0, y), _local_name(ball, x, y), 0.0, 0.0, (x, y))
    lon, lat = _moved(dem.crs, _degrees(ball), x, y)
    if _true_to_scale(dem.crs, _local(ball, lon, lat), x, y):
        return Site(dem, dem.to_xy, dem.crs, dem.crs, dem.projection, x, y, (lon, lat))
    return Site(dem, dem.to_xy, dem.crs, _local(ball, lon, lat), _local_name(ball, lon, lat), 0.0, 0.0, (lon, lat))


def _file_xy(dem: Dem, ball: str, kind: str, first: float, second: float) -> tuple[float, float]:
    """Coordinates of the start in the file's own system."""
    if kind == "rowcol":
        x, y = dem.to_xy @ (second, first)
        return float(x), float(y)
    if kind == "xy":
        return first, second
    if not dem.crs.is_geographic:
        return _moved(_degrees(ball), dem.crs, first, second)
    west = dem.to_xy.c
    return west + (first - west) % 360.0, second


def _true_to_scale(crs: CRS, local: CRS, x: float, y: float) -> bool:
    """Return whether a step in a projection has its true length on the ground, along both axes."""
    step = 100.0
    here, *others = [_moved(crs, local, *at) for at in ((x, y), (x + step, y), (x, y + step))]
    return all(abs(math.dist(here, there) / step - 1.0) <= TRUE_RATIO for there in others)


def _degrees(ball: str) -> CRS:
    return CRS.from_string(f"+proj=longlat {ball} +no_defs")


def _local(ball: str, lon_deg: float, lat_deg: float) -> CRS:
    return CRS.from_string(f"+proj=aeqd +lon_0={lon_deg!r} +lat_0={lat_deg!r} {ball} +units=m +no_defs")


def _local_name(ball: str, lon_deg: float, lat_deg: float) -> str:
    return f"azimuthal equidistant around longitude {lon_deg:.6f}, latitude {lat_deg:.6f}, {ball}"


def _moved(source: CRS, target: CRS, x: float, y: float) -> tuple[float, float]:
    if source == target:
        return x, y
    xs, ys = transform(source, target, [x], [y])
    return float(xs[0]), float(ys[0])


# -- writing ---------------------------------------------------------------------------------------------------


def write_raster(path: Path, driver: str, bands: Any, grid: Grid | None, names: tuple[str, ...]) -> None:
    """Write bands (k, rows, columns), row along +y, to a file whose first row is the north; NaN is nodata if placed.

    grid: place of the cells, in plain metres; None: a picture without a place. Raises OSError if it cannot be written.
    """
    path.open("wb").close()  # raises OSError with the reason: some of GDAL's errors are not rasterio errors
    count, rows, columns = bands.shape
    place: dict[str, Any] = {}
    if grid is not None:
        west, north = grid.x0_m - grid.cell_m / 2, grid.y0_m + (rows - 0.5) * grid.cell_m
        place = {"transform": Affine(grid.cell_m, 0, west, 0, -grid.cell_m, north), "crs": PLAIN, "nodata": math.nan}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)
            with rasterio.open(
                path, "w", driver=driver, count=count, height=rows, width=columns, dtype=bands.dtype, **place
            ) as file:
                file.write(bands[:, ::-1])
                file.descriptions = names if grid is not None else file.descriptions
    except RasterioError as error:
        raise OSError(str(error)) from None
