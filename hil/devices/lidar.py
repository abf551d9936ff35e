"""The scanner's twin: a UTM-30LX that speaks SCIP 2.0, without I/O. Its bytes go out with the time they reach the wire.

It turns for ever, 25 ms a turn of its own clock; a turn is 1440 steps, of which 1081 are beams and the rest is blind:

    turn k       |beam 0 ............ beam 1080|  blind  |beam 0 ...            17.36 us from beam to beam
    wire                                        ^ + latency: first byte of the scan of turn k

All that can differ between sensors and links is in `lidar_profile.Profile`. The state machine follows C-42-03320B and
the logs of real sensors, as far as public drivers use it; nothing here was tried against a physical sensor.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hil.devices.lidar_profile import IDEAL, PARAMETERS, VERSION, Profile
from protocol import scip

BEAMS, STEPS_A_TURN, FRONT_STEP = 1081, 1440, 540
NO_RETURN, TOO_NEAR = 1, 2
Cast = Callable[[NDArray[np.int64]], NDArray[np.float64]]


class Lidar:
    """One sensor. `cast(times_ns)` gives the 1081 ranges (m, inf = nothing there) of beams fired at these times.

    The bench calls receive, step and send in this order each tick. `scans` counts the turns that were cast.
    For injections, at any time: `garble_ratio` of the scans leave with one byte changed, `dropout_ratio` of the beams
    return nothing, replies and scans leave `slow_ns` later, while `stalled` no byte leaves; reboot() and jump_clock().
    """

    def __init__(self, seed: int, cast: Cast, profile: Profile = IDEAL) -> None:
        self.profile = profile
        self.connected = False
        self.laser_on = False
        self.garble_ratio = 0.0
        self.dropout_ratio = profile.dropout_ratio
        self.slow_ns = 0
        self.stalled = False
        self.scans = 0
        self._cast = cast
        self._rng = np.random.default_rng(seed)
        self._turn_ns = profile.turn_ns / (1.0 + profile.rate_error)  # of bench time
        self._beam_offsets_ns = np.arange(BEAMS) * (self._turn_ns / STEPS_A_TURN)
        self._sweep_ns = float(self._beam_offsets_ns[-1])
        self._turn = 0  # the next turn whose sweep is not over
        self._zero_ms = -profile.start_ms  # of the sensor's clock
        self._now_ns = 0
        self._timing = False  # in time adjustment (TM0 to TM2)
        self._input = bytearray()
        self._output: deque[tuple[int, bytes]] = deque()
        self._last_out_ns = 0
        self._wanted: scip.ScanRequest | None = None
        self._wanted_echo = b""
        self._from_ns = 0  # a scan belongs to the request if its sweep began after this
        self._left = 0
        self._skipped = 0

    # -- the wire ----------------------------------------------------------------------------------------------

    def connect(self) -> None:
        """A client opened the port."""
        self.connected = True

    def disconnect(self) -> None:
        """The client or the cable is gone. What was on its way is lost; over TCP stream and half requests as well."""
        self.connected = False
        self._output.clear()
        if not self.profile.usb:
            self._input.clear()
            self._stop()

    def receive(self, data: bytes, now_ns: int) -> None:
        """Bytes of the client, arrived at `now_ns`. A request ends at LF or CR; an empty one is not answered."""
        self._now_ns = max(self._now_ns, now_ns)
        self._input += data.replace(b"\r", b"\n")
        *lines, rest = self._input.split(b"\n")
        self._input = bytearray(rest[-256:])
        for line in lines:
            if line:
                self._answer(scip.parse_request(bytes(line)))

    def step(self, now_ns: int) -> None:
        """Let time pass: every sweep that ended by `now_ns` is cast, encoded and queued."""
        self._now_ns = max(self._now_ns, now_ns)
        ended = int((self._now_ns - self._sweep_ns) // self._turn_ns)
        if self._wanted is None or (self.profile.usb and not self.connected):
            self._turn = max(self._turn, ended + 1)
        while self._turn <= ended:
            start_ns = self._turn * self._turn_ns
            self._turn += 1
            if self._wanted is not None and start_ns >= self._from_ns:
                self._scan(self._wanted, start_ns)

    def send(self) -> list[tuple[int, bytes]]:
        """(time on the wire, bytes) of all that left since the last call, in order."""
        out: list[tuple[int, bytes]] = []
        while self._output and self._output[0][0] <= self._now_ns:
            piece = self._output.popleft()
            if self.connected and not self.stalled:
                out.append(piece)
        return out

    def reboot(self) -> None:
        """Power off and on: standby, laser off, timer at zero, all that was on its way lost."""
        self._stop()
        self._input.clear()
        self._output.clear()
        self._zero_ms = self._now_ns * (1.0 + self.profile.rate_error) * 1e-6

    def jump_clock(self, by_ms: float) -> None:
        """The sensor's counter jumps."""
        self._zero_ms -= by_ms

    # -- time --------------------------------------------------------------------------------------------------

    def clock_ms(self, at_ns: float) -> int:
        """The sensor's own counter at a bench time: whole milliseconds, 24 bits."""
        return int(at_ns * (1.0 + self.profile.rate_error) * 1e-6 - self._zero_ms) % scip.STAMP_MODULUS

    def _queue(self, at_ns: float, data: bytes) -> None:
        self._last_out_ns = max(self._last_out_ns, int(at_ns))
        self._output.append((self._last_out_ns, data))

    def _reply(self, asked: scip.Request, status: str, lines: bytes = b"", *, quick: bool = False) -> None:
        tick_ns, at_ns = self.profile.reply_tick_ns, self._now_ns
        if quick:
            at_ns += self.profile.time_reply_ns
        elif tick_ns:
            at_ns = (at_ns // tick_ns + 1) * tick_ns
        self._queue(at_ns + self.slow_ns, scip.reply(asked.echo, status, lines))

    # -- commands ----------------------------------------------------------------------------------------------

    def _answer(self, asked: scip.Request) -> None:
        rows = {"VV": self._version, "PP": self._version, "II": self._state, "BM": self._laser, "QT": self._quiet,
                "RS": self._reset, "RT": self._reset, "TM": self._time, "CR": self._refuse, "HS": self._refuse,
                "SS": self._refuse}  # fmt: skip
        scans = dict.fromkeys(("MD", "MS", "ME", "GD", "GS", "GE"), self._measure)
        row = (rows | scans).get(asked.code)
        if asked.status != "00" or row is None:
            self._reply(asked, asked.status if asked.status != "00" else "0E")
        elif self._timing and asked.code not in ("TM", "QT", "RS", "RT"):
            self._reply(asked, "10")
        elif asked.parameters and asked.code in ("VV", "PP", "II", "BM", "QT", "RS", "RT"):
            self._reply(asked, "0D")
        else:
            row(asked)

    def _version(self, asked: scip.Request) -> None:
        table = VERSION if asked.code == "VV" else PARAMETERS
        self._reply(asked, "00", b"".join(scip.text_line(*pair) for pair in table))

    def _state(self, asked: scip.Request) -> None:
        rows = (
            ("MODL", PARAMETERS[0][1]), ("LASR", "ON" if self.laser_on else "OFF"),
            ("SCSP", "Initial(2400[rpm])<-Default setting by user"),
            ("MESM", "CLASSIC" if self._wanted else "IDLE"), ("SBPS", "USB Full Speed"),
            ("TIME", f"{self.clock_ms(self._now_ns):06X}"), ("STAT", "Sensor works well."),
        )  # fmt: skip
        self._reply(asked, "00", b"".join(scip.text_line(*row) for row in rows))

    def _laser(self, asked: scip.Request) -> None:
        self._reply(asked, "02" if self.laser_on else "00")
        self.laser_on = True

    def _stop(self) -> None:
        self._wanted, self._timing, self.laser_on = None, False, False

    def _quiet(self, asked: scip.Request) -> None:
        self._stop()
        self._reply(asked, "00")

    def _reset(self, asked: scip.Request) -> None:
        self._stop()
        self._zero_ms = self._now_ns * (1.0 + self.profile.rate_error) * 1e-6
        self._reply(asked, "00")

    def _refuse(self, asked: scip.Request) -> None:
        self._reply(asked, {"CR": "04", "HS": "03", "SS": "04"}[asked.code])

    def _time(self, asked: scip.Request) -> None:
        what = asked.parameters
        if what == "0":
            was, self._timing, self._wanted, self.laser_on = self._timing, True, None, False
            self._reply(asked, "02" if was else "00")
        elif what == "1":
            status = "00" if self._timing else "04"
            stamp = scip.stamp_line(self.clock_ms(self._now_ns + self.profile.time_reply_ns / 2))
            self._reply(asked, status, stamp if self._timing else b"", quick=True)
        elif what == "2":
            was, self._timing = self._timing, False
            self._reply(asked, "00" if was else "03")
        else:
            self._reply(asked, "01")

    def _measure(self, asked: scip.Request) -> None:
        made = scip.parse_scan_request(asked, BEAMS - 1)
        if isinstance(made, str):
            self._reply(asked, made)
            return
        if not made.streams and not self.laser_on:
            self._reply(asked, "10")
            return
        if made.streams:
            self._reply(asked, "00")
            self.laser_on = True
        self._wanted, self._wanted_echo = made, asked.echo
        self._from_ns, self._left, self._skipped = self._now_ns, made.scans, made.skip

    # -- scans -------------------------------------------------------------------------------------------------

    def _scan(self, asked: scip.ScanRequest, start_ns: float) -> None:
        if self._skipped < asked.skip:
            self._skipped += 1
            return
        self._skipped = 0
        echo, mark, string = self._wanted_echo.partition(b";")
        if asked.streams:
            self._left -= 1
            echo = asked.line(self._left if asked.scans else 0)
        if not asked.streams or (asked.scans and self._left == 0):
            self._wanted = None
            self.laser_on = self.laser_on and not asked.streams
        values = self._values(asked, start_ns)
        frame = scip.scan_reply(asked, echo + mark + string, self.clock_ms(start_ns), values)
        if self.garble_ratio and self._rng.random() < self.garble_ratio:
            at = int(self._rng.integers(len(frame)))
            frame = frame[:at] + bytes((frame[at] ^ int(self._rng.integers(1, 256)),)) + frame[at + 1 :]
        self._emit(frame, start_ns + self._sweep_ns + self.profile.latency_ns + self.slow_ns)

    def _emit(self, frame: bytes, first_ns: float) -> None:
        profile = self.profile
        if profile.jitter_ns:
            first_ns += abs(self._rng.standard_normal()) * profile.jitter_ns
        if profile.spike_ratio and self._rng.random() < profile.spike_ratio:
            first_ns += self._rng.exponential(profile.spike_ns)
        first_ns = max(first_ns, self._last_out_ns)
        at = 0
        for k, (share, delay_ns) in enumerate(profile.bursts):
            end = len(frame) if k + 1 == len(profile.bursts) else at + int(share * len(frame))
            self._queue(first_ns + delay_ns, frame[at:end])
            at = end

    def _values(self, asked: scip.ScanRequest, start_ns: float) -> NDArray[np.int32]:
        self.scans += 1
        profile = self.profile
        ranges_m = self._cast((start_ns + self._beam_offsets_ns).astype(np.int64))
        sigma_m = np.where(ranges_m > 10.0, profile.noise_far_m, profile.noise_near_m)
        noisy_m = ranges_m + self._rng.standard_normal(BEAMS) * sigma_m
        seen = ranges_m <= profile.far_m
        if self.dropout_ratio:
            seen &= self._rng.random(BEAMS) >= self.dropout_ratio
        values = np.full(BEAMS, NO_RETURN, np.int32)
        values[seen] = np.rint(noisy_m[seen] * 1e3).astype(np.int32)
        values[ranges_m < profile.near_m] = TOO_NEAR
        np.maximum(values, NO_RETURN, out=values)
        return self._arranged(values, asked)

    def _arranged(self, values: NDArray[np.int32], asked: scip.ScanRequest) -> NDArray[np.int32]:
        """The sector, clusters (the smallest of each) and, for ME and GE, an intensity that falls with the range."""
        values = values[asked.first : asked.last + 1]
        if asked.cluster > 1:
            values = np.minimum.reduceat(values, np.arange(0, len(values), asked.cluster))
        if asked.code[1] == "S":
            return np.minimum(values, 4095)
        if asked.code[1] == "E":
            bright = np.where(values > TOO_NEAR, 20_000 / (1 + values / 1000), 0).astype(np.int32)
            return np.stack((values, bright), axis=1)
        return values
