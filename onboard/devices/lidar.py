"""The session with the scanner, without I/O: bytes and arrivals in, checked and timed scans out, and what to write.

    DOWN --port open--> SYNC --QT--> VERSION --VV--> GEOMETRY --PP--> STATE --II--> QUIET --MD--> STREAM --QT--> STOP
                         ^  \\                                            |          |  ^  \\          |             |
                         |   TIMING (TM2), where QT was refused        WRONG        HEALTH  LASER   |           DARK
                         |                                                           (II)   (BM)    |        (II: laser
                         +-- no reply in time -------- SUSPECT (II) <-- no valid scan for long -----+         is off)

Whatever state the sensor is in (streaming, in time adjustment, half a request in its buffer, asleep, booting): an LF
ends the half request, QT is repeated until its echo comes back. A bad frame is counted by its kind and costs that frame
alone. `complaint`: one line for people on what keeps the sensor from being used.
"""

from __future__ import annotations

from collections.abc import Sequence

from onboard.config import Lidar
from onboard.devices.lidar_clock import LidarClock
from onboard.devices.lidar_exchange import AGAIN_NS, EXCHANGES, PASSING, TRIES, Exchange, Phase, comparable
from onboard.devices.lidar_model import UTM_30LX, model_of
from onboard.devices.lidar_stream import ScanStream
from onboard.devices.lidar_watch import CAUSES
from onboard.records import Chunk, PortState, Scan
from protocol import WireError, scip

BAD = ("echo", "status", "status_sum", "stamp_sum", "block_sum", "length", "character", "text", "text_sum", "overflow")
_OTHER = ("scans", "replies", "stray", "refused", "timeouts", "reconnects", "repeated_stamp", "clock_jump",
          "clock_reboot", "disagree")
_FIRST_BACKOFF_NS, _LAST_BACKOFF_NS = 100_000_000, 2_000_000_000
_DEAF_NS = 2_000_000_000  # without an answer, before somebody is told
_STREAMING = (Phase.LASER, Phase.STREAM, Phase.SUSPECT)


