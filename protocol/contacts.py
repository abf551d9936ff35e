"""Contact windows: the times at which the link may carry anything. Both ends obey the same rule, each on its clock."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

MOST = 16  # that the rover is told at once


class Windows(NamedTuple):
    """Spans (begin, end) in ns, rising, none touching another; no span at all: always open. Make them by `windows`."""

    spans: tuple[tuple[int, int], ...] = ()

    def is_open(self, now_ns: int) -> bool:
        """Whether something may be sent now. A span holds its begin and not its end."""
        return not self.spans or any(begin <= now_ns < end for begin, end in self.spans)

    def next_begin_ns(self, now_ns: int) -> int | None:
        """When the next span begins that has not begun; None after the last."""
        return next((begin for begin, _ in self.spans if begin > now_ns), None)

    def end_ns(self, now_ns: int) -> int | None:
        """When the span of now ends; None outside, and where there are none."""
        return next((end for begin, end in self.spans if begin <= now_ns < end), None)

    def over(self, now_ns: int) -> bool:
        """Whether the last span lies behind; never where there is none."""
        return bool(self.spans) and self.spans[-1][1] <= now_ns

    def near(self, now_ns: int, margin_ns: int) -> bool:
        """Whether a span is open, ended less than `margin_ns` ago or begins within it."""
        return any(begin - margin_ns <= now_ns < end + margin_ns for begin, end in self.spans)

    def shifted(self, by_ns: int) -> Windows:
        """The same spans on another clock."""
        return Windows(tuple((begin + by_ns, end + by_ns) for begin, end in self.spans))


def windows(spans: Iterable[tuple[int, int]]) -> Windows:
    """Checked and put in order. Raises ValueError that names the span in seconds."""
    ordered = sorted(spans)
    for begin, end in ordered:
        if end <= begin:
            raise ValueError(f"the window {begin / 1e9:g} to {end / 1e9:g} s ends before it begins")
    for (_, end), (begin, _) in pairwise(ordered):
        if begin <= end:
            raise ValueError(f"the window that begins at {begin / 1e9:g} s should begin after {end / 1e9:g} s, "
                             "where the one before ends")
    return Windows(tuple(ordered))
