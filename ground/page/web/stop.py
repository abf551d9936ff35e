"""STOP of the page: a press of the button or key becomes one request, and each answer says how far it came.

Apart from the rest of the page: plain HTTP, its own small script, and no code of the page's library. A press has an id
made by the browser, so that a repeated POST asks for the same request.
"""

from __future__ import annotations

import re
from collections import OrderedDict
from concurrent.futures import Future
from typing import Any, Protocol

from ground.page.view.snapshot import CommandRow, Snapshot
from protocol.tables import commands

STOP = "stop"
_PRESS = re.compile(r"[A-Za-z0-9-]{8,64}")
_MOST_PRESSES = 256


class Station(Protocol):
    """Part of `live.Live` that STOP needs."""

    @property
    def snapshot(self) -> Snapshot:
        """Newest state."""

    def ask(self, name: str, arguments: commands.Arguments, asked_by: str, lifetime_s: float = 0.0) -> Future[int]:
        """Hand over an order."""

    def command(self, request_id: int) -> CommandRow | None:
        """Return a request."""


class StopDesk:
    """Presses and their requests."""

    def __init__(self, station: Station) -> None:
        self._station = station
        self._presses: OrderedDict[str, Future[int]] = OrderedDict()

    def press(self, press: str, who: str) -> dict[str, Any]:
        """Ask for a stop, once for each press id, and return how far it is. Raises ValueError for a malformed id."""
        if not _PRESS.fullmatch(press):
            raise ValueError("a press has an id of 8 to 64 letters, digits and dashes")
        if press not in self._presses:
            self._presses[press] = self._station.ask(STOP, {}, who)
            while len(self._presses) > _MOST_PRESSES:
                self._presses.popitem(last=False)
        return self.state(press)

    def state(self, press: str) -> dict[str, Any]:
        """Return how far a press came. Raises KeyError for an unknown press, so that the browser presses again."""
        taken = self._presses[press]
        shot = self._station.snapshot
        if not taken.done():
            return _told("waiting", f"waits for the link: {shot.trouble or 'the station starts'}")
        error = taken.exception()
        if error is not None:
            return _told("refused", str(error), final=True)
        return told(self._station.command(taken.result()), shot)


def told(row: CommandRow | None, shot: Snapshot) -> dict[str, Any]:
    """Return state and words of a stop's request. row: None until a snapshot has it.

    While the link is down no time is given: the snapshot has no clock of a session then.
    """
    if row is not None and row.ended_ns is not None and row.heard_ns is None:
        return _ended(row, ())
    if not shot.linked:
        state = "sent" if row is not None and row.copies else "requested"
        return _told(state, f"the link is down: {shot.trouble or 'its carrier has no peer'}")
    if row is None or row.sent_ns is None:
        why = "" if shot.in_contact else f": {shot.contact}"
        return _told("requested", f"the station has it, not sent yet{why}")
    if row.heard_ns is None or row.requested_ns is None:
        since_s = (shot.now_ns - (row.requested_ns or shot.now_ns)) / 1e9
        return _told("sent", f"sent {row.copies} times in {since_s:.1f} s; no answer of the rover yet")
    after_s = (row.heard_ns - row.requested_ns) / 1e9
    heard = f"heard by the rover; its answer came after {after_s:.1f} s"
    if row.ended_ns is not None:
        return _ended(row, (heard,))
    return _told("heard", f"{heard}{_report(row)}", good=True)


def _ended(row: CommandRow, before: tuple[str, ...]) -> dict[str, Any]:
    good = row.state == "COMPLETED"
    words = "; ".join((*before, "done" if good else row.state.lower())) + _report(row)
    return _told("completed" if good else "failed", words, final=True, good=good)


def _report(row: CommandRow) -> str:
    return f": {row.text}" if row.text else ""


def _told(state: str, words: str, *, final: bool = False, good: bool = False) -> dict[str, Any]:
    return {"state": state, "words": words, "final": final, "good": good}
