"""Onboard time as seen from the ground, with the bound of its error.

Each stamp that arrives says: onboard time was this, one delay ago. No delay is less than nothing, and one of the stamps
of the last ten minutes took no longer than a round trip. So what is to be added to the station's clock lies between
the greatest `ahead` (stamp minus arrival) and that plus RTT, each widened by DRIFT_PPM of its age, by which the two
clocks may have run apart. The middle is taken; half the width is the bound of its error.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

DRIFT_PPM = 100  # of two crystals against each other, both in their ranges of temperature
STAMP_NS = 1_000_000  # telemetry has whole milliseconds
_SPAN_NS, _SPANS = 60_000_000_000, 10


class Correlation(NamedTuple):
    """onboard_ns: what the rover's clock shows now; error_ns: at most so far off, None: no round trip is known."""

    onboard_ns: int
    error_ns: int | None


@dataclass(slots=True)
class FarClock:
    """The estimator. Times are the station's clock. rtt_ns: 0 until an answer came; one of before may be given."""

    rtt_ns: int = 0
    _best: dict[int, tuple[int, int]] = field(default_factory=dict)  # minute -> heard at, onboard minus station time

    def hear(self, onboard_ns: int, now_ns: int) -> None:
        """A stamp of the rover that arrived now."""
        span, ahead_ns = now_ns // _SPAN_NS, onboard_ns - now_ns
        known = self._best.get(span)
        if known is None or ahead_ns >= known[1]:
            self._best[span] = (now_ns, ahead_ns)
        if len(self._best) > _SPANS:
            del self._best[min(self._best)]

    def forget(self) -> None:
        """The rover booted: its clock begins anew."""
        self._best.clear()

    def measure(self, answered_ns: int) -> None:
        """The first answer to a request came after this time: a round trip, and more where its first copy was lost.

        So a smaller one is taken at once and a larger one only by an eighth.
        """
        larger_ns = self.rtt_ns + (answered_ns - self.rtt_ns) // 8
        self.rtt_ns = answered_ns if not self.rtt_ns else min(answered_ns, larger_ns)

    def at(self, now_ns: int) -> Correlation | None:
        """The estimate for a time of the station; None until the rover was heard."""
        if not self._best:
            return None
        rows = [(ahead_ns, abs(now_ns - at_ns) * DRIFT_PPM // 1_000_000) for at_ns, ahead_ns in self._best.values()]
        least_ns = max(ahead_ns - drift_ns for ahead_ns, drift_ns in rows)
        most_ns = max(ahead_ns + drift_ns for ahead_ns, drift_ns in rows) + self.rtt_ns
        error_ns = (most_ns - least_ns) // 2 + STAMP_NS if self.rtt_ns else None
        return Correlation(now_ns + (least_ns + most_ns) // 2, error_ns)

    def onboard_ns(self, now_ns: int) -> int | None:
        """What the rover's clock shows about now; None until it was heard."""
        found = self.at(now_ns)
        return None if found is None else found.onboard_ns
