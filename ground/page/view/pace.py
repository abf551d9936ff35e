"""Rate of the rover's clock against the station's, from the stamps of telemetry. Pure.

The estimate of onboard time takes the two rates as equal within 100 ppm. A simulation may run slower than real time,
and a clock may be broken: ages by that estimate are then wrong, and the page counts from the arrival instead.
"""

from __future__ import annotations

from collections import deque

SPAN_NS, LEAST_NS = 20_000_000_000, 4_000_000_000
EQUAL = (0.8, 1.25)  # a change of the delay by 2 s within the span stays inside


class Pace:
    """Estimator of the rate over the last 20 s."""

    def __init__(self) -> None:
        self._stamps: deque[tuple[int, int]] = deque()

    def hear(self, onboard_ns: int, now_ns: int) -> None:
        """Add the newest stamp of the rover at a station time. A stamp that goes back (a reboot) restarts the pace."""
        if self._stamps and onboard_ns < self._stamps[-1][1]:
            self._stamps.clear()
        if not self._stamps or onboard_ns > self._stamps[-1][1]:
            self._stamps.append((now_ns, onboard_ns))
        while self._stamps and now_ns - self._stamps[0][0] > SPAN_NS:
            self._stamps.popleft()

    @property
    def ratio(self) -> float | None:
        """Onboard time per station time; None while less than 4 s are known."""
        if len(self._stamps) < 2:
            return None
        (first_ns, first_onboard_ns), (last_ns, last_onboard_ns) = self._stamps[0], self._stamps[-1]
        span_ns = last_ns - first_ns
        return (last_onboard_ns - first_onboard_ns) / span_ns if span_ns >= LEAST_NS else None


def unequal(ratio: float | None) -> bool:
    """Return whether the rates differ so much that onboard time says nothing about an age."""
    return ratio is not None and not EQUAL[0] <= ratio <= EQUAL[1]
