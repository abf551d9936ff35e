"""Start of the terminal view: link, clock and archive as the shell has them, with the newest map of the archive."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from ground.archive.read import newest_product, reading
from ground.archive.schema import ArchiveError
from ground.cli.operations import show
from ground.cli.operations.open_requests import left
from ground.cli.operations.operate import CONNECT_S, ByHandError, Teller
from ground.cli.shell.shell import OperatorShell
from ground.cli.shell.terminal import Live, Save, opened
from ground.cli.watch.app import WatchApp
from ground.cli.watch.model import Line, PastView, View, severity
from ground.link.event_words import event_words
from ground.link.news import Item, News, Progress
from ground.link.session import Session
from ground.page.past.archive import read_past, trail
from ground.page.view.snapshot import EventRow
from ground.products import files
from ground.station.clock import WallClock
from ground.station.settings import StationSettings
from ground.station.station import Station
from ground.station.user import by_hand
from protocol import WireError
from protocol.products import decode_ldem
from protocol.visible import visible

INTERRUPTED = 130
_PAST_LINES = 40


class ViewTeller(Teller):
    """Teller that adds its lines to the view, and hands it the news."""

    def __init__(self, view: View, session: Callable[[], Session]) -> None:
        super().__init__(lambda text: view.add_line(visible(text)), as_json=False, report_s=1.0)
        self._view, self._session = view, session

    def news(self, news: list[News]) -> None:
        """Take one turn's news."""
        self._view.receive(news, self._session())
        for one in news:
            if not isinstance(one, Item | Progress):  # the first line of the view has the transfers
                self._view.add_line(visible(show.news_line(one) or ""), severity(one))


def run(settings: StationSettings, contact_s: float) -> int:
    """Open the link and show the view until it is ended. Returns the exit code.

    Raises StationError, ConfigError or ArchiveError if the link cannot be used, ByHandError after Ctrl-C.
    """
    view = View()
    with ExitStack() as stack:
        archive = stack.enter_context(opened(settings, time.time_ns()))
        station = stack.enter_context(Station(settings, archive))
        station.session.asked_by = by_hand("watch")
        station.wait_open(*CONNECT_S)
        station.session.utc_ns = time.time_ns()
        view.load(past_view(settings.archive, station.session.utc_ns))
        teller = ViewTeller(view, lambda: station.session)
        live = Live(station, WallClock(), teller, OperatorShell(refuse_pages), product_writer(view), contact_s)
        app = WatchApp(live, view)
        code = app.run()
        if app.failure is not None:
            raise app.failure
        if code == INTERRUPTED:
            raise ByHandError("; ".join(["interrupted", *left(station.session)]))
        return code or 0


def product_writer(view: View) -> Save:
    """Return the writer of products that a `get` names a file for; it adds a line to the view."""

    def save(session: Session, name: str, path: Path) -> None:
        product = next(one for one in reversed(session.products.values()) if one.name == name)
        try:
            view.add_line(visible(f"{path} written: {files.save(product, path)}"))
        except (OSError, ValueError) as error:
            view.add_line(visible(f"{path} not written: {error}"), "error")

    return save


def refuse_pages(words: list[str]) -> int:
    """Refuse a verb that prints pages: it would write over the view. Raises ValueError with what to type instead."""
    raise ValueError(f"`{words[0]}` prints pages: type it in another terminal, as `ground {' '.join(words)}`")


def past_view(archive: str, utc_ns: int) -> PastView:
    """Return map, trail and events of the archive; empty if there is none, or it cannot be read now.

    utc_ns: UTC at the zero of the station's clock.
    """
    if not archive or not Path(archive).is_file():
        return PastView()
    past = read_past(archive)
    lines = tuple(Line("station", visible(_event_line(row))) for row in past.events[-_PAST_LINES:])
    places = tuple((x_m, y_m) for x_m, y_m in trail(archive).tolist())
    boot_id = past.events[-1].boot_id if past.events else 0
    try:
        with reading(Path(archive)) as db:
            found = newest_product(db, "ldem")
        if found is not None:
            return PastView(decode_ldem(found[2]), found[0] - utc_ns, places, lines, boot_id)
    except (ArchiveError, WireError):
        pass
    return PastView(None, None, places, lines, boot_id)


def _event_line(row: EventRow) -> str:
    clock = time.strftime("%H:%M:%S", time.gmtime(row.utc_ns / 1e9))
    return f"{clock} UTC  {row.severity:8}  {row.name}: {event_words(row.text)}"
