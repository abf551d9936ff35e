"""Monitor of a sensor whose frames pass their checks: counts of other errors, by name.

gap         more than 3 periods between two scans     missed      turns between two scans without a scan
            of one stream: a requested pause is neither
period_off  the turn is off its nominal by over 1 %   all_error   a scan with an error status in every beam
laser_off   II reports it while scans are wanted      unhealthy   STAT of II does not report a good state
"""

from __future__ import annotations

from collections.abc import Mapping

from onboard.devices.lidar.model import healthy
from onboard.records import U8, BeamStatus
from protocol.scip import STAMP_MODULUS

CAUSES = ("gap", "missed", "period_off", "all_error", "laser_off", "unhealthy")
_SPAN_TURNS = 100  # turns over which a period is measured: 0.04 % resolution from milliseconds
_OFF_RATIO = 0.01
_STRANGE_TURNS = 40  # a larger step is a clock jump, which the clock estimator counts


class Watch:
    """Monitor. counts: by cause. period_ns: nominal time from scan to scan as requested."""

    def __init__(self, counts: dict[str, int]) -> None:
        self.counts = counts
        self.restart(25.0)

    def restart(self, turn_ms: float, every: int = 1) -> None:
        """Start a stream of one scan every `every` turns."""
        self._turn_ms, self._every = turn_ms, every
        self.period_ns = turn_ms * every * 1e6  # from scan to scan, nominally
        self._stamp_ms = -1
        self._rx_ns = 0
        self._span_ms = self._span_turns = 0

    def pause(self) -> None:
        """Mark a requested end of the stream: the next scan is the first of another one."""
        self._stamp_ms = -1

    def turns(self, stamp_ms: int) -> int:
        """Turns since the last scan, by the stamps; 0 for the first scan and after a jump."""
        passed_ms = (stamp_ms - self._stamp_ms) % STAMP_MODULUS
        turns = round(passed_ms / self._turn_ms)
        return turns if self._stamp_ms >= 0 and turns <= _STRANGE_TURNS * self._every else 0

    def scan(self, stamp_ms: int, rx_ns: int, status: U8) -> None:
        """Record a scan that passed all its checks."""
        turns = self.turns(stamp_ms)
        if turns:
            self.counts["missed"] += max(0, round(turns / self._every) - 1)
            self._period((stamp_ms - self._stamp_ms) % STAMP_MODULUS, turns)
        self.counts["gap"] += self._stamp_ms >= 0 and rx_ns - self._rx_ns > 3 * self.period_ns
        self.counts["all_error"] += int(status[status.argmin()]) > BeamStatus.NO_RETURN
        self._stamp_ms, self._rx_ns = stamp_ms, rx_ns

    def health(self, pairs: Mapping[str, str], laser_wanted: bool) -> None:
        """Record an II reply."""
        self.counts["laser_off"] += laser_wanted and pairs.get("LASR", "ON").startswith("OFF")
        self.counts["unhealthy"] += not healthy(pairs.get("STAT", ""))

    def _period(self, passed_ms: int, turns: int) -> None:
        self._span_ms += passed_ms
        self._span_turns += turns
        if self._span_turns >= _SPAN_TURNS:
            self.counts["period_off"] += abs(self._span_ms / self._span_turns / self._turn_ms - 1) > _OFF_RATIO
            self._span_ms = self._span_turns = 0
