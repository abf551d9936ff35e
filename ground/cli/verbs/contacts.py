"""The verbs `ground contacts show` and `send`: the station's contact windows, here and to the rover."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import typer

from ground.cli.operations import show
from ground.cli.operations.operate import Plan
from ground.cli.operations.script import ScriptStep
from ground.cli.verbs.table import Contact, Json, StationFile, Timeout
from ground.link.schedule import utc_words
from ground.link.session import Session
from ground.station.settings import load_schedule, load_settings, station_keys

Run = Callable[[Plan, Path | None, bool], None]


def add(family: typer.Typer, run: Run, out: Callable[[str], None]) -> None:
    """Add both verbs to the family. run(plan, station file, as_json) runs one and exits."""

    @family.command("show", epilog="Example: ground contacts show")
    def show_windows(station: StationFile = None) -> None:
        """List the station's contact windows and the present contact state; the rover is not asked."""
        settings = load_settings(station)
        schedule = load_schedule(settings)
        for begin_ns, end_ns in schedule.windows.spans:
            edges = (utc_words(at) if schedule.utc else f"{at / 1e9:g} s" for at in (begin_ns, end_ns))
            out(f"{'  '.join(edges)}  {(end_ns - begin_ns) / 1e9:.0f} s{'' if schedule.utc else '  (onboard time)'}")
        session = Session(station_keys(settings), settings.station, schedule=schedule, utc_ns=time.time_ns())
        out(show.contact_words(session, 0))

    @family.command("send", epilog="Example: ground contacts send")
    def send_windows(
        timeout: Timeout = 60.0, contact: Contact = 20.0, station: StationFile = None, as_json: Json = False
    ) -> None:
        """Send the station's next windows (at most 16) to the rover, in onboard time as estimated here."""
        if not load_schedule(load_settings(station)).windows.spans:
            raise typer.BadParameter("the station has none: name a file of windows as `contacts` in the station file")
        step = ScriptStep(1, "contacts send", "contacts", "contacts_set", {}, None)
        run(Plan((step,), contact_s=contact, limit_s=timeout), station, as_json)
