"""The commands `onboard gdem ...`: bring an orbiter's map into the form that the flight program reads."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Optional

import typer

if TYPE_CHECKING:
    from onboard.maps.gdem_import import Imported

EX_USAGE, EX_DATAERR, EX_NOINPUT, EX_CANTCREAT = 64, 65, 66, 73
EXAMPLES = (
    "Examples:\n\n"
    "  onboard gdem import LDEM_80S_20M.tif --start-lonlat -45.3 -85.1 --out gdem.npz\n\n"
    "  onboard gdem import site.asc --start-xy 512300 4031200 --size 1000 --cell 5\n\n"
    "  onboard gdem import heights.npy --source-cell 2 --start-rowcol 120.5 80.5\n\n"
    "  onboard run --set mission.gdem=gdem.npz"
)

app = typer.Typer(no_args_is_help=True, help=f"The orbiter's map.\n\n{EXAMPLES}")
Pair = Optional[tuple[float, float]]


@app.callback()
def gdem() -> None:
    """Keep `import` a word of its own while it is the only one."""


@app.command("import", epilog=EXAMPLES)
def import_command(
    file: Annotated[Path, typer.Argument(help="GeoTIFF, ESRI ASCII grid, PDS image or .npy.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Where the map goes.")] = Path("gdem.npz"),
    start_lonlat: Annotated[Pair, typer.Option(help="Start: longitude and latitude, degrees.")] = None,
    start_xy: Annotated[Pair, typer.Option(help="Start: x and y in the file's own coordinates.")] = None,
    start_rowcol: Annotated[Pair, typer.Option(help="Start: row and column; the first cell is 0.5 0.5.")] = None,
    size: Annotated[float, typer.Option(min=0.01, help="Side of the map around the start, m.")] = 500.0,
    cell: Annotated[float, typer.Option(min=0.01, help="Its cells, m.")] = 10.0,
    band: Annotated[int, typer.Option(min=0, help="Band of the file, from 1; 0: it has one.")] = 0,
    crs: Annotated[str, typer.Option(help="Projection, over what the file says: EPSG:number, PROJ, WKT.")] = "",
    unit: Annotated[float, typer.Option(min=0.0, help="Metres for each unit of height; 0: what the file says.")] = 0.0,
    source_cell: Annotated[float, typer.Option(min=0.0, help="Cells of a file that does not tell (.npy).")] = 0.0,
    source_corner: Annotated[tuple[float, float], typer.Option(help="x and y of its south-west corner.")] = (0.0, 0.0),
    north_first: Annotated[bool, typer.Option(help="The first row of an .npy is the northernmost.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="The summary as JSON.")] = False,
) -> None:
    """Cut the orbiter's map of a mission out of an elevation file. Without a start, it is the middle of the file.

    Exit codes: 0 done, 64 start named twice, 65 no map can be made of it, 66 no such file, 73 no place to write.
    """
    from onboard.drivers.dem_file import Reading  # rasterio is heavy, and no other command needs it
    from onboard.drivers.dem_words import DemError
    from onboard.maps.gdem_file import to_npz
    from onboard.maps.gdem_import import Wanted, import_gdem

    starts = {"lonlat": start_lonlat, "xy": start_xy, "rowcol": start_rowcol}
    named = {kind: at for kind, at in starts.items() if at is not None}
    if len(named) > 1:
        options = " and ".join(f"--start-{kind}" for kind in named)
        raise _fail(EX_USAGE, f"the start is named by {options}; name it once")
    kind, at = next(iter(named.items()), ("middle", (0.0, 0.0)))
    how = Reading(band, source_cell, source_corner, crs, unit, north_first)
    try:
        with _progress(file.name) as progress:
            made = import_gdem(file, how, Wanted(kind, at, size, cell), progress)
    except DemError as error:
        raise _fail(EX_DATAERR, f"{file} {error}") from None
    except OSError as error:
        raise _fail(EX_NOINPUT, f"{file} cannot be read: {error.strerror}") from None
    try:
        out.write_bytes(to_npz(made.gdem))
    except OSError as error:
        raise _fail(EX_CANTCREAT, f"{out} cannot be written: {error.strerror}") from None
    _show(_summary(file, out, made), as_json)


def _fail(code: int, text: str) -> typer.Exit:
    print(f"onboard: {text}", file=sys.stderr)
    return typer.Exit(code)


@contextmanager
def _progress(name: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on the terminal while there is more than a moment's work."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(f"reading {name}", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _summary(file: Path, out: Path, made: Imported) -> dict[str, Any]:
    import numpy as np

    grid, heights, site = made.gdem.grid, made.gdem.heights_m, made.site
    return {
        "file": str(file), "out": str(out), "rows": grid.rows, "columns": grid.columns, "cell_m": grid.cell_m,
        "start_xy": [site.x_m, site.y_m], "start_lonlat_deg": site.lonlat_deg, "start_height_m": made.level_m,
        "lowest_m": float(np.nanmin(heights)), "highest_m": float(np.nanmax(heights)), "known_ratio": made.known_ratio,
        "source_rows": site.dem.rows, "source_columns": site.dem.columns, "source_cell_m": site.cell_m,
        "source_cells_read": made.cells_read, "projection": site.projection, "source_projection": site.dem.projection,
        "vertical_datum": site.dem.vertical, "nodata": site.dem.nodata, "note": made.gdem.note,
    }  # fmt: skip


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
        ("from", f"{told['source_rows']} x {told['source_columns']} cells of {told['source_cell_m']:.4g} m, "
                 f"{told['source_cells_read']} read"),
        ("projection", told["projection"]),
        ("start", f"x {told['start_xy'][0]:.3f}, y {told['start_xy'][1]:.3f}"
                  + (f"; longitude {lonlat[0]:.6f}, latitude {lonlat[1]:.6f}" if lonlat else "")),
        ("its height", f"{told['start_height_m']:.2f} m over {told['vertical_datum'] or 'an unnamed datum'}, "
                       "0 in the map"),
        ("heights", f"{told['lowest_m']:.2f} to {told['highest_m']:.2f} m"),
        ("known", f"{100 * told['known_ratio']:.1f} % of the cells"),
    ):  # fmt: skip
        table.add_row(name, text)
    Console().print(table)
