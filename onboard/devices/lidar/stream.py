"""Scan stream: frames are decoded, checked by their countdown, timed, monitored and converted to Scans."""

from __future__ import annotations

from onboard.config import Lidar
from onboard.devices.lidar import model as models
from onboard.devices.lidar.beams import BeamMaker
from onboard.devices.lidar.clock import LidarClock
from onboard.devices.lidar.watch import Watch
from onboard.kernel_calls.scip import Blocks
from onboard.records import Scan
from protocol import WireError, scip

_SILENT_PERIODS, _SILENT_MARGIN_NS = 4, 50_000_000


class ScanStream:
    """Scans of one request to one model; `learn` and `thin` change it.

    counts: shared with the session, by name.
    turns: one scan is requested per this many turns, or per config.skip + 1 if that is more.
    """

    def __init__(self, config: Lidar, counts: dict[str, int]) -> None:
        self.counts = counts
        self.clock = LidarClock(config.latency_ns)
        self.watch = Watch(counts)
        self.heard_ns = 0  # time of the last valid scan
        self.turns = 1
        self._config = config
        self._left: int | None = None  # remaining scans of the request
        self.learn(models.UTM_30LX, usb=True)

    def learn(self, model: models.Model, usb: bool) -> None:
        """Set the sensor model: another sensor, or the same one on a new connection."""
        self._turn_ms, self.request = model.turn_ms, models.request_of(self._config, model, usb)
        self.beams = BeamMaker(self._config, model, self.request)
        self._code = self.request.code.encode()
        self.clock.restart(model.turn_ms)
        self._ask_for(self.turns)

    def thin(self, turns: int) -> None:
        """Set the next request to one scan per this many turns."""
        if turns != self.turns:
            self._ask_for(turns)

    def _ask_for(self, turns: int) -> None:
        self.turns = turns
        self.request = self.request._replace(skip=self._every(turns) - 1)
        self._decoder = scip.ScanDecoder(self.request, reader=Blocks)
        self.watch.restart(self._turn_ms, self.request.skip + 1)

    def _every(self, turns: int) -> int:
        return max(turns, self._config.skip + 1)

    def begin(self) -> None:
        """Reset the countdown: the sensor has accepted the request."""
        self._left = None

    def silent(self, now_ns: int, since_ns: int, turns: int = 1) -> bool:
        """Return whether no valid scan came for config.silent_ns or, if longer, 4 periods and 50 ms.

        since_ns: earliest start of the silence.
        turns: between the wanted scans; the present request may still have another number.
        """
        periods_ns = round(_SILENT_PERIODS * self._turn_ms * self._every(turns) * 1e6) + _SILENT_MARGIN_NS
        return now_ns - max(self.heard_ns, since_ns) > max(self._config.silent_ns, periods_ns)

    def has(self, frame: memoryview) -> bool:
        """Return whether a frame is a scan, not a short reply."""
        return len(frame) > 24 and frame[:2] == self._code

    def last(self, remaining: int) -> bool:
        """Return whether no scan follows the one with this count."""
        return not self.request.streams or (self.request.scans > 0 and remaining == 0)

    def take(self, frame: memoryview, rx_ns: int) -> tuple[int, Scan | None]:
        """Return (remaining count, scan) of a frame; scan None if its stamp repeats the last. Raises WireError."""
        got = self._decoder.decode(frame)
        self._countdown(got)
        stamp_ns = self.clock.observe(got.stamp_ms, rx_ns)
        self.counts["repeated_stamp"] = self.clock.repeated
        self.counts["clock_jump"] = self.clock.jumps
        self.counts["clock_reboot"] = self.clock.reboots
        if stamp_ns is None:
            return got.remaining, None
        scan = self.beams.scan(got.values, stamp_ns, self.clock.turn_ns)
        self.watch.scan(got.stamp_ms, rx_ns, scan.status)
        self.counts["scans"] += 1
        self.heard_ns = max(self.heard_ns, rx_ns)
        return got.remaining, scan

    def _countdown(self, got: scip.ScanReply) -> None:
        """Check the remaining count, which has no sum, against the stamps. Raises WireError("echo")."""
        before, self._left = self._left, got.remaining
        if before is None or not self.request.scans:  # usual case: an endless stream
            return
        if turns := self.watch.turns(got.stamp_ms):
            due = before - round(turns / (self.request.skip + 1))
            if got.remaining != due:
                self._left = None
                raise WireError("echo", f"{got.remaining} scans remain where {due} should")
