"""The verbs `ground events`, `requests`, `link`, `plot`. All but `link` query the archive, not the rover."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from ground.archive import link_figures, read
from ground.archive.checks import arguments_of
from ground.archive.read import Chain, Span
from ground.cli.operations.operate import Plan, Teller, operate
from ground.cli.operations.show import measured
from ground.cli.verbs import times as when
from ground.cli.verbs.options import (
    CANNOT_CREATE,
    NO_INPUT,
    File,
    Last,
    Since,
    Until,
    archive_path,
    as_line,
    check_items,
    fail,
    items,
    span,
)
from ground.cli.verbs.screen import line_beside, line_out
from ground.cli.verbs.table import Contact, Json, StationFile
from ground.link.event_words import event_words
from ground.station.settings import load_settings
from protocol.link.transactions import RequestState
from protocol.tables import commands
from protocol.tables.modes import EVENTS, SEVERITIES
from protocol.tables.telemetry import BY_NAME

_HOLE_S = 3.0
_FINAL = {state.name for state in RequestState if state.final}


def add(app: typer.Typer) -> None:
    """Add the verbs of this file."""
    app.command(epilog="Examples: ground events --last 20 | ground events --severity warning --since 1d")(events)
    app.command(epilog="Examples: ground requests --open | ground requests --last 5 --json")(requests)
    app.command(epilog="Examples: ground link | ground link --for 60 | ground link --since 1h")(link)
    app.command(epilog="Examples: ground plot voltage_v | ground plot x_m y_m --since 10m --out way.png")(plot)


def events(
    severity: Annotated[
        str,
        typer.Option(
            metavar="LEAST", help=f"This or worse: {', '.join(SEVERITIES)}.", autocompletion=lambda: list(SEVERITIES)
        ),
    ] = "debug",
    name: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Of this name only; again for more.",
            autocompletion=lambda: [row.name for row in EVENTS],
        ),
    ] = None,
    since: Since = "",
    until: Until = "",
    last: Last = 50,
    file: File = None,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Show events of the rover from the archive; `ground watch` shows them as they arrive."""
    if severity not in SEVERITIES:
        raise typer.BadParameter(f"`{severity}` should be one of {', '.join(SEVERITIES)}", param_hint="--severity")
    least = SEVERITIES.index(severity)
    with read.reading(archive_path(file, station)) as db:
        found = [
            row
            for row in read.rows(db, "events", span(since, until, name or ()))
            if SEVERITIES.index(row["severity"]) >= least
        ]
        zeros = read.boots(db)
    for row in found[-last:] if last else found:
        line_out(_event_json(row, zeros) if as_json else _event_line(row, zeros))


def _event_json(row: dict[str, Any], zeros: dict[int, int]) -> str:
    zero_ns, onboard_ns = zeros.get(row["boot_id"]), row["onboard_ns"]
    happened_ns = None if zero_ns is None or onboard_ns is None else zero_ns + onboard_ns
    return as_line({**row, "happened_utc_ns": happened_ns})


def _event_line(row: dict[str, Any], zeros: dict[int, int]) -> str:
    mark = "; filled in later" if row["filled"] else ""
    return (
        f"{when.told(row['utc_ns'])}  {row['severity']:8}  {row['name']}: {event_words(row['text'])}  "
        f"({when.onboard(row['onboard_ns'], zeros.get(row['boot_id']))}{mark})"
    )


