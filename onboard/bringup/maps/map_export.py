"""Export of a map for other tools: heights, their spread and classes as GeoTIFF, .npy, .npz, PLY or a shaded PNG.

Rows run along +y as in all modules here (GeoTIFF and PNG begin in the north and are flipped); NaN is unknown.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from onboard.records import F32, F64, U8, CellClass, Grid, Surface

SUN_AZIMUTH_RAD, SUN_ELEVATION_RAD = math.radians(135.0), math.radians(40.0)  # from the north-west, as usual on maps
_VERTEX = np.dtype([("x", "<f8"), ("y", "<f8"), ("z", "<f4"), ("cell_class", "u1"), ("height_std", "<f4")])


def trimmed(surface: Surface, height_std_m: F32) -> tuple[Surface, F32]:
    """Cut both to the smallest rectangle with all cells that have a height. Raises ValueError if there is none."""
    known = np.isfinite(surface.z_mean)
    if not known.any():
        raise ValueError("no cell has a height")
    (low_j, high_j), (low_i, high_i) = ((int(k.min()), int(k.max()) + 1) for k in np.nonzero(known))
    part = (slice(low_j, high_j), slice(low_i, high_i))
    grid = Grid(*surface.grid.centre(low_j, low_i), surface.grid.cell_m, high_j - low_j, high_i - low_i)
    cut = Surface(
        grid,
        surface.cell_class[part],
        surface.z_mean[part],
        surface.z_top[part],
        surface.z_bot[part],
        surface.z_ray[part],
    )
    return cut, height_std_m[part]


def write_geotiff(surface: Surface, height_std_m: F32, path: Path) -> None:
    """Write bands height (m), class and height_std (m), float32, nodata NaN, in metres of the map frame."""
    from onboard.bringup.maps.dem_file import write_raster  # rasterio is heavy, and the other formats do not need it

    known = np.where(surface.cell_class == CellClass.OUTSIDE, np.nan, surface.cell_class)
    bands = np.stack([surface.z_mean, known.astype(np.float32), height_std_m])
    write_raster(path, "GTiff", bands, surface.grid, ("height", "class", "height_std"))


def write_npy(surface: Surface, _height_std_m: F32, path: Path) -> None:
    """Write the heights alone, float32 (rows, columns)."""
    with path.open("wb") as file:
        np.save(file, surface.z_mean)


def write_npz(surface: Surface, height_std_m: F32, path: Path) -> None:
    """Write the keys of an orbiter's map (heights_m, x0_m, y0_m, cell_m, note), and cell_class, height_std_m."""
    grid = surface.grid
    with path.open("wb") as file:
        np.savez_compressed(
            file,
            heights_m=surface.z_mean,
            x0_m=grid.x0_m,
            y0_m=grid.y0_m,
            cell_m=grid.cell_m,
            note="seen by the rover",
            cell_class=surface.cell_class,
            height_std_m=height_std_m,
        )


def write_ply(surface: Surface, height_std_m: F32, path: Path) -> None:
    """Write the centres of cells with a height as a cloud: x, y double, z float, cell_class uchar, height_std float."""
    j, i = np.nonzero(np.isfinite(surface.z_mean))
    vertices = np.empty(len(j), _VERTEX)
    vertices["x"], vertices["y"] = surface.grid.centre(j, i)  # type: ignore[arg-type]
    vertices["z"], vertices["cell_class"] = surface.z_mean[j, i], surface.cell_class[j, i]
    vertices["height_std"] = height_std_m[j, i]
    head = (
        "ply\nformat binary_little_endian 1.0\ncomment cells of a rover's map, metres, z up\n"
        f"element vertex {len(vertices)}\nproperty double x\nproperty double y\nproperty float z\n"
        "property uchar cell_class\nproperty float height_std\nend_header\n"
    )
    path.write_bytes(head.encode("ascii") + vertices.tobytes())


def write_png(surface: Surface, _height_std_m: F32, path: Path) -> None:
    """Write the heights shaded by a sun in the north-west, north up, one pixel per cell; transparent where unknown."""
    from onboard.bringup.maps.dem_file import write_raster

    known = np.isfinite(surface.z_mean)
    clear = np.where(known, 255, 0).astype(np.uint8)
    write_raster(path, "PNG", np.stack([shade(surface.z_mean, surface.grid.cell_m), clear]), None, ("grey", "alpha"))


def shade(heights_m: F32, cell_m: float) -> U8:
    """Brightness of the ground, 0 to 255, (rows, columns); as flat ground where the slope is unknown."""
    heights = heights_m.astype(np.float64)
    slope_y, slope_x = (_slope(heights, axis) / cell_m for axis in (0, 1))
    up = math.sin(SUN_ELEVATION_RAD)
    east = math.cos(SUN_ELEVATION_RAD) * math.cos(SUN_AZIMUTH_RAD)
    north = math.cos(SUN_ELEVATION_RAD) * math.sin(SUN_AZIMUTH_RAD)
    light = (up - east * slope_x - north * slope_y) / np.sqrt(1.0 + slope_x**2 + slope_y**2)
    shaded: U8 = np.round(255.0 * np.clip(light, 0.0, 1.0)).astype(np.uint8)
    return shaded


def _slope(heights: F64, axis: int) -> F64:
    """Rise per cell along an axis: over both neighbours, over one if the other is unknown, else 0."""
    step = np.diff(heights, axis=axis, prepend=np.nan), np.diff(heights, axis=axis, append=np.nan)
    count = np.isfinite(step[0]).astype(np.float64) + np.isfinite(step[1])
    slope: F64 = (np.nan_to_num(step[0]) + np.nan_to_num(step[1])) / np.maximum(count, 1.0)
    return slope


FORMATS: Mapping[str, Callable[[Surface, F32, Path], None]] = MappingProxyType(
    {"geotiff": write_geotiff, "npy": write_npy, "npz": write_npz, "ply": write_ply, "png": write_png}
)
ENDINGS: Mapping[str, str] = MappingProxyType(
    {".tif": "geotiff", ".tiff": "geotiff", ".npy": "npy", ".npz": "npz", ".ply": "ply", ".png": "png"}
)
