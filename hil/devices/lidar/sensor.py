"""Emulated Hokuyo scanner that speaks SCIP, without I/O. Output bytes carry the time at which they reach the wire.

    bytes in -> request lines -> lidar_commands (on lidar_states.Machine) -> replies at the reply tick -+
    time     -> lidar_turns -> cast -> lidar_optics -> scans, some latency after their sweep ----------+-> pieces out
                                                                        lidar_faults on all of it -----+

All differences between sensors and links are in `lidar_profile.Profile`. The state machine follows C-42-03320B, the
logs of real sensors and the experience of public drivers; nothing here was tested against a physical sensor.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hil.devices.lidar.commands import REQUEST_LIMIT, answer
from hil.devices.lidar.faults import Faults, ScheduledFault
from hil.devices.lidar.light import LIGHT_STREAM, Surface
from hil.devices.lidar.optics import Optics
from hil.devices.lidar.profile import IDEAL, Profile
from hil.devices.lidar.states import Machine, SensorState, Task
from hil.devices.lidar.turns import BEAMS, STEPS_A_TURN, Turns
from hil.own_functions import generator
from protocol import scip

QUEUE_LIMIT = 1 << 20  # bytes on their way; beyond this, requests are ignored and scans not sent
Cast = Callable[[NDArray[np.int64]], NDArray[np.float64]]
Look = Callable[[], Surface | None]


class Piece(NamedTuple):
    """Bytes that reach the wire together.

    at_ns: time on the wire
    data: the bytes
    begins: True for the first piece of a reply or scan
    scan: True for a piece of a scan; a full cable may drop whole scans
    """

    at_ns: int
    data: bytes
    begins: bool
    scan: bool


class Lidar:
    """One sensor.

    `cast(times_ns)` gives the 1081 ranges (m, inf = nothing there) of beams fired at these times, and `look()` the
    surfaces that the beams of the newest cast met, if the owner knows them. The owner calls receive, step and send (or
    pieces) in this order.

    scans: number of turns that were cast

    For injections, at any time: `faults`, reboot(), jump_clock(), and without `faults`:
    garble_ratio: share of the scans that leave with one byte changed
    slow_ns: extra delay of replies and scans
    stalled: True while no byte leaves
    unplugged: True if the cable is unplugged; used by the owner of the cable
    dropout_ratio: share of the beams that return nothing
    """

    def __init__(
        self,
        seed: int,
        cast: Cast,
        profile: Profile = IDEAL,
        schedule: tuple[ScheduledFault, ...] = (),
        look: Look = lambda: None,
    ) -> None:
        self.profile = profile
        self.connected = False
        self.unplugged = False
        self.garble_ratio = 0.0
        self.slow_ns = 0
        self.stalled = False
        self.scans = 0
        self.requests = 0
        self.faults = Faults(seed, schedule)
        self.turns = Turns(seed, profile)
        self.machine = Machine(profile, self.turns)
        self._cast, self._look = cast, look
        self._rng = generator(seed)
        self.optics = Optics(profile, self._rng, generator((seed, LIGHT_STREAM)))
        self._turn = 0  # next turn whose sweep is not over
        self._input = bytearray()
        self._output: deque[Piece] = deque()
        self._left: list[Piece] = []
        self._queued = 0  # bytes in _output
        self._last_out_ns = 0
        self._sweep: tuple[int, NDArray[np.int32]] = (-1, np.empty(0, np.int32))  # last turn that was cast

    @property
    def laser_on(self) -> bool:
        """True while the sensor measures."""
        return self.machine.laser_on

    @property
    def dropout_ratio(self) -> float:
        """Share of the beams that return nothing."""
        return self.optics.dropout_ratio

    @dropout_ratio.setter
    def dropout_ratio(self, ratio: float) -> None:
        self.optics.dropout_ratio = ratio

    # -- the wire ----------------------------------------------------------------------------------------------

    @property
    def reachable(self) -> bool:
        """True if a client can connect: plugged in, and not in the first moments after power-on."""
        return self.machine.reachable and not self.unplugged

    def connect(self) -> None:
        """Open the port for a client."""
        self.connected = True

    def disconnect(self) -> None:
        """End the connection: bytes on their way are lost; over TCP also the stream and incomplete requests."""
        self.connected = False
        self._lose_output()
        self._left.clear()
        if not self.profile.usb:
            self._input.clear()
            self.machine.stop()

    def receive(self, data: bytes, now_ns: int) -> None:
        """Receive bytes of the client that arrive at `now_ns`. A request ends at LF or CR; an empty one gets no reply.

        A line is cut after REQUEST_LIMIT bytes and one more, which marks it as too long.
        """
        self._settle(now_ns)
        if not self.reachable:
            return
        self._input += data.replace(b"\r", b"\n")
        *lines, rest = self._input.split(b"\n")
        self._input = rest[: REQUEST_LIMIT + 1]
        for line in lines:
            if line and self._queued < QUEUE_LIMIT:
                self._answer(scip.parse_request(bytes(line[: REQUEST_LIMIT + 1])))

    def step(self, now_ns: int) -> None:
        """Advance the time: every sweep that ended by `now_ns` is cast, encoded and queued."""
        while (due_ns := self._event_ns()) is not None and due_ns < now_ns:  # a fault acts at its own time
            self._sweep_until(due_ns)
            self._leave(due_ns)
            self._settle(due_ns)
        self._sweep_until(max(now_ns, self.machine.now_ns))
        self._settle(now_ns)

    def _sweep_until(self, now_ns: int) -> None:
        machine, ended = self.machine, self.turns.ended(now_ns)
        while self._turn <= ended and (machine.stream or machine.shots):
            self._turn_ended(self._turn)
            self._turn += 1
        self._turn = max(self._turn, ended + 1)

    def pieces(self) -> list[Piece]:
        """Pieces that left since the last call, in order."""
        self._leave(self.machine.now_ns)
        out, self._left = self._left, []
        return out

    def _leave(self, now_ns: int) -> None:
        while self._output and self._output[0].at_ns <= now_ns:
            piece = self._output.popleft()
            self._queued -= len(piece.data)
            if self.connected and not self.stalled:
                self._left.append(piece)

    def send(self) -> list[tuple[int, bytes]]:
        """(time on the wire, bytes) of the pieces that left since the last call, in order."""
        return [(piece.at_ns, piece.data) for piece in self.pieces() if piece.data]

    def due_ns(self) -> int | None:
        """Time at which step() has work; None: not before bytes arrive."""
        times = [self._event_ns()]
        if self._output:
            times.append(self._output[0].at_ns)
        if self.machine.stream or self.machine.shots:
            times.append(int(self.turns.end_ns(self._turn)) + 1)
        return min((t for t in times if t is not None), default=None)

    def _event_ns(self) -> int | None:
        return min((t for t in (self.faults.due_ns(), self.machine.due_ns()) if t is not None), default=None)

    # -- power and time ----------------------------------------------------------------------------------------

    def reboot(self) -> None:
        """Power off and on: timer at zero, bytes on their way lost."""
        self.machine.power_on()
        self._input.clear()
        self._lose_output()

    def jump_clock(self, by_ms: float) -> None:
        """Let the sensor's counter jump."""
        self.machine.counter.jump(by_ms)

    def clock_ms(self, at_ns: float) -> int:
        """Sensor's own counter at a bench time: whole milliseconds, 24 bits."""
        return self.machine.counter.ms(at_ns)

    def _settle(self, now_ns: int) -> None:
        boots = self.machine.boots
        self.machine.settle(now_ns)
        self.faults.settle(self, self.machine.now_ns)
        if self.machine.boots != boots:
            self._input.clear()
            self._lose_output()

    def _lose_output(self) -> None:
        self._output.clear()
        self._queued = 0

    # -- replies -----------------------------------------------------------------------------------------------

    def _answer(self, asked: scip.Request) -> None:
        self.requests += 1
        found = answer(self.machine, asked)
        if found:
            at_ns = self.machine.now_ns + self.profile.time_reply_ns if found.quick else self._reply_ns()
            self._queue(at_ns + self.slow_ns, scip.reply(asked.echo[:REQUEST_LIMIT], found.status, found.lines))
        elif self.machine.shots:
            latest = self.turns.ended(self.machine.now_ns)
            if self.turns.start_ns(latest) >= self.machine.shots[-1].from_ns:
                self._shoot(self.machine.shots.pop(), latest)

    def _reply_ns(self) -> int:
        tick_ns, now_ns = self.profile.reply_tick_ns, self.machine.now_ns
        return (now_ns // tick_ns + 1) * tick_ns if tick_ns else now_ns

    def _queue(self, at_ns: float, data: bytes, scan: bool = False, begins: bool = True) -> None:
        if self.faults.active:
            data = self.faults.damage(data)
        for piece_ns, piece in self.faults.pieces(int(at_ns), data):
            self._last_out_ns = max(self._last_out_ns, piece_ns)
            self._output.append(Piece(self._last_out_ns, piece, begins, scan))
            self._queued += len(piece)
            begins = False

    # -- scans -------------------------------------------------------------------------------------------------

    def _turn_ended(self, turn: int) -> None:
        start_ns, machine = self.turns.start_ns(turn), self.machine
        for shot in [shot for shot in machine.shots if start_ns >= shot.from_ns]:
            machine.shots.remove(shot)
            self._shoot(shot, turn)
        task = machine.stream
        if task is None or start_ns < task.from_ns:
            return
        if task.skipped < task.asked.skip:
            task.skipped += 1
            return
        task.skipped = 0
        self._stream(task, turn)

    def _shoot(self, task: Task, turn: int) -> None:
        frame = self._frame(task, turn, task.echo, "00")
        self._emit(frame, max(self._reply_ns(), self.turns.end_ns(turn) + self.profile.latency_ns))

    def _stream(self, task: Task, turn: int) -> None:
        """Queue the stream's next scan, or the status sent in its place."""
        machine, asked = self.machine, task.asked
        status = machine.scan_status()
        if status == "99":
            task.left -= 1
        left = max(0, task.left) if asked.scans else 0
        if status >= "50" and status < "98":
            machine.stream, machine.state = None, SensorState.FAULT
        elif asked.scans and left == 0:
            machine.stop()
        if not status or (self.profile.usb and not self.connected):
            return
        _, mark, string = task.echo.partition(b";")
        frame = self._frame(task, turn, asked.line(left) + mark + string, status)
        self._emit(frame, self.turns.end_ns(turn) + self.profile.latency_ns)
        if self.profile.turn_bytes:
            task.from_ns = self.turns.start_ns(turn) + (self._turns_of(frame) - 0.5) * self.turns.turn_ns

    def _frame(self, task: Task, turn: int, echo: bytes, status: str) -> bytes:
        if status not in ("00", "99"):
            return scip.reply(echo, status)
        stamped_ns = self.turns.start_ns(turn) + self.profile.stamp_step * self.turns.turn_ns / STEPS_A_TURN
        values = self.optics.values(task.asked, self._measured(turn))
        frame = scip.scan_reply(task.asked, echo, self.clock_ms(stamped_ns), values)
        if self.garble_ratio and self._rng.random() < self.garble_ratio:
            at = int(self._rng.integers(len(frame)))
            frame = frame[:at] + bytes((frame[at] ^ int(self._rng.integers(1, 256)),)) + frame[at + 1 :]
        return self.faults.scan(task.asked, frame) if self.faults.active else frame

    def _measured(self, turn: int) -> NDArray[np.int32]:
        if self._sweep[0] != turn:
            self.scans += 1
            times_ns = (self.turns.start_ns(turn) + self.turns.beam_offsets_ns).astype(np.int64)
            self._sweep = (turn, self.optics.measure(self._cast(times_ns), self._look()))
        return self._sweep[1]

    def _turns_of(self, frame: bytes) -> int:
        return -(-len(frame) // self.profile.turn_bytes) if self.profile.turn_bytes else 1

    def _emit(self, frame: bytes, first_ns: float) -> None:
        profile = self.profile
        if self._queued >= QUEUE_LIMIT:
            return
        first_ns += self.slow_ns
        if profile.jitter_ns:
            first_ns += abs(self._rng.standard_normal()) * profile.jitter_ns
        if profile.spike_ratio and self._rng.random() < profile.spike_ratio:
            first_ns += self._rng.exponential(profile.spike_ns)
        first_ns = max(first_ns, self._last_out_ns)
        at, slower = 0, self._turns_of(frame)
        for k, (share, delay_ns) in enumerate(profile.bursts):
            end = len(frame) if k + 1 == len(profile.bursts) else at + int(share * len(frame))
            self._queue(first_ns + delay_ns * slower, frame[at:end], scan=True, begins=k == 0)
            at = end


__all__ = ["BEAMS", "Cast", "Lidar", "Look", "Piece"]
