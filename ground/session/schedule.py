"""The station's contact windows, from a file, on the station's own clock.

    2026-11-22T12:00:00Z 2026-11-22T12:10:00Z   # UTC, one window a line
    600 1200                                    # or seconds of onboard time; one kind in a file
"""

from __future__ import annotations

from datetime import UTC, datetime
from typing import NamedTuple

from ground.session.far_clock import FarClock
from protocol.contacts import MOST, Windows, windows

_FORM = "should be `BEGIN END`, both in UTC like 2026-11-22T12:00:00Z or both in seconds of onboard time"


class Schedule(NamedTuple):
    """The windows of a file. utc: in UTC, else in onboard time; both in ns."""

    windows: Windows = Windows()
    utc: bool = False

    def here(self, utc_ns: int, far: FarClock, now_ns: int) -> Windows | None:
        """On the station's clock, whose zero is at `utc_ns`; None while onboard time is not known and needed."""
        if self.utc or not self.windows.spans:
            return self.windows.shifted(-utc_ns)
        onboard_ns = far.onboard_ns(now_ns)
        return None if onboard_ns is None else self.windows.shifted(now_ns - onboard_ns)

    def for_rover(self, utc_ns: int, far: FarClock, now_ns: int) -> tuple[float, ...] | None:
        """Begin and end in s of onboard time of the next windows, as `contacts_set` takes them; None: not known yet."""
        here, onboard_ns = self.here(utc_ns, far, now_ns), far.onboard_ns(now_ns)
        if here is None or onboard_ns is None:
            return None
        ahead = [span for span in here.shifted(onboard_ns - now_ns).spans if span[1] > onboard_ns][:MOST]
        return tuple(max(0.0, edge / 1e9) for span in ahead for edge in span)


def parse(text: str, where: str) -> Schedule:
    """Raises ValueError, one line that names the file and its line."""
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
    """UTC like 2026-11-22T12:00:00Z in ns since 1970. Raises ValueError, also for a time without a zone."""
    at = datetime.fromisoformat(word)
    if at.tzinfo is None:
        raise ValueError(f"`{word}` says no zone: end it with Z")
    since = at.astimezone(UTC) - datetime(1970, 1, 1, tzinfo=UTC)
    return (since.days * 86_400 + since.seconds) * 1_000_000_000 + since.microseconds * 1000


def utc_words(at_ns: int) -> str:
    """The same as text, to the second."""
    return datetime.fromtimestamp(at_ns // 1_000_000_000, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def _edge(word: str) -> tuple[int, bool]:
    return (utc_ns(word), True) if "T" in word else (round(float(word) * 1e9), False)
