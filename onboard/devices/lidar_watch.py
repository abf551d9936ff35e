"""What can be wrong with a sensor whose frames are all right, each by its name, counted.

    gap         more than 3 periods between two scans     missed      turns between two scans that brought none
                of one stream: a pause that was asked for is neither
    period_off  the turn is off its nominal by over 1 %   all_error   a scan in which no beam saw or missed anything
    laser_off   II says so while scans are wanted         unhealthy   STAT of II is no word that all is well
"""

from __future__ import annotations

from collections.abc import Mapping

from onboard.devices.lidar_model import healthy
from onboard.records import U8, BeamStatus
from protocol.scip import STAMP_MODULUS

CAUSES = ("gap", "missed", "period_off", "all_error", "laser_off", "unhealthy")
_SPAN_TURNS = 100  # a period is measured over so many turns: 0.04 % of milliseconds
_OFF_RATIO = 0.01
_STRANGE_TURNS = 40  # a larger step is a jump of the clock, which the clock counts


class Watch:
    """counts: by cause. period_ms: of scans as asked for."""

    def __init__(self, counts: dict[str, int]) -> None:
        self.counts = counts
        self.restart(25.0)

    def restart(self, turn_ms: float, every: int = 1) -> None:
        """A stream begins: one scan every `every` turns."""
        self._turn_ms, self._every = turn_ms, every
        self.period_ns = turn_ms * every * 1e6  # from scan to scan, nominally
        self._stamp_ms = -1
        self._rx_ns = 0
        self._span_ms = self._span_turns = 0

    def pause(self) -> None:
        """The stream was ended as asked: the next scan is the first of another one."""
        self._stamp_ms = -1

    def turns(self, stamp_ms: int) -> int:
        """Turns since the last scan, by the stamps; 0 for the first and after a jump."""
        passed_ms = (stamp_ms - self._stamp_ms) % STAMP_MODULUS
        turns = round(passed_ms / self._turn_ms)
        return turns if self._stamp_ms >= 0 and turns <= _STRANGE_TURNS * self._every else 0

    def scan(self, stamp_ms: int, rx_ns: int, status: U8) -> None:
        """A scan came, all its checks passed."""
        turns = self.turns(stamp_ms)
        if turns:
            self.counts["missed"] += max(0, round(turns / self._every) - 1)
            self._period((stamp_ms - self._stamp_ms) % STAMP_MODULUS, turns)
        self.counts["gap"] += self._stamp_ms >= 0 and rx_ns - self._rx_ns > 3 * self.period_ns
        self.counts["all_error"] += int(status[status.argmin()]) > BeamStatus.NO_RETURN
        self._stamp_ms, self._rx_ns = stamp_ms, rx_ns

    def health(self, pairs: Mapping[str, str], laser_wanted: bool) -> None:
        """An II reply."""
        self.counts["laser_off"] += laser_wanted and pairs.get("LASR", "ON").startswith("OFF")
        self.counts["unhealthy"] += not healthy(pairs.get("STAT", ""))

    def _period(self, passed_ms: int, turns: int) -> None:
        self._span_ms += passed_ms
        self._span_turns += turns
        if self._span_turns >= _SPAN_TURNS:
            self.counts["period_off"] += abs(self._span_ms / self._span_turns / self._turn_ms - 1) > _OFF_RATIO
            self._span_ms = self._span_turns = 0
