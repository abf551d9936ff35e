"""Start of the terminal view: link, clock and archive as the shell has them, with the newest map of the archive."""

from __future__ import annotations

import os
import sys
import time
from contextlib import ExitStack
from pathlib import Path

from ground.archive.read import newest_product, reading
from ground.archive.schema import ArchiveError
from ground.operation import show
from ground.operation.left import left
from ground.operation.operate import CONNECT_S, ByHandError, Teller
from ground.products import files
from ground.session.news import Item, News, Progress
from ground.session.session import Session
from ground.shell.shell import Shell
from ground.shell.terminal import Live, Save, opened
from ground.station.clock import WallClock
from ground.station.settings import Settings
from ground.station.station import Station
from ground.station.user import by_hand
from ground.watch.app import WatchApp
from ground.watch.model import View, severity
from protocol import WireError
from protocol.products import LdemProduct, decode_ldem
from protocol.visible import visible

INTERRUPTED = 130


class ViewTeller(Teller):
    """Teller that adds its lines to the view, and gives it the news."""

    def __init__(self, view: View) -> None:
        super().__init__(lambda text: view.say(visible(text)), as_json=False, report_s=1.0)
        self._view = view
        self.session: Session | None = None

    def news(self, news: list[News]) -> None:
        """Take one turn's news."""
        if self.session is not None:
            self._view.take(news, self.session)
        for one in self._whole(news):
            if isinstance(one, Item) or (isinstance(one, Progress) and not self._moved(one)):
                continue
            self._view.say(visible(show.news_line(one) or ""), severity(one))


def possible(plain: bool, as_json: bool) -> bool:
    """True if the view can be drawn: on a terminal that is not a dumb one, and nobody asked for lines."""
    return not plain and not as_json and sys.stdout.isatty() and sys.stdin.isatty() and os.environ.get("TERM") != "dumb"


def run(settings: Settings, contact_s: float) -> int:
    """Open the link and show the view until it is ended. Returns the exit code.

    Raises StationError, ConfigError or ArchiveError if the link cannot be used, ByHandError after Ctrl-C.
    """
    view = View(newest_map(settings.archive))
    teller = ViewTeller(view)
    with ExitStack() as stack:
        archive = stack.enter_context(opened(settings, time.time_ns()))
        link = stack.enter_context(Station(settings, archive))
        link.session.asked_by = by_hand("watch")
        link.wait_open(*CONNECT_S)
        link.session.utc_ns = time.time_ns()
        teller.session = link.session

        app = WatchApp(Live(link, WallClock(), teller, Shell(elsewhere), saver(view), contact_s), view)
        code = app.run()
        if app.failure is not None:
            raise app.failure
        if code == INTERRUPTED:
            raise ByHandError("; ".join(["interrupted", *left(link.session)]))
        return code or 0


def saver(view: View) -> Save:
    """Writer of products that a `get` names a file for; it says in the view what it wrote, or why it could not."""

    def save(session: Session, name: str, path: Path) -> None:
        found = next(one for one in reversed(session.products.values()) if one.name == name)
        try:
            view.say(visible(f"{path} written: {files.save(found, path)}"))
        except (OSError, ValueError) as error:
            view.say(visible(f"{path} not written: {error}"), "error")

    return save


def elsewhere(words: list[str]) -> int:
    """Refuse a verb that prints pages: it would write over the view. Raises ValueError with what to type instead."""
    raise ValueError(f"`{words[0]}` prints pages: type it in another terminal, as `ground {' '.join(words)}`")


def newest_map(archive: str) -> LdemProduct | None:
    """Newest map of the archive; None if there is none, or it cannot be read now."""
    if not archive or not Path(archive).is_file():
        return None
    try:
        with reading(Path(archive)) as db:
            found = newest_product(db, "ldem")
        return None if found is None else decode_ldem(found[2])
    except (ArchiveError, WireError):
        return None
