"""Estimator of onboard time on the ground, with its error bound.

Each stamp states the onboard time one delay before its arrival. No delay is negative, and at least one stamp of the
last ten minutes took no longer than a round trip. The offset to be added to the station's clock therefore lies between
the greatest `ahead` (stamp minus arrival) and that plus RTT, each widened by DRIFT_PPM of its age, by which the two
clocks may have drifted apart. The estimate is the middle; half the width is its error bound.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

DRIFT_PPM = 100  # of two crystals against each other, both within their temperature ranges
STAMP_NS = 1_000_000  # telemetry has whole milliseconds
_SPAN_NS, _SPANS = 60_000_000_000, 10


class Correlation(NamedTuple):
    """Estimate of onboard time.

    onboard_ns: present reading of the rover's clock.
    error_ns: error bound; None: no round trip is known.
    """

    onboard_ns: int
    error_ns: int | None


@dataclass(slots=True)
class FarClock:
    """The estimator. Times are the station's clock.

    rtt_ns: round-trip time; 0 until a request is answered. A value from an earlier session may be given.
    """

    rtt_ns: int = 0
    _best: dict[int, tuple[int, int]] = field(default_factory=dict)  # minute -> arrival, onboard minus station time

    def hear(self, onboard_ns: int, now_ns: int) -> None:
        """Add a stamp of the rover that arrived now."""
        span, ahead_ns = now_ns // _SPAN_NS, onboard_ns - now_ns
        known = self._best.get(span)
        if known is None or ahead_ns >= known[1]:
            self._best[span] = (now_ns, ahead_ns)
        if len(self._best) > _SPANS:
            del self._best[min(self._best)]

    def forget(self) -> None:
        """Discard all stamps after a reboot of the rover: its clock restarts."""
        self._best.clear()

    def measure(self, answered_ns: int) -> None:
        """Add a measured time from a request to its first answer: a round trip, or more if its first copy was lost.

        A smaller value is therefore taken at once, a larger one only by an eighth.
        """
        larger_ns = self.rtt_ns + (answered_ns - self.rtt_ns) // 8
        self.rtt_ns = answered_ns if not self.rtt_ns else min(answered_ns, larger_ns)

    def at(self, now_ns: int) -> Correlation | None:
        """Return the estimate for a time of the station; None until the rover is received."""
        if not self._best:
            return None
        rows = [(ahead_ns, abs(now_ns - at_ns) * DRIFT_PPM // 1_000_000) for at_ns, ahead_ns in self._best.values()]
        least_ns = max(ahead_ns - drift_ns for ahead_ns, drift_ns in rows)
        most_ns = max(ahead_ns + drift_ns for ahead_ns, drift_ns in rows) + self.rtt_ns
        error_ns = (most_ns - least_ns) // 2 + STAMP_NS if self.rtt_ns else None
        return Correlation(now_ns + (least_ns + most_ns) // 2, error_ns)

    def onboard_ns(self, now_ns: int) -> int | None:
        """Return the estimated onboard time; None until the rover is received."""
        found = self.at(now_ns)
        return None if found is None else found.onboard_ns
