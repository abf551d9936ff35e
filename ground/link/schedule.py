"""Contact windows of the station, from a file, converted to the station's clock.

2026-11-22T12:00:00Z 2026-11-22T12:10:00Z   # UTC, one window a line
600 1200                                    # or seconds of onboard time; one kind in a file
"""

from __future__ import annotations

from datetime import UTC, datetime
from typing import NamedTuple

from ground.link.rover_clock import FarClock
from protocol.link.contacts import MOST, Windows, windows

_FORM = "should be `BEGIN END`, both in UTC like 2026-11-22T12:00:00Z or both in seconds of onboard time"


class Schedule(NamedTuple):
    """Contact windows of a file.

    windows: in ns.
    utc: True: in UTC; False: in onboard time.
    """

    windows: Windows = Windows()
    utc: bool = False

    def here(self, utc_ns: int, far: FarClock, now_ns: int) -> Windows | None:
        """Return the windows on the station's clock (zero: `utc_ns`); None while a needed onboard time is unknown."""
        if self.utc or not self.windows.spans:
            return self.windows.shifted(-utc_ns)
        onboard_ns = far.onboard_ns(now_ns)
        return None if onboard_ns is None else self.windows.shifted(now_ns - onboard_ns)

    def for_rover(self, utc_ns: int, far: FarClock, now_ns: int) -> tuple[float, ...] | None:
        """Return the edges of the next windows in s of onboard time, for `contacts_set`; None: not yet known."""
        here, onboard_ns = self.here(utc_ns, far, now_ns), far.onboard_ns(now_ns)
        if here is None or onboard_ns is None:
            return None
        ahead = [span for span in here.shifted(onboard_ns - now_ns).spans if span[1] > onboard_ns][:MOST]
        return tuple(max(0.0, edge / 1e9) for span in ahead for edge in span)


def parse(text: str, where: str) -> Schedule:
    """Parse a file of windows. Raises ValueError, one line that names the file and its line."""
    spans: list[tuple[int, int]] = []
    kinds: set[bool] = set()
    for number, raw in enumerate(text.splitlines(), 1):
        words = raw.split("#", 1)[0].split()
        if not words:
            continue
        try:
            begin, end = (_edge(word) for word in words)
            kinds.add(begin[1])
            kinds.add(end[1])
            if len(kinds) > 1:
                raise ValueError(words)
        except ValueError:
            raise ValueError(f"{where}:{number}: `{' '.join(words)}` {_FORM}, as in the lines before") from None
        spans.append((begin[0], end[0]))
    if not spans:
        raise ValueError(f"{where}: no window in it")
    try:
        return Schedule(windows(spans), kinds == {True})
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None


def utc_ns(word: str) -> int:
    """Convert UTC like 2026-11-22T12:00:00Z to ns since 1970. Raises ValueError, also for a time without a zone."""
    at = datetime.fromisoformat(word)
    if at.tzinfo is None:
        raise ValueError(f"`{word}` says no zone: end it with Z")
    since = at.astimezone(UTC) - datetime(1970, 1, 1, tzinfo=UTC)
    return (since.days * 86_400 + since.seconds) * 1_000_000_000 + since.microseconds * 1000


def utc_words(at_ns: int) -> str:
    """Return UTC as text, to the second."""
    return datetime.fromtimestamp(at_ns // 1_000_000_000, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def _edge(word: str) -> tuple[int, bool]:
    return (utc_ns(word), True) if "T" in word else (round(float(word) * 1e9), False)
