"""The verb `ground preview goto X Y`."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated

import typer

from ground.archive.schema import ArchiveError
from ground.station.settings import NoStationError
from ground.verbs import when
from ground.verbs.options import CANNOT_CREATE, File, archive_path, fail, out, said
from ground.verbs.table import Json, StationFile

app = typer.Typer(help="What a command would do, without asking the rover.", no_args_is_help=True)
_FAILED = 1


@app.command(context_settings={"ignore_unknown_options": True},
             epilog="Examples: ground preview goto 12 3 | ground preview goto 4 -1 --map map.npz --out way.png")
def goto(
    x_m: Annotated[float, typer.Argument(metavar="X", help="East in the map frame, m.")],
    y_m: Annotated[float, typer.Argument(metavar="Y", help="North in the map frame, m.")],
    map_file: Annotated[Path | None, typer.Option("--map", metavar="FILE", help="A map that `ground get ldem` wrote; "
                                                  "else the newest in the archive.")] = None,
    gdem: Annotated[Path | None, typer.Option(metavar="FILE", help="The orbiter's map, as the rover has it.")] = None,
    config: Annotated[Path | None, typer.Option(metavar="FILE", help="The rover's settings (TOML); else the "
                                                "parameters fetched last, else the defaults.")] = None,
    picture: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="A picture of it, a PNG file.")] = None,
    file: File = None, station: StationFile = None, as_json: Json = False,
) -> None:  # fmt: skip
    """Path, length and time of a goto, by the rover's own planner on the map fetched last.

    Beforehand `ground scan`, `ground get ldem`, and `ground param list` where the rover does not fly the defaults.

    Exit codes: 0 there is a way, 1 there is none, 65 a damaged map, 66 no map.
    """
    from ground.products import preview

    archive = _archive(file, station, map_file is not None)
    goal_m = (x_m, y_m)
    try:
        if map_file is not None:
            seen = preview.map_file(map_file)
        else:
            assert archive is not None
            seen = preview.newest_map(archive)
        flown, warning = preview.settings_for(seen, config, archive)
        orbit = preview.gdem_file(gdem)
    except preview.NoMapError as error:
        raise fail(error.code, str(error)) from None
    found = preview.look_ahead(seen, goal_m, orbit, flown)
    for line in [*preview.warnings(seen, goal_m, orbit, archive), *([warning] if warning else [])]:
        said(f"ground: {line}")
    if as_json:
        out(json.dumps({"news": "preview", "map": seen.where, **json.loads(found.to_json())}))
    else:
        at = f" of {when.told(seen.at_utc_ns)}" if seen.at_utc_ns else ""
        out(f"{found.kind} by {found.rule}: {found.reason}")
        out(f"{found.words}; on {seen.where}{at}")
        for x, y, yaw_rad in found.path.tolist():
            out(f"  {x:8.2f} m {y:8.2f} m  heading {math.degrees(yaw_rad):5.0f}°")
        if found.leads and len(found.beyond) > 1:
            out(f"  and {len(found.beyond)} places beyond, over ground that was not seen yet")
    if picture is not None:
        _draw(picture, seen, found, goal_m)
    raise typer.Exit(0 if found.leads else _FAILED)


def _archive(file: Path | None, station: Path | None, has_map: bool) -> Path | None:
    """The archive, which may be missing where a map was named."""
    try:
        path = archive_path(file, station)
    except (ArchiveError, NoStationError):
        if not has_map:
            raise
        return None
    return path if path.is_file() or not has_map else None


def _draw(path: Path, seen: object, found: object, goal_m: tuple[float, float]) -> None:
    from ground.products.preview import Map
    from onboard.planning.prediction import Prediction
    from onboard.records import Grid
    from pictures.style import png
    from pictures.way import Sets, way

    assert isinstance(seen, Map) and isinstance(found, Prediction)
    product = seen.product
    sets = Sets(Grid(*product.grid), product.heights_m, product.node_sets)
    made = way(sets, found.path, found.beyond, goal_m, found.words)
    try:
        path.write_bytes(png(made))
    except OSError as error:
        raise fail(CANNOT_CREATE, f"{path}: {error.strerror}") from None
    said(f"{path} written")
