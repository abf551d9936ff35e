"""The session with the scanner, without I/O: bytes and arrivals in, checked and timed scans out, and what to write.

    DOWN --port open--> SYNC --QT--> VERSION --VV--> GEOMETRY --PP--> QUIET --MD--> STREAM --QT--> STOP --> QUIET
                          ^                                                            |
                          +-------- no answer, refused, or no valid scan for reply_timeout_ns

Whatever state the sensor is in (streaming, in time adjustment, half a request in its buffer): an LF ends the half
request, QT is repeated until its echo comes back. A bad frame is counted by its kind and costs that frame alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from enum import IntEnum

import numpy as np

from onboard.config import Lidar
from onboard.devices.lidar_clock import LidarClock
from onboard.records import U8, BeamStatus, Chunk, PortState, Scan
from protocol import WireError, scip

BAD = ("echo", "status", "status_sum", "stamp_sum", "block_sum", "length", "character", "text", "text_sum", "overflow")
_OTHER = ("scans", "replies", "stray", "refused", "timeouts", "reconnects", "repeated_stamp", "clock_jump")
_FIRST_BACKOFF_NS, _LAST_BACKOFF_NS = 100_000_000, 2_000_000_000
_CODES = {1: BeamStatus.NO_RETURN, 2: BeamStatus.TOO_NEAR, 4: BeamStatus.TOO_NEAR}  # table 4; 0, 3, 5 and others: ERROR


class Phase(IntEnum):
    """Where the session stands."""

    DOWN = 0
    SYNC = 1
    VERSION = 2
    GEOMETRY = 3
    QUIET = 4
    STREAM = 5
    STOP = 6


_COMMANDS = {
    Phase.SYNC: scip.request("QT"), Phase.VERSION: scip.request("VV"), Phase.GEOMETRY: scip.request("PP"),
    Phase.STOP: scip.request("QT"),
}  # fmt: skip


class LidarSession:
    """One scanner. Each tick `receive`, `send`, `wants_connect`, in this order. counts: by name; info: of VV and PP."""

    def __init__(self, config: Lidar) -> None:
        self.counts: dict[str, int] = dict.fromkeys((*_OTHER, *BAD), 0)
        self.info: dict[str, str] = {}
        self._config = config
        self._clock = LidarClock(config.latency_ns)
        self._splitter = scip.Splitter()
        self._phase = Phase.DOWN
        self._state = PortState.CLOSED
        self._connections = 0
        self._backoff_ns = _FIRST_BACKOFF_NS
        self._next_attempt_ns = 0
        self._wanted = False
        self._wanted_ns: int | None = None
        self._heard_ns = 0
        self._waiting = b""  # the request whose reply is due, without LF
        self._sent_ns = 0
        self._leave_timing = False
        self._request = scip.ScanRequest("MD", 0, 1080)
        self._first_angle_rad = -0.75 * math.pi
        self._step_rad = math.pi / 720
        self._beam_ns = 25e6 / 1440
        self._status_of = _status_table(23)

    # -- what the core asks ------------------------------------------------------------------------------------

    @property
    def ready(self) -> bool:
        """Whether the sensor has told its name and geometry on this connection."""
        return self._phase >= Phase.QUIET

    @property
    def streaming(self) -> bool:
        """Whether the sensor was asked to stream on this connection and has agreed."""
        return self._phase is Phase.STREAM and not self._waiting

    @property
    def bad(self) -> int:
        """Bad frames so far, of all kinds."""
        return sum(self.counts[kind] for kind in BAD)

    def stream(self, on: bool) -> None:
        """Wanted from now on: all beams, endless (True), or quiet (False). Kept over reconnects."""
        if on and not self._wanted:
            self._wanted_ns = None
        self._wanted = on

    def silent(self, now_ns: int) -> bool:
        """Whether streaming is wanted and there was no valid scan for config.silent_ns."""
        if not self._wanted or self._wanted_ns is None:
            return False
        return now_ns - max(self._heard_ns, self._wanted_ns) > self._config.silent_ns

    def wants_connect(self, now_ns: int) -> bool:
        """Whether the port should be (re)opened now. Each True is an attempt: the next comes later, 0.1 s to 2 s."""
        if self._state is PortState.OPEN or now_ns < self._next_attempt_ns:
            return False
        self._next_attempt_ns = now_ns + self._backoff_ns
        self._backoff_ns = min(2 * self._backoff_ns, _LAST_BACKOFF_NS)
        return True

    def digest_items(self) -> tuple[int | float | bool, ...]:
        """Plain values that tell two states apart."""
        clock = self._clock
        return (int(self._phase), self._wanted, self._heard_ns, self._sent_ns, clock.drift_ratio, *self.counts.values())

    # -- the stream --------------------------------------------------------------------------------------------

    def receive(self, chunks: Sequence[Chunk], state: PortState, now_ns: int) -> list[Scan]:
        """The scans that became complete. Bad bytes never raise; they are in `counts`."""
        if self._wanted and self._wanted_ns is None:
            self._wanted_ns = now_ns
        self._follow_port(state)
        scans: list[Scan] = []
        for rx_ns, data in chunks:
            for first_ns, frame in self._splitter.receive(rx_ns, data):
                try:
                    self._take(first_ns, frame, scans)
                except WireError as error:
                    kind = error.kind if self._phase > Phase.SYNC else "stray"
                    self.counts[kind] += 1
        self.counts["overflow"] = self._splitter.overflows
        return scans

    def send(self, now_ns: int) -> bytes:
        """The bytes to write now; empty while a reply is due, while all is as wanted, and while the port is down."""
        if self._phase is Phase.DOWN:
            return b""
        if self._waiting:
            if now_ns - self._sent_ns < self._config.reply_timeout_ns:
                return b""
            self.counts["timeouts"] += 1
            self._enter(Phase.SYNC)
        elif self._phase is Phase.STREAM:
            if not self._wanted:
                self._enter(Phase.STOP)
            elif now_ns - max(self._heard_ns, self._sent_ns) > self._config.reply_timeout_ns:
                self.counts["timeouts"] += 1
                self._enter(Phase.SYNC)
            else:
                return b""
        elif self._phase is Phase.QUIET:
            if not self._wanted:
                return b""
            self._enter(Phase.STREAM)
        return self._ask(now_ns)

    def _ask(self, now_ns: int) -> bytes:
        command = _COMMANDS.get(self._phase) or self._request.line() + b"\n"
        self._waiting, self._sent_ns = command[:-1], now_ns
        if self._phase is not Phase.SYNC:
            return command
        leave, self._leave_timing = self._leave_timing, False
        return b"\n" + (scip.request("TM", "2") if leave else b"") + command

    # -- inside ------------------------------------------------------------------------------------------------

    def _enter(self, phase: Phase) -> None:
        self._phase, self._waiting = phase, b""
        self._splitter.echo = self._request.line()[:13] if phase is Phase.STREAM else b""

    def _follow_port(self, state: PortState) -> None:
        self._state = state
        if state is not PortState.OPEN:
            self._enter(Phase.DOWN)
        elif self._phase is Phase.DOWN:
            self.counts["reconnects"] += self._connections > 0
            self._connections += 1
            self._splitter.clear()
            self._clock.restart()
            self._enter(Phase.SYNC)

    def _take(self, rx_ns: int, frame: bytes, scans: list[Scan]) -> None:
        answer = scip.parse_reply(frame)
        if answer.echo == self._waiting:
            if answer.status == "99":
                self._waiting = b""  # the word that the stream is on was lost
            else:
                self._answered(answer)
                return
        if self._phase is not Phase.STREAM:
            self.counts["stray"] += 1
            if self._phase is Phase.QUIET and answer.status == "99":
                self._enter(Phase.STOP)  # some sensors miss the first QT
            return
        scan = self._scan(scip.parse_scan(answer, self._request), rx_ns)
        if scan is not None:
            scans.append(scan)

    def _answered(self, answer: scip.Reply) -> None:
        self.counts["replies"] += 1
        if answer.status not in ("00", "02"):
            self.counts["refused"] += 1
            self._leave_timing = True
            return  # it stays due: the session begins anew at its timeout, so a refusal is never asked for in a hurry
        if self._phase is Phase.VERSION:
            self.info = scip.parse_text(answer)
        elif self._phase is Phase.GEOMETRY:
            self._learn(scip.parse_text(answer))
        following = {Phase.SYNC: Phase.VERSION, Phase.VERSION: Phase.GEOMETRY, Phase.GEOMETRY: Phase.QUIET,
                     Phase.STOP: Phase.QUIET, Phase.STREAM: Phase.STREAM}  # fmt: skip
        self._enter(following[self._phase])

    def _learn(self, pairs: Mapping[str, str]) -> None:
        try:
            low, high, front, steps, rpm, near = (
                int(pairs[key]) for key in ("AMIN", "AMAX", "AFRT", "ARES", "SCAN", "DMIN")
            )
        except (KeyError, ValueError) as error:
            raise WireError("text", f"PP: {error}") from error
        if not (0 <= low < high < 10_000 > abs(front) and 0 < steps < 100_000 > rpm > 0 and 0 < near < 1000):
            raise WireError("text", f"PP: {dict(pairs)}")
        self.info = {**self.info, **pairs}
        self._request = scip.ScanRequest("MD", low, high)
        self._first_angle_rad = (low - front) * math.tau / steps
        self._step_rad = math.tau / steps
        self._beam_ns = 60e9 / rpm / steps
        self._status_of = _status_table(near)
        self._clock.restart(60e3 / rpm)
        self._backoff_ns = _FIRST_BACKOFF_NS

    def _scan(self, got: scip.ScanReply, rx_ns: int) -> Scan | None:
        stamp_ns = self._clock.observe(got.stamp_ms, rx_ns)
        self.counts["repeated_stamp"] = self._clock.repeated
        self.counts["clock_jump"] = self._clock.jumps
        if stamp_ns is None:
            return None
        self.counts["scans"] += 1
        self._heard_ns = max(self._heard_ns, rx_ns)
        status = self._status_of[np.minimum(got.values, len(self._status_of) - 1)]
        ranges_m = got.values.astype(np.float32) * np.float32(1e-3)
        ranges_m[status != BeamStatus.OK] = np.nan
        start_ns = stamp_ns + round((self._request.first - self._config.reference_step) * self._beam_ns)
        return Scan(start_ns, self._beam_ns, self._first_angle_rad, self._step_rad, ranges_m, status)


def _status_table(near_mm: int) -> U8:
    """BeamStatus of the values 0 to near_mm; what is below DMIN is a code, what is above is a range."""
    table = np.full(near_mm + 1, BeamStatus.ERROR, np.uint8)
    for code, status in _CODES.items():
        table[code] = status
    table[near_mm:] = BeamStatus.OK
    return table