def requests(
    still: Annotated[bool, typer.Option("--open", help="Only those whose outcome is not known.")] = False,
    since: Since = "",
    until: Until = "",
    last: Last = 20,
    file: File = None,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Show every request with its outcome, including those that wait for their start time."""
    with read.reading(archive_path(file, station)) as db:
        found = [chain for chain in read.chains(db, span(since, until)) if not (still and chain.state in _FINAL)]
    for chain in found[-last:] if last else found:
        line_out(_chain_json(chain) if as_json else _chain_line(chain))
    if not found and not as_json:
        line_out("no request is open" if still else "nothing was asked")


def _chain_json(chain: Chain) -> str:
    reports = [{"at_ns": at_ns, "state": state, "text": text} for at_ns, state, text in chain.reports]
    return as_line(
        {**chain._asdict(), "arguments": arguments_of(chain.arguments), "state": chain.state, "reports": reports}
    )


def argument_words(name: str, arguments: dict[str, Any]) -> str:
    """Return the arguments of a request as people typed them: angles in degrees, other numbers in SI units."""
    known = {argument.name: argument for row in commands.TABLE if row.name == name for argument in row.arguments}
    words = []
    for key, value in arguments.items():
        if isinstance(value, float) and key in known and known[key].is_angle:
            words.append(measured(value, known[key].unit))
        else:
            words.append(f"{value:g}" if isinstance(value, float) else str(value))
    return " ".join(words)


def _chain_line(chain: Chain) -> str:
    words = argument_words(chain.name, arguments_of(chain.arguments))
    text = chain.reports[-1][2] if chain.reports else "nothing heard of it"
    ways = " > ".join(dict.fromkeys(state.lower() for _, state, _ in chain.reports)) or "requested"
    by = f"  (by {chain.asked_by})" if chain.asked_by else ""
    return f"{when.told(chain.utc_ns)}  {chain.station}#{chain.request_id:<5} {chain.name} {words}  {ways}: {text}{by}"


def link(
    for_s: Annotated[float, typer.Option("--for", min=1, metavar="S", help="Listen so long.")] = 10.0,
    since: Since = "",
    until: Until = "",
    file: File = None,
    contact: Contact = 20.0,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Show statistics of the link: received, lost, data rates. Listens, or, with --since, queries the archive."""
    if since or until or file is not None:
        _figures(archive_path(file, station), span(since, until), as_json, {})
        return
    settings = load_settings(station)
    with tempfile.TemporaryDirectory() as folder:
        settings = replace(settings, archive=settings.archive or f"{folder}/archive.db")
        began_ns = time.time_ns()
        _, session = operate(settings, Plan(contact_s=contact, limit_s=for_s), Teller(lambda _: None, False, 1e9))
        more = {"boot_id": session.boot_id, "rtt_s": session.far_clock.rtt_ns / 1e9 or None}
        _figures(Path(settings.archive), Span(began_ns), as_json, more)


def _figures(path: Path, asked: Span, as_json: bool, more: dict[str, float | None]) -> None:
    with read.reading(path) as db:
        found = link_figures.figures(_rows(read.rows(db, "datagrams", asked)))
    if as_json:
        line_out(as_line({**found._asdict(), **more}))
        return
    for line in link_figures.words(found):
        line_out(line)
    for name, value in more.items():
        line_out(f"{name:16} {'?' if value is None else f'{value:g}'}")


def _rows(rows: Iterable[dict[str, object]]) -> Iterable[link_figures.DatagramRow]:
    for row in rows:
        data, at, counter, boot = row["data"], row["utc_ns"], row["counter"], row["boot_id"]
        assert isinstance(data, bytes) and isinstance(at, int)
        yield link_figures.DatagramRow(
            at,
            str(row["direction"]),
            str(row["verdict"]),
            len(data),
            counter if isinstance(counter, int) else None,
            boot if isinstance(boot, int) else None,
            int(str(row["run"])),
        )


def plot(
    names: Annotated[
        list[str],
        typer.Argument(metavar="ITEM...", help="Telemetry items, as `ground status` names them.", autocompletion=items),
    ],
    since: Since = "",
    until: Until = "",
    picture: Annotated[Path, typer.Option("--out", metavar="FILE", help="Where to, a PNG file.")] = Path("plot.png"),
    file: File = None,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Draw items over time, from the archive, as a picture; with --json print the values instead, one line an item."""
    known, asked = check_items(names), span(since, until)
    with read.reading(archive_path(file, station)) as db:
        rows = [
            (row["name"], row["utc_ns"], row["value"])
            for row in read.rows(db, "items", asked._replace(names=known))
            if row["value"] is not None
        ]
    if not rows:
        raise fail(NO_INPUT, f"no value of {', '.join(known)} in that time")
    if as_json:
        for name in known:
            mine = [(at, value) for item, at, value in rows if item == name]
            times_ns, values = [at for at, _ in mine], [value for _, value in mine]
            line_out(json.dumps({"name": name, "utc_ns": times_ns, "values": values}))
        return
    _draw(known, rows, picture)


def _draw(names: Iterable[str], rows: list[tuple[str, int, float]], path: Path) -> None:
    import numpy as np

    from ground.cli.operations.show import NAMED
    from pictures.items import Series
    from pictures.items import items as drawn
    from pictures.style import png

    zero_ns = rows[0][1]
    series = []
    for name in names:
        mine = [((at - zero_ns) / 1e9, float(value)) for item, at, value in rows if item == name]
        times, values = np.array(mine, dtype=float).reshape(-1, 2).T
        holes = np.flatnonzero(np.diff(times) > _HOLE_S) + 1  # no line is drawn across a silence
        times, values = np.insert(times, holes, np.nan), np.insert(values, holes, np.nan)
        kind = NAMED.get(name)
        names = None if kind is None else {one.value: one.name for one in kind}
        series.append(Series(name, BY_NAME[name].unit, times, values, BY_NAME[name].limits, names))
    try:
        path.write_bytes(png(drawn(series, zero_ns if zero_ns > when.FIRST_UTC_NS else 0)))
    except OSError as error:
        raise fail(CANNOT_CREATE, f"{path}: {error.strerror}") from None
    line_beside(f"{path} written")
