"""Session with the scanner, sans-I/O: bytes and arrival times in; checked, timed scans and bytes to write out.

    DOWN --port open--> SYNC --QT--> VERSION --VV--> GEOMETRY --PP--> STATE --II--> QUIET --MD--> STREAM --QT--> STOP
                         ^  \\                           |              |          |  ^  \\          |             |
                         |   TIMING (TM2), where QT   PROBE (%ST)    WRONG        HEALTH  LASER   |           DARK
                         |   was refused              once, if due                 (II)   (BM)    |        (II: laser
                         +-- no reply in time -------- SUSPECT (II) <-- no valid scan for long ---+         is off)

    QUIET --TM0--> TIME_ON, TIME (TM1), TIME_OFF (TM2) --> QUIET: the clock is seeded, once, before MD, if due

The session starts from any state of the sensor (streaming, in time adjustment, half a request in its buffer, asleep,
booting): an LF ends the half request, and QT is repeated until its echo comes back. A bad frame is counted by its kind
and costs that frame only. `complaint`: one line for people on the reason why the sensor cannot be used.
"""

from __future__ import annotations

from collections.abc import Sequence

from onboard.config import Lidar
from onboard.devices.lidar.clock import LidarClock
from onboard.devices.lidar.connection import Link
from onboard.devices.lidar.flood import MOST_FRAMES, FloodWatch
from onboard.devices.lidar.pending_request import Talk
from onboard.devices.lidar.phases import CONNECTING, EXCHANGES, PASSING, SEEDING, Phase
from onboard.devices.lidar.sensor_info import SensorInfo
from onboard.devices.lidar.stream import ScanStream
from onboard.devices.lidar.watch import CAUSES
from onboard.records import Chunk, PortState, Scan
from protocol import WireError, scip

BAD = ("echo", "status", "status_sum", "stamp_sum", "block_sum", "length", "character", "text", "text_sum", "overflow")
_OTHER = (
    "scans",
    "replies",
    "stray",
    "refused",
    "timeouts",
    "reconnects",
    "repeated_stamp",
    "clock_jump",
    "clock_reboot",
    "disagree",
)
_MOST_STOPS = 4  # while the laser stays on
_STREAMING = (Phase.LASER, Phase.STREAM, Phase.SUSPECT)


