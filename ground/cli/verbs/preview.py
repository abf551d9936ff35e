"""The verb `ground preview goto X Y`."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ground.archive.schema import ArchiveError
from ground.cli.operations.operate import Teller, operate
from ground.cli.verbs import times as when
from ground.cli.verbs.options import CANNOT_CREATE, File, archive_path, fail
from ground.cli.verbs.run_verb import plan_of
from ground.cli.verbs.screen import line_beside, line_out
from ground.cli.verbs.table import Json, StationFile
from ground.station.settings import NoStationError, load_settings
from ground.station.station import StationError
from onboard.config import ConfigError, load

if TYPE_CHECKING:
    from ground.products.preview import Map, PreviewSettings

app = typer.Typer(help="What a command would do, without asking the rover.", no_args_is_help=True)
_FAILED = 1
_CONTACT_S, _FETCH_S = 5.0, 60.0


@app.command(
    context_settings={"ignore_unknown_options": True},
    epilog="Examples: ground preview goto 12 3 | ground preview goto 4 -1 --map map.npz --out way.png",
)
def goto(
    x_m: Annotated[float, typer.Argument(metavar="X", help="East in the map frame, m.")],
    y_m: Annotated[float, typer.Argument(metavar="Y", help="North in the map frame, m.")],
    map_file: Annotated[
        Path | None,
        typer.Option(
            "--map", metavar="FILE", help="A map that `ground get ldem` wrote; else the newest in the archive."
        ),
    ] = None,
    gdem: Annotated[Path | None, typer.Option(metavar="FILE", help="The orbiter's map, as the rover has it.")] = None,
    config: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="The rover's settings (TOML); else the parameters fetched last, else the defaults."
        ),
    ] = None,
    picture: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="A picture of it, a PNG file.")] = None,
    fetch: Annotated[
        bool,
        typer.Option(
            "--fetch/--no-fetch", help="Ask the rover for its parameters where those known here are not what it flies."
        ),
    ] = True,
    file: File = None,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Show path, length and time of a goto, by the rover's own planner on the newest fetched map.

    Beforehand `ground scan`, `ground get ldem`. The rover is asked for its parameters if they are not known.

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
        flown = preview.settings_for(seen, config, archive)
        orbit = preview.gdem_file(gdem)
    except preview.NoMapError as error:
        raise fail(error.code, str(error)) from None
    if not flown.same and config is None and fetch:
        flown = _asked(seen, flown, station)
    found = preview.look_ahead(seen, goal_m, orbit, flown.config)
    for line in [*preview.warnings(seen, goal_m, orbit, archive), *([flown.warning] if flown.warning else [])]:
        line_beside(f"ground: {line}")
    if as_json:
        line_out(json.dumps({"news": "preview", "map": seen.where, **json.loads(found.to_json())}))
    else:
        at = f" of {when.told(seen.at_utc_ns)}" if seen.at_utc_ns else ""
        line_out(f"{found.kind} by {found.rule}: {found.reason}")
        line_out(f"{found.words}; on {seen.where}{at}")
        for x, y, yaw_rad in found.path.tolist():
            line_out(f"  {x:8.2f} m {y:8.2f} m  heading {math.degrees(yaw_rad):5.0f}°")
        if found.leads and len(found.beyond) > 1:
            line_out(f"  and {len(found.beyond)} places beyond, over ground that was not seen yet")
    if picture is not None:
        _draw(picture, seen, found, goal_m)
    raise typer.Exit(0 if found.leads else _FAILED)


def _asked(seen: Map, known: PreviewSettings, station: Path | None) -> PreviewSettings:
    """Return the settings fetched from the rover if it answers, else the known ones. Prints which."""
    from ground.products import preview

    plan = replace(plan_of(["param", "list"], _CONTACT_S, _FETCH_S), asked_by="preview")
    try:
        _, session = operate(load_settings(station), plan, Teller(lambda _: None, False, 0.0))
        listed = next((p.data for p in reversed(session.products.values()) if p.name == "parameters"), None)
        why = "the rover has not sent its parameters in time"
    except (StationError, ConfigError, ArchiveError) as error:
        listed, why = None, str(error)
    flown = None if listed is None else preview.fetched(seen, listed)
    if flown is not None:
        line_beside("ground: the rover's parameters were fetched from it just now")
        return flown
    line_beside(f"ground: the rover's parameters were not fetched: {why}")
    if known.config == load():
        line_beside(f"ground: {preview.assumed_words()}")
    return known


def _archive(file: Path | None, station: Path | None, has_map: bool) -> Path | None:
    """Return the archive; it may be missing if a map was named."""
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
    line_beside(f"{path} written")
