"""Import of an elevation file as the orbiter's map of a mission: cut out around the start and resampled to its cells.

The map's origin is the start, in place and in height. `Gdem.note` states the subtracted height, the projection, the
value for "no data" and the vertical datum of the file.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from onboard.bringup.maps.dem_file import Dem, Reading, Site, open_dem, place
from onboard.bringup.maps.dem_words import DemError
from onboard.bringup.maps.gdem_resample import ResampledMap, resample
from onboard.maps.gdem_file import MOST_CELLS
from onboard.records import F64, Gdem, Grid


@dataclass(frozen=True, slots=True)
class MapRequest:
    """Requested map.

    start_kind: as in dem_file.place, or 'middle' of the file.
    start: the two numbers of the start.
    size_m: side of the map.
    cell_m: side of a cell.
    """

    start_kind: str = "middle"
    start: tuple[float, float] = (0.0, 0.0)
    size_m: float = 500.0
    cell_m: float = 10.0


@dataclass(frozen=True, slots=True)
class ImportedMap:
    """An imported map and its origin.

    gdem: the map.
    site: place in the file.
    level_m: height of the start in the file, subtracted from all heights.
    cells_read: cells of the file that were read.
    doubts: warnings for the user, one line each.
    """

    gdem: Gdem
    site: Site
    level_m: float
    cells_read: int
    doubts: tuple[str, ...]

    @property
    def known_ratio(self) -> float:
        """Ratio of the map's cells that have a height."""
        return float(np.isfinite(self.gdem.heights_m).mean())


def import_gdem(path: Path, how: Reading, wanted: MapRequest, progress: Callable[[int, int], None]) -> ImportedMap:
    """Import the map of a file. Raises DemError (its text continues the file's name), or OSError without a file."""
    grid = map_grid(wanted)
    with open_dem(path, how) as dem:
        site = _place(dem, wanted)
        found = resample(site, grid, progress)
        heights = found.heights_m
        if not np.isfinite(heights).any():
            raise DemError(f"has no data within the {wanted.size_m:g} m around the start; name another start or --size")
        level_m = _level_m(heights)
        note = f"{path.name}: {_note(site, wanted.cell_m, level_m)}"
        doubts = _doubts(site, grid, wanted, found)
    gdem = Gdem(grid, (heights - level_m).astype(np.float32), note)
    return ImportedMap(gdem, site, level_m, found.cells_read, doubts)


def map_grid(wanted: MapRequest) -> Grid:
    """Square grid around the origin with an even number of cells: the requested size or a little more.

    Raises DemError.
    """
    cells = wanted.size_m / wanted.cell_m
    if not 0 < cells <= MOST_CELLS:
        raise DemError(f"would fill {cells:g} cells a side, of {MOST_CELLS} at most; ask for other --size or --cell")
    half = math.ceil(cells / 2 - 1e-9)
    first_m = (0.5 - half) * wanted.cell_m
    return Grid(first_m, first_m, wanted.cell_m, 2 * half, 2 * half)


def _place(dem: Dem, wanted: MapRequest) -> Site:
    if wanted.start_kind == "middle":
        return place(dem, "rowcol", dem.rows / 2, dem.columns / 2)
    return place(dem, wanted.start_kind, *wanted.start)


def _level_m(heights_m: F64) -> float:
    """Height of the start: mean of the known cells of the four that meet there, else the median of the map."""
    j, i = heights_m.shape[0] // 2, heights_m.shape[1] // 2
    around = heights_m[j - 1 : j + 1, i - 1 : i + 1]
    return float(np.nanmean(around) if np.isfinite(around).any() else np.nanmedian(heights_m))


def _doubts(site: Site, grid: Grid, wanted: MapRequest, found: ResampledMap) -> tuple[str, ...]:
    """Warnings: a size that was raised, a map that extends beyond the file, implausible heights."""
    lines, side_m = [], grid.rows * grid.cell_m
    if side_m > wanted.size_m * (1 + 1e-9):
        lines.append(f"--size {wanted.size_m:g} was raised to {side_m:g} m: the cells of a side are an even number")
    edge_m = np.array([-side_m / 2, side_m / 2])
    rows, columns = site.rows_columns(edge_m[[0, 0, 1, 1]], edge_m[[0, 1, 0, 1]])
    beyond = max(-rows.min(), rows.max() - site.dem.rows, -columns.min(), columns.max() - site.dem.columns)
    if beyond > 0.5:  # cells of the file
        unknown = np.isnan(found.heights_m).mean()
        lines.append(f"the map of {side_m:g} m reaches beyond the file; {100 * unknown:.1f} % of its cells are unknown")
    if found.highest_m - found.lowest_m > side_m:
        middle_m = float(np.nanmedian(found.heights_m))
        odd_m = max(found.lowest_m, found.highest_m, key=lambda height_m: abs(height_m - middle_m))
        lines.append(
            f"heights from {found.lowest_m:g} to {found.highest_m:g} m within {side_m:g} m; "
            f"if {odd_m:g} stands for no data, say so by --nodata {odd_m:g}"
        )
    return tuple(lines)


def _note(site: Site, cell_m: float, level_m: float) -> str:
    dem = site.dem
    at = f"x {site.x_m:.3f}, y {site.y_m:.3f}"
    if site.lonlat_deg:
        at += f" (longitude {site.lonlat_deg[0]:.6f}, latitude {site.lonlat_deg[1]:.6f})"
    parts = [
        f"projection {site.projection}",
        f"file in {dem.projection}" if dem.projection != site.projection else "",
        f"start at {at}",
        f"heights minus {level_m:.3f} m, over {dem.vertical or 'a datum that the file does not name'}",
        f"no data {'not marked' if dem.nodata is None else f'{dem.nodata:g}'}",
        f"cells of {cell_m:g} m from {site.cell_m:.4g} m",
    ]
    return "; ".join(part for part in parts if part)
