"""Contact windows: the times at which the link may send. Both ends apply the same rule, each on its own clock."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

MOST = 16  # windows per command to the rover


class Windows(NamedTuple):
    """Contact windows; build them with `windows`.

    spans: (begin, end) in ns, in rising order, not touching each other; empty: always open.
    """

    spans: tuple[tuple[int, int], ...] = ()

    def is_open(self, now_ns: int) -> bool:
        """True if sending is allowed now. A span includes its begin and excludes its end."""
        return not self.spans or any(begin <= now_ns < end for begin, end in self.spans)

    def next_begin_ns(self, now_ns: int) -> int | None:
        """Begin of the next span, ns; None after the last."""
        return next((begin for begin, _ in self.spans if begin > now_ns), None)

    def end_ns(self, now_ns: int) -> int | None:
        """End of the current span, ns; None outside of a span, and where there are no spans."""
        return next((end for begin, end in self.spans if begin <= now_ns < end), None)

    def over(self, now_ns: int) -> bool:
        """True if the last span has ended; False if there are no spans."""
        return bool(self.spans) and self.spans[-1][1] <= now_ns

    def near(self, now_ns: int, margin_ns: int) -> bool:
        """True if a span is open, ended less than `margin_ns` ago or begins within `margin_ns`."""
        return any(begin - margin_ns <= now_ns < end + margin_ns for begin, end in self.spans)

    def shifted(self, by_ns: int) -> Windows:
        """Return the spans shifted by `by_ns`, for another clock."""
        return Windows(tuple((begin + by_ns, end + by_ns) for begin, end in self.spans))


def windows(spans: Iterable[tuple[int, int]]) -> Windows:
    """Check and sort spans. Raises ValueError with the span in seconds if one is empty or two touch."""
    ordered = sorted(spans)
    for begin, end in ordered:
        if end <= begin:
            raise ValueError(f"the window {begin / 1e9:g} to {end / 1e9:g} s ends before it begins")
    for (_, end), (begin, _) in pairwise(ordered):
        if begin <= end:
            raise ValueError(
                f"the window that begins at {begin / 1e9:g} s should begin after {end / 1e9:g} s, "
                "where the one before ends"
            )
    return Windows(tuple(ordered))