class LidarSession:
    """One scanner. Each tick `receive`, `send`, `wants_connect`, in this order.

    counts: by name; info: what VV, PP and II said.
    """

    def __init__(self, config: Lidar) -> None:
        self.counts: dict[str, int] = dict.fromkeys((*_OTHER, *CAUSES, *BAD), 0)
        self.info: dict[str, str] = {}
        self.complaint = ""
        self._config = config
        self._stream = ScanStream(config, self.counts)
        self._splitter = scip.Splitter()
        self._phase, self._state = Phase.DOWN, PortState.CLOSED
        self._connections = 0
        self._backoff_ns = _FIRST_BACKOFF_NS
        self._next_attempt_ns = 0
        self._wanted = False
        self._wanted_ns: int | None = None
        self._answered_ns: int | None = None  # the last reply, or the begin of the connection
        self._waiting = b""  # the request whose reply is due, without LF
        self._sent_ns = 0
        self._again_ns: int | None = None  # when to ask once more, if before the limit
        self._tries = 0
        self._first_reading: bytes | dict[str, str] | None = None
        self._refused_quit = False
        self._model = UTM_30LX
        self._stops = 0  # QT after which the laser was still on

    # -- what the core asks ------------------------------------------------------------------------------------

    @property
    def ready(self) -> bool:
        """Whether the sensor has told its name, geometry and state on this connection."""
        return self._phase >= Phase.QUIET

    @property
    def streaming(self) -> bool:
        """Whether the sensor was asked to stream on this connection and has agreed, or is asked scan by scan."""
        return self._phase is Phase.STREAM and not (self._waiting and self.request.streams)

    @property
    def dark(self) -> bool:
        """Whether the sensor has stopped and its laser is off."""
        return self._phase in (Phase.DOWN, Phase.QUIET)

    @property
    def request(self) -> scip.ScanRequest:
        """What this sensor is asked for."""
        return self._stream.request

    @property
    def clock(self) -> LidarClock:
        """The sensor's clock: `quality` tells how well it is known, `seed` takes a TM1 exchange."""
        return self._stream.clock

    @property
    def ring_overflows(self) -> int:
        """How often a scan found its place leased; no part of the state, for jobs beside the tick hold places."""
        return self._stream.beams.ring.overflows

    @property
    def bad(self) -> int:
        """Bad frames so far."""
        return sum(self.counts[kind] for kind in BAD)

    def stream(self, on: bool) -> None:
        """Wanted from now on: scans as configured (True), or quiet (False). Kept over reconnects."""
        if on and not self._wanted:
            self._wanted_ns = None
        self._wanted = on

    def silent(self, now_ns: int) -> bool:
        """Whether streaming is wanted and there was no valid scan for config.silent_ns, or 4 periods and 50 ms."""
        if not self._wanted or self._wanted_ns is None:
            return False
        return now_ns - max(self._stream.heard_ns, self._wanted_ns) > self._stream.silent_ns

    def wants_connect(self, now_ns: int) -> bool:
        """Whether the port should be (re)opened now. Each True is an attempt: the next comes later, 0.1 s to 2 s."""
        if self._state is PortState.OPEN or now_ns < self._next_attempt_ns:
            return False
        self._next_attempt_ns = now_ns + self._backoff_ns
        self._backoff_ns = min(2 * self._backoff_ns, _LAST_BACKOFF_NS)
        return True

    def farewell(self, now_ns: int) -> bytes:
        """QT at once, whatever is due; then `receive` and `send` until `dark`, where there is time for it."""
        self._wanted = False
        if self._phase is Phase.DOWN:
            return b""
        self._enter(Phase.STOP)
        return b"\n" + self._ask(now_ns)

    def digest_items(self) -> tuple[int | float | bool, ...]:
        """Plain values that tell two states apart."""
        heard_ns, drift_ratio = self._stream.heard_ns, self._stream.clock.drift_ratio
        return (int(self._phase), self._wanted, heard_ns, self._sent_ns, drift_ratio, *self.counts.values())

    def receive(self, chunks: Sequence[Chunk], state: PortState, now_ns: int) -> list[Scan]:
        """The scans that became complete. Bad bytes never raise; they are in `counts`."""
        if self._wanted and self._wanted_ns is None:
            self._wanted_ns = now_ns
        self._follow_port(state, now_ns)
        scans: list[Scan] = []
        for rx_ns, data in chunks:
            for first_ns, frame in self._splitter.frames(rx_ns, data):
                try:
                    self._take(first_ns, frame, scans, now_ns)
                except WireError as error:
                    self._spoiled(error.kind, now_ns)
        self.counts["overflow"] = self._splitter.overflows
        return scans

    def send(self, now_ns: int) -> bytes:
        """The bytes to write now; empty while a reply is due, while all is as wanted, and while the port is down."""
        if self._phase is Phase.DOWN or not self._move(now_ns):
            return b""
        return self._ask(now_ns)

    def _move(self, now_ns: int) -> bool:
        """Whether something is to be asked now; goes to the phase that asks it."""
        if self._again_ns is not None and now_ns >= self._again_ns:
            return True
        if not self._waiting:
            return self._next(now_ns)
        if now_ns - self._sent_ns < min(self._exchange.limit_ns, self._config.reply_timeout_ns):
            return False
        self.counts["timeouts"] += 1
        self._enter(Phase.SYNC)
        return True

    def _next(self, now_ns: int) -> bool:
        """The same where no reply is due: what is wanted decides, or how long nothing came."""
        passed_ns, before = now_ns - self._sent_ns, self._phase
        if before is Phase.STREAM and not self._wanted:
            self._enter(Phase.STOP)
        elif before is Phase.STREAM and not self.request.streams:
            return True
        elif before is Phase.STREAM and now_ns - max(self._stream.heard_ns, self._sent_ns) > self._stream.silent_ns:
            self._enter(Phase.SUSPECT)
        elif before is Phase.WRONG and passed_ns > 10 * self._config.reply_timeout_ns:
            self._enter(Phase.SYNC)
        elif before is Phase.QUIET and self._wanted:
            self._enter(Phase.STREAM if self.request.streams else Phase.LASER)
        elif before is Phase.QUIET and passed_ns > self._config.health_ns:
            self._enter(Phase.HEALTH)
        return self._phase is not before or self._phase not in (Phase.STREAM, Phase.WRONG, Phase.QUIET)

    def _ask(self, now_ns: int) -> bytes:
        command = self._exchange.command
        self._waiting, self._sent_ns, self._again_ns = command[:-1], now_ns, None
        self._tell_deaf(now_ns)
        return b"\n" + command if self._phase is Phase.SYNC else command

    @property
    def _exchange(self) -> Exchange:
        return EXCHANGES.get(self._phase) or Exchange(self.request.line() + b"\n", Phase.STREAM)

    def _enter(self, phase: Phase) -> None:
        self._phase, self._waiting = phase, b""
        self._again_ns, self._tries, self._first_reading = None, 0, None
        self._splitter.echo = self.request.line()[:13] if phase in _STREAMING else b""

    def _follow_port(self, state: PortState, now_ns: int) -> None:
        self._state = state
        if state is not PortState.OPEN:
            self._enter(Phase.DOWN)
        elif self._phase is Phase.DOWN:
            self.counts["reconnects"] += self._connections > 0
            self._connections += 1
            self._answered_ns, self._refused_quit = now_ns, False
            self._splitter.clear()
            self._stream.clock.restart()
            self._enter(Phase.SYNC)

    def _spoiled(self, kind: str, now_ns: int) -> None:
        """A frame was bad. It may have been the reply that is due: ask again, a few times."""
        self.counts[kind if self._phase > Phase.TIMING else "stray"] += 1
        if self._waiting and self._phase not in (Phase.STREAM, Phase.SYNC, Phase.SUSPECT) and self._tries < TRIES:
            self._tries += 1
            self._again_ns = now_ns

    def _take(self, rx_ns: int, frame: memoryview, scans: list[Scan], now_ns: int) -> None:
        if self._phase in _STREAMING and self._stream.has(frame):
            remaining, scan = self._stream.take(frame, rx_ns)
            self._waiting = b"" if self._phase is Phase.STREAM else self._waiting  # that the stream is on may be lost
            scans += [scan] if scan is not None else []
            if self._phase is Phase.SUSPECT or self._stream.last(remaining):
                self._enter(Phase.QUIET if self.request.streams and self._stream.last(remaining) else Phase.STREAM)
            return
        answer = scip.parse_reply(bytes(frame))
        if answer.echo == self._waiting and answer.status != "99":
            self._answered_ns = now_ns
            self._answered(answer, now_ns)
            return
        if self._phase is Phase.STREAM and answer.echo[:13] == self._splitter.echo:
            self.complaint = f"the sensor stopped: {scip.meaning(self.request.code, answer.status)}"
            raise WireError("status", answer.status)
        self.counts["stray"] += 1
        if self._phase is Phase.QUIET and answer.status == "99":
            self._enter(Phase.STOP)  # some sensors miss the first QT

    def _answered(self, answer: scip.Reply, now_ns: int) -> None:
        self.counts["replies"] += 1
        code = self.request.code if self._phase is Phase.STREAM else answer.echo[:2].decode()
        if not scip.succeeded(code, answer.status):
            self._refused(code, answer.status, now_ns)
            return
        if self._exchange.twice:
            reading = comparable(answer)
            if self._first_reading != reading:
                self.counts["disagree"] += self._first_reading is not None
                self._first_reading, self._again_ns = reading, now_ns
                return
            if not self._told(scip.parse_text(answer)):
                return
        if self._phase is Phase.STREAM:
            self._waiting = b""
            self._stream.begin()
        else:
            self._enter(self._exchange.then)

    def _refused(self, code: str, status: str, now_ns: int) -> None:
        self.counts["refused"] += 1
        if self._phase is Phase.SYNC and not self._refused_quit:
            self._refused_quit = True  # once: in time adjustment some sensors take nothing but TM
            self._enter(Phase.TIMING)
        elif self._phase is Phase.TIMING:
            self._enter(Phase.SYNC)
        elif self._phase is Phase.STREAM and status == "10" and not self.request.streams:
            self._enter(Phase.LASER)
        elif status in PASSING or self._phase <= Phase.STATE:
            self._again_ns = now_ns + AGAIN_NS
        else:
            self.complaint = f"the sensor refuses {code} ({status}: {scip.meaning(code, status)}); see [lidar]"
            self._enter(Phase.WRONG)

    def _told(self, pairs: dict[str, str]) -> bool:
        """A text reply was read twice alike. False: the session has gone elsewhere."""
        self.info = {**self.info, **pairs}
        if self._phase is Phase.GEOMETRY:
            self._model = model_of(pairs)
            self._backoff_ns = _FIRST_BACKOFF_NS
        elif self._phase is Phase.STATE:
            return self._known()
        elif self._phase is Phase.DARK and pairs.get("LASR", "OFF").startswith("ON") and self._stops < TRIES:
            self._stops += 1
            self._enter(Phase.STOP)
            return False
        self._stops = 0
        if "STAT" in pairs:
            self._stream.watch.health(pairs, laser_wanted=self._phase is Phase.SUSPECT)
        return True

    def _known(self) -> bool:
        name = f"{self.info.get('PROD', '')} {self._model.name}"
        if self._config.model not in name:
            self.complaint = (f"the sensor is a {name.strip()!r}, lidar.model = {self._config.model!r}: "
                              "connect the right one or name it in lidar.model")  # fmt: skip
            self._enter(Phase.WRONG)
            return False
        self._stream.learn(self._model, "USB" in self.info.get("SBPS", "USB"))
        self._stream.watch.health(self.info, laser_wanted=False)
        self.complaint = ""
        return True

    def _tell_deaf(self, now_ns: int) -> None:
        if self._answered_ns is not None and now_ns - self._answered_ns > _DEAF_NS and self._phase is Phase.SYNC:
            self.complaint = (f"no SCIP answer on {self._config.address}: is this a Hokuyo, is it powered, and is the "
                              "bit rate right (tty:PATH@115200)?")  # fmt: skip