class LidarSession:
    """Session with one scanner; each tick call `receive`, `send`, `wants_connect`, in this order.

    counts: frames and events by name.
    flood: detector of more data than a scanner sends; nothing is used while it is flooded.
    """

    def __init__(self, config: Lidar) -> None:
        self.counts: dict[str, int] = dict.fromkeys((*_OTHER, *CAUSES, *BAD), 0)
        self.complaint = ""
        self._config = config
        self._stream = ScanStream(config, self.counts)
        self._talk, self._told = Talk(self._stream), SensorInfo(config)
        self._splitter, self._link, self.flood = scip.Splitter(), Link(), FloodWatch()
        self._wanted, self._turns = False, 1
        self._wanted_ns: int | None = None
        self._refused_quit = False
        self._stops = 0  # QT after which the laser was still on

    @property
    def info(self) -> dict[str, str]:
        """Values of VV, PP and II, and the results of %ST and TM if they were requested."""
        return self._told.info

    @property
    def ready(self) -> bool:
        """True if the sensor has reported its name, geometry and state on this connection."""
        return self._talk.phase not in CONNECTING

    @property
    def streaming(self) -> bool:
        """True if the sensor has accepted a stream on this connection, or is polled scan by scan."""
        return self._talk.phase is Phase.STREAM and not (self._talk.waiting and self.request.streams)

    @property
    def dark(self) -> bool:
        """True if its laser is off."""
        return self._talk.phase in (Phase.DOWN, Phase.QUIET)

    @property
    def request(self) -> scip.ScanRequest:
        """The measurement request for this sensor."""
        return self._stream.request

    @property
    def clock(self) -> LidarClock:
        """Estimator of the sensor's clock: `quality` gives its uncertainty, `seed` takes a TM1 exchange."""
        return self._stream.clock

    @property
    def ring_overflows(self) -> int:
        """Count of scans whose place was still leased. Not in the digest: jobs outside the tick lease places."""
        return self._stream.beams.ring.overflows

    @property
    def bad(self) -> int:
        """Number of bad frames since the start."""
        return sum(self.counts[kind] for kind in BAD)

    def stream(self, on: bool, turns: int = 1) -> None:
        """Set the wanted output: scans as configured, each of at least `turns` turns (True), or no stream (False).

        It stays over reconnects. A stream with other turns is ended first.
        """
        if on and (not self._wanted or turns != self._turns):
            self._wanted_ns = None
        self._wanted, self._turns = on, turns if on else self._turns

    def silent(self, now_ns: int) -> bool:
        """True if a stream is wanted and no valid scan came for config.silent_ns, or 4 periods and 50 ms if longer."""
        since_ns = self._wanted_ns if self._wanted else None
        return since_ns is not None and self._stream.silent(now_ns, since_ns, self._turns)

    def wants_connect(self, now_ns: int) -> bool:
        """True if the port should be (re)opened now. Each True is an attempt; the next follows 0.1 s to 2 s later."""
        return self._link.wants(now_ns)

    def farewell(self, now_ns: int) -> bytes:
        """Return QT at once, whatever is due; then call `receive` and `send` until `dark`, if there is time."""
        self._wanted = False
        if self._talk.phase is Phase.DOWN:
            return b""
        self._enter(Phase.STOP)
        return b"\n" + self._ask(now_ns)

    def digest_items(self) -> tuple[int | float | bool, ...]:
        """Values of this state that go into the state digest."""
        heard_ns, drift_ratio = self._stream.heard_ns, self._stream.clock.drift_ratio
        told = int(self._talk.phase), self._wanted, heard_ns, self._talk.sent_ns, drift_ratio
        return (*told, *self.counts.values(), self.flood.dropped_bytes)

    def receive(self, chunks: Sequence[Chunk], state: PortState, now_ns: int) -> list[Scan]:
        """Return the completed scans. Bad bytes never raise; they are in `counts`. Bytes over the limit are dropped."""
        if self._wanted and (self._wanted_ns is None or self._talk.phase in SEEDING):
            self._wanted_ns = now_ns
        self._follow_port(state, now_ns)
        scans: list[Scan] = []
        size = sum(len(data) for _, data in chunks)
        if self.flood.bytes_came(size, now_ns):
            self._splitter.clear()
            return scans
        self.flood.frames_came(*self._receive_frames(chunks, size, scans, now_ns), now_ns)
        self.counts["overflow"] = self._splitter.overflows
        return scans

    def _receive_frames(self, chunks: Sequence[Chunk], size: int, scans: list[Scan], now_ns: int) -> tuple[int, int]:
        """Use MOST_FRAMES at most; return their number and the count of the `size` bytes dropped behind them."""
        count = used = 0
        for rx_ns, data in chunks:
            for first_ns, frame in self._splitter.frames(rx_ns, data):
                if count == MOST_FRAMES:
                    self._splitter.clear()
                    return count, max(0, size - used)
                count, used = count + 1, used + len(frame) + 2
                try:
                    self._take(first_ns, frame, scans, now_ns)
                except WireError as error:
                    self._spoiled(error.kind, now_ns)
        return count, 0

    def send(self, now_ns: int) -> bytes:
        """Return the bytes to write now; empty while a reply is due, nothing is needed, or the port is down."""
        if self._talk.phase is Phase.DOWN or not self._move(now_ns):
            return b""
        return self._ask(now_ns)

    def _move(self, now_ns: int) -> bool:
        """Enter the phase of the next request; return whether one is to be sent now."""
        if self._talk.again(now_ns):
            return True
        if not self._talk.waiting:
            return self._next(now_ns)
        if not self._talk.late(now_ns, self._config.reply_timeout_ns):
            return False
        self.counts["timeouts"] += 1
        self._told.note(self._talk.exchange.note, "no reply")
        self._enter(Phase.SYNC)
        return True

    def _next(self, now_ns: int) -> bool:
        """Enter the next phase if no reply is due, by the wanted state or the time without data; return as `_move`."""
        passed_ns, before = now_ns - self._talk.sent_ns, self._talk.phase
        if before is Phase.STREAM and not (self._wanted and self._turns == self._stream.turns):
            self._stream.watch.pause()
            self._enter(Phase.STOP)
        elif before is Phase.STREAM and not self.request.streams:
            return True
        elif before is Phase.STREAM and self._stream.silent(now_ns, self._talk.sent_ns, self._turns):
            self._enter(Phase.SUSPECT)
        elif before is Phase.WRONG and passed_ns > 10 * self._config.reply_timeout_ns:
            self._enter(Phase.SYNC)
        elif before is Phase.QUIET and self._wanted and self._told.due(Phase.TIME_ON):
            self._enter(Phase.TIME_ON)
        elif before is Phase.QUIET and self._wanted:
            self._stream.thin(self._turns)
            self._enter(Phase.STREAM if self.request.streams else Phase.LASER)
        elif before is Phase.QUIET and passed_ns > self._config.health_ns:
            self._enter(Phase.HEALTH)
        return self._talk.phase is not before or self._talk.phase not in (Phase.STREAM, Phase.WRONG, Phase.QUIET)

    def _ask(self, now_ns: int) -> bytes:
        if self._talk.phase is Phase.SYNC and self._link.deaf(now_ns):
            self.complaint = self._told.nothing()
        return self._talk.ask(now_ns)

    def _enter(self, phase: Phase) -> None:
        self._talk.enter(phase)
        self._splitter.echo = self.request.line()[:13] if phase in _STREAMING else b""

    def _follow_port(self, state: PortState, now_ns: int) -> None:
        self._link.state = state
        if state is not PortState.OPEN:
            self._enter(Phase.DOWN)
        elif self._talk.phase is Phase.DOWN:
            self.counts["reconnects"] += self._link.opened(now_ns)
            self._refused_quit = False
            self._told.restart()
            self._splitter.clear()
            self._stream.clock.restart()
            self._enter(Phase.SYNC)

    def _spoiled(self, kind: str, now_ns: int) -> None:
        """Handle a bad frame. It may have been the reply that is due: ask again, a few times."""
        self.counts[kind if self._talk.phase > Phase.TIMING else "stray"] += 1
        asked = self._talk.exchange
        if self._talk.waiting and asked.timed and asked.refused is not None:
            self._told.note(asked.note, f"damaged after {self._told.seeds} exchanges")
            self._enter(asked.refused)
        elif self._talk.waiting and self._talk.phase not in (Phase.STREAM, Phase.SYNC, Phase.SUSPECT):
            self._talk.repeat(now_ns)

    def _take(self, rx_ns: int, frame: memoryview, scans: list[Scan], now_ns: int) -> None:
        if self._talk.phase in _STREAMING and self._stream.has(frame):
            remaining, scan = self._stream.take(frame, rx_ns)
            if self._talk.phase is Phase.STREAM:
                self._talk.waiting = b""  # the reply to the stream request may be lost
            scans += [scan] if scan is not None else []
            if self._talk.phase is Phase.SUSPECT or self._stream.last(remaining):
                self._enter(Phase.QUIET if self.request.streams and self._stream.last(remaining) else Phase.STREAM)
            return
        answer = scip.parse_reply(bytes(frame))
        if answer.echo == self._talk.waiting and answer.status != "99":
            self._link.answered(now_ns)
            self._answered(answer, rx_ns, now_ns)
            return
        if self._talk.phase is Phase.STREAM and answer.echo[:13] == self._splitter.echo:
            self.complaint = f"the sensor stopped: {scip.meaning(self.request.code, answer.status)}"
            raise WireError("status", answer.status)
        self.counts["stray"] += 1
        if self._talk.phase is Phase.QUIET and answer.status == "99":
            self._enter(Phase.STOP)  # some sensors miss the first QT

    def _answered(self, answer: scip.Reply, rx_ns: int, now_ns: int) -> None:
        self.counts["replies"] += 1
        code = self.request.code if self._talk.phase is Phase.STREAM else scip.parse_request(answer.echo).code
        if not scip.succeeded(code, answer.status):
            self._refused(code, answer.status, now_ns)
            return
        if self._talk.exchange.twice:
            if not self._talk.read(answer, self.counts, now_ns) or not self._heard(scip.parse_text(answer)):
                return
        elif self._talk.phase is Phase.PROBE:
            self._told.note("%ST", scip.state_text(scip.parse_state(answer.body)))
        elif self._talk.phase is Phase.TIME:
            stamp_ms = scip.parse_stamp(answer.body)
            if not self._told.seed(self._stream.clock, stamp_ms, self._talk.sent_ns, rx_ns):
                self._enter(Phase.TIME)
                return
        self._go_on()

    def _go_on(self) -> None:
        """Enter the phase that follows; skip the probe if it is not due."""
        then = self._talk.exchange.then
        if self._talk.phase is Phase.STREAM:
            self._talk.waiting = b""
            self._stream.begin()
        elif then is Phase.PROBE and not self._told.due(then):
            self._enter(EXCHANGES[then].then)
        else:
            self._enter(then)

    def _refused(self, code: str, status: str, now_ns: int) -> None:
        self.counts["refused"] += 1
        if self._talk.phase is Phase.SYNC and not self._refused_quit:
            self._refused_quit = True  # once: in time adjustment some sensors accept only TM
            self._enter(Phase.TIMING)
        elif self._talk.exchange.refused is not None:
            self._told.note(self._talk.exchange.note, f"{status}: {scip.meaning(code, status)}")
            self._enter(self._talk.exchange.refused)
        elif self._talk.phase is Phase.STREAM and status == "10" and not self.request.streams:
            self._enter(Phase.LASER)
        elif status in PASSING or self._talk.phase in CONNECTING:
            self._talk.put_off(now_ns)
        else:
            self.complaint = f"the sensor refuses {code} ({status}: {scip.meaning(code, status)}); see [lidar]"
            self._enter(Phase.WRONG)

    def _heard(self, pairs: dict[str, str]) -> bool:
        """Handle a text reply that was read twice alike. False: the session has changed to another phase."""
        self._told.add(self._talk.phase, pairs)
        if self._talk.phase is Phase.GEOMETRY:
            self._link.known()
        elif self._talk.phase is Phase.STATE:
            return self._known()
        elif self._talk.phase is Phase.DARK and pairs.get("LASR", "OFF").startswith("ON") and self._stops < _MOST_STOPS:
            self._stops += 1
            self._enter(Phase.STOP)
            return False
        self._stops = 0
        if "STAT" in pairs:
            self._stream.watch.health(pairs, laser_wanted=self._talk.phase is Phase.SUSPECT)
        return True

    def _known(self) -> bool:
        self.complaint = self._told.stranger()
        if self.complaint:
            self._enter(Phase.WRONG)
            return False
        self._stream.learn(self._told.model, "USB" in self.info.get("SBPS", "USB"))
        self._stream.watch.health(self.info, laser_wanted=False)
        return True
