"""Commands `onboard gdem ...`: import of an orbiter's map into the format that the flight program reads."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from onboard.command_line import EX_CANTCREAT, EX_DATAERR, EX_NOINPUT, EX_USAGE, fail

if TYPE_CHECKING:
    from onboard.bringup.maps.gdem_import import ImportedMap

EXAMPLES = """\b
Examples:
  onboard gdem import LDEM_80S_20M.tif --start-lonlat -45.3 -85.1 --out gdem.npz
  onboard gdem import site.asc --start-xy 512300 4031200 --size 1000 --cell 5
  onboard gdem import heights.npy --source-cell 2 --start-rowcol 120.5 80.5
  onboard run --set mission.gdem=gdem.npz"""
LENGTH, FROM_0 = click.FloatRange(min=0.01), click.FloatRange(min=0.0)
PAIR = (float, float)
Pair = tuple[float, float]


@click.group("gdem", epilog=EXAMPLES)
def app() -> None:
    """Import the orbiter's map."""


@app.command("import", epilog=EXAMPLES)
@click.argument("file", type=Path)
@click.option("--out", "-o", type=Path, default=Path("gdem.npz"), show_default=True, help="Where the map goes.")
@click.option("--start-lonlat", type=PAIR, metavar="LON LAT", help="Start: longitude and latitude, degrees.")
@click.option("--start-xy", type=PAIR, metavar="X Y", help="Start: x and y in the file's own coordinates.")
@click.option("--start-rowcol", type=PAIR, metavar="ROW COLUMN", help="Start: row, column; the first cell is 0.5 0.5.")
@click.option("--size", type=LENGTH, default=500.0, show_default=True, help="Side of the map around the start, m.")
@click.option("--cell", type=LENGTH, default=10.0, show_default=True, help="Its cells, m.")
@click.option("--band", type=click.IntRange(min=0), default=0, help="Band of the file, from 1; 0: it has one.")
@click.option("--crs", default="", help="Projection, over what the file says: EPSG:number, PROJ, WKT.")
@click.option("--unit", "unit_m", type=FROM_0, default=0.0, help="Metres a unit of height; 0: as the file says.")
@click.option("--nodata", type=float, metavar="VALUE", help='A value for "no data", beside what the file says.')
@click.option("--source-cell", "cell_m", type=FROM_0, default=0.0, help="Cells of a file that does not tell (.npy).")
@click.option("--source-corner", "corner", type=PAIR, metavar="X Y", default=(0.0, 0.0), help="Its south-west corner.")
@click.option("--north-first", is_flag=True, help="The first row of an .npy is the northernmost.")
@click.option("--json", "as_json", is_flag=True, help="The summary as JSON.")
def import_command(
    file: Path,
    out: Path,
    start_lonlat: Pair | None,
    start_xy: Pair | None,
    start_rowcol: Pair | None,
    size: float,
    cell: float,
    as_json: bool,
    **source: Any,
) -> None:
    """Cut the orbiter's map of a mission out of FILE: GeoTIFF, ESRI ASCII grid, PDS image or .npy.

    The map is centred on the start; without a start, on the middle of the file.

    Exit codes: 0 done, 64 start named twice or --out no .npz, 65 no map can be made of it, 66 no such file,
    73 no place to write.
    """
    from onboard.bringup.maps.dem_file import Reading  # rasterio is heavy, and no other command needs it
    from onboard.bringup.maps.dem_words import DemError
    from onboard.bringup.maps.gdem_import import MapRequest, import_gdem
    from onboard.maps.gdem_file import to_npz

    starts = {"lonlat": start_lonlat, "xy": start_xy, "rowcol": start_rowcol}
    named = {kind: at for kind, at in starts.items() if at is not None}
    if len(named) > 1:
        options = " and ".join(f"--start-{kind}" for kind in named)
        raise fail(EX_USAGE, f"the start is named by {options}; name it once")
    if out.suffix.lower() != ".npz":
        raise fail(EX_USAGE, f"--out {out}: the map is an .npz; name it {out.with_suffix('.npz')}")
    kind, at = next(iter(named.items()), ("middle", (0.0, 0.0)))
    how = Reading(**source)
    try:
        with _progress(file.name) as progress:
            made = import_gdem(file, how, MapRequest(kind, at, size, cell), progress)
    except DemError as error:
        raise fail(EX_DATAERR, f"{file} {error}") from None
    except OSError as error:
        raise fail(EX_NOINPUT, f"{file} cannot be read: {error.strerror}") from None
    try:
        out.write_bytes(to_npz(made.gdem))
    except OSError as error:
        raise fail(EX_CANTCREAT, f"{out} cannot be written: {error.strerror}") from None
    for line in made.doubts:
        print(f"onboard: warning: {line}", file=sys.stderr)
    _show(_summary(file, out, made), as_json)


@contextmanager
def _progress(name: str) -> Iterator[Callable[[int, int], None]]:
    """Progress bar on the terminal."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(f"reading {name}", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _summary(file: Path, out: Path, made: ImportedMap) -> dict[str, Any]:
    import numpy as np

    grid, heights, site = made.gdem.grid, made.gdem.heights_m, made.site
    return {
        "file": str(file),
        "out": str(out),
        "rows": grid.rows,
        "columns": grid.columns,
        "cell_m": grid.cell_m,
        "start_xy": [site.x_m, site.y_m],
        "start_lonlat_deg": site.lonlat_deg,
        "start_height_m": made.level_m,
        "lowest_m": float(np.nanmin(heights)),
        "highest_m": float(np.nanmax(heights)),
        "known_ratio": made.known_ratio,
        "source_rows": site.dem.rows,
        "source_columns": site.dem.columns,
        "source_cell_m": site.cell_m,
        "source_cells_read": made.cells_read,
        "projection": site.projection,
        "source_projection": site.dem.projection,
        "vertical_datum": site.dem.vertical,
        "nodata": site.dem.nodata,
        "note": made.gdem.note,
    }


def _show(told: dict[str, Any], as_json: bool) -> None:
    if as_json:
        print(json.dumps(told))
        return
    from rich.console import Console
    from rich.table import Table

    table = Table(show_header=False, box=None)
    lonlat = told["start_lonlat_deg"]
    side_m = told["rows"] * told["cell_m"]
    for name, text in (
        ("map", f"{told['out']}: {told['rows']} x {told['columns']} cells of {told['cell_m']:g} m ({side_m:g} m)"),
        (
            "from",
            f"{told['source_rows']} x {told['source_columns']} cells of {told['source_cell_m']:.4g} m, "
            f"{told['source_cells_read']} read",
        ),
        ("projection", told["projection"]),
        (
            "start",
            f"x {told['start_xy'][0]:.3f}, y {told['start_xy'][1]:.3f}"
            + (f"; longitude {lonlat[0]:.6f}, latitude {lonlat[1]:.6f}" if lonlat else ""),
        ),
        (
            "its height",
            f"{told['start_height_m']:.2f} m over {told['vertical_datum'] or 'an unnamed datum'}, 0 in the map",
        ),
        ("heights", f"{told['lowest_m']:.2f} to {told['highest_m']:.2f} m"),
        ("known", f"{100 * told['known_ratio']:.1f} % of the cells"),
    ):
        table.add_row(name, text)
    Console().print(table)
