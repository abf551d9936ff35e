"""Commands `onboard map ...`: list of a stored map's tiles, export of the map for other tools."""

from __future__ import annotations

import json
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from onboard.command_line import EX_CANTCREAT, EX_DATAERR, EX_NOINPUT, EX_USAGE, fail
from protocol.visible import visible

if TYPE_CHECKING:
    from onboard.drivers.storage.map_tiles import FolderContent, TileFile
    from onboard.perception.map.tiles import Tile

EXAMPLES = """\b
Examples:
  onboard map info map/
  onboard map export map/ --out site.tif
  onboard map export build/demo/onboard.mcap --format png --out site.png"""


@click.group("map", epilog=EXAMPLES)
def app() -> None:
    """List and export the map that the rover stores."""


@app.command("info", epilog=EXAMPLES)
@click.argument("folder", type=Path)
@click.option("--json", "as_json", is_flag=True, help="The list as JSON.")
def info_command(folder: Path, as_json: bool) -> None:
    """List the tiles of a stored map (FOLDER: mapping.folder), and the files that cannot be used with the reason.

    Exit codes: 0 some tiles can be used, 65 none, 66 no such folder.
    """
    if folder.is_file():
        raise fail(
            EX_NOINPUT,
            f"{folder} is a file; info lists a folder of tiles. Export the map of "
            f"a record by `onboard map export {folder} --out site.tif`",
        )
    kept = _kept(folder)
    now_s = time.time()
    rows = [_row(file, now_s) for file in kept.files]
    if as_json:
        print(json.dumps({"folder": str(folder), "tiles": rows, "dropped": kept.dropped}))
    else:
        _show(folder, rows, kept.dropped)
    if not rows:
        raise fail(EX_DATAERR, f"{folder} holds no map tile that can be used")


@app.command("export", epilog=EXAMPLES)
@click.argument("source", type=Path)
@click.option("--out", "-o", type=Path, required=True, help="Where the map goes.")
@click.option("--format", "-f", "form", default="", help="geotiff, npy, npz, ply or png; else by the ending of --out.")
@click.option("--json", "as_json", is_flag=True, help="The summary as JSON.")
def export_command(source: Path, out: Path, form: str, as_json: bool) -> None:
    """Write heights, their spread in each cell, and classes for another tool.

    SOURCE: a folder of tiles (mapping.folder), or the record of a run for its final map.

    Exit codes: 0 done, 64 no such format, 65 no map in it, 66 no such folder or record, 73 no place to write.
    """
    from onboard.bringup.maps.map_export import ENDINGS, FORMATS, trimmed
    from onboard.config import Mapping_
    from onboard.perception.map.cell_classes import classify
    from onboard.perception.map.height_spread import height_std_m
    from onboard.perception.map.tiles import join

    name = form or ENDINGS.get(out.suffix.lower(), "")
    if name not in FORMATS:
        what = f"no format is called {form!r}" if form else f"the name {out} tells no format"
        raise fail(EX_USAGE, f"{what}; --format is one of {', '.join(FORMATS)}")
    tiles, dropped = _tiles(source)
    for line in dropped:
        print(f"onboard: dropped: {visible(line)}", file=sys.stderr)
    try:
        cells, _ = join(tiles)
        surface = classify(cells, replace(Mapping_(), cell_m=cells.grid.cell_m))
        surface, height_std = trimmed(surface, height_std_m(cells))
    except ValueError as error:
        raise fail(EX_DATAERR, f"{source} holds no map to export: {error}") from None
    try:
        FORMATS[name](surface, height_std, out)
    except OSError as error:
        raise fail(EX_CANTCREAT, f"{out} cannot be written: {error.strerror or error}") from None
    grid = surface.grid
    told = {
        "out": str(out),
        "format": name,
        "tiles": len(tiles),
        "rows": grid.rows,
        "columns": grid.columns,
        "cell_m": grid.cell_m,
        "x0_m": grid.x0_m,
        "y0_m": grid.y0_m,
    }
    text = (
        f"{out}: {name}, {grid.rows} x {grid.columns} cells of {grid.cell_m:g} m from {len(tiles)} tiles; "
        f"centre of the south-west cell at x {grid.x0_m:.3f}, y {grid.y0_m:.3f} m"
    )
    print(json.dumps(told) if as_json else text)


def _tiles(source: Path) -> tuple[tuple[Tile, ...], tuple[str, ...]]:
    """Tiles of a folder or of a record, and the dropped files."""
    if not source.is_file():
        kept = _kept(source)
        return kept.tiles, kept.dropped
    from onboard.record.replay import last_map

    try:
        return last_map(source), ()
    except ValueError as error:
        raise fail(EX_DATAERR, f"{source} is no record of a run, or a damaged one: {error}") from None


def _kept(folder: Path) -> FolderContent:
    from onboard.drivers.storage.map_tiles import load

    try:
        return load(folder)
    except OSError as error:
        raise fail(EX_NOINPUT, f"{folder} cannot be read: {error.strerror}") from None


def _row(file: TileFile, now_s: float) -> dict[str, Any]:
    cells = file.tile.cells
    south_west = [k * cells.grid.cell_m * cells.grid.rows for k in (file.tile.i, file.tile.j)]
    return {
        "file": file.path.name,
        "x_m": south_west[0],
        "y_m": south_west[1],
        "cell_m": cells.grid.cell_m,
        "hit_ratio": float((cells.n > 0).mean()),
        "points": len(file.tile.points_m),
        "bytes": len(file.data),
        "age_s": now_s - file.path.stat().st_mtime,
    }


def _show(folder: Path, rows: list[dict[str, Any]], dropped: tuple[str, ...]) -> None:
    from rich.console import Console
    from rich.table import Table

    for line in dropped:
        print(f"dropped: {visible(line)}")
    if not rows:
        return
    console, table = Console(), Table(box=None)
    print(f"{folder}: {len(rows)} tiles, {sum(row['bytes'] for row in rows) / 1e6:.2f} MB")
    for name in ("tile", "from x, m", "from y, m", "hit", "points", "kB", "age"):
        table.add_column(name, justify="left" if name == "tile" else "right")
    for row in rows:
        table.add_row(
            row["file"],
            f"{row['x_m']:g}",
            f"{row['y_m']:g}",
            f"{100 * row['hit_ratio']:.0f} %",
            str(row["points"]),
            f"{row['bytes'] / 1e3:.0f}",
            _age(row["age_s"]),
        )
    console.print(table)


def _age(seconds: float) -> str:
    for unit, size in (("d", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= size:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds:.0f} s"
