"""One bounded movement of the hardware without the flight program: the state machine of `onboard can jog` and `home`.

    LISTENING --1.2 s, nothing against it--> READY --go--> MOVING --arrived, time over, problem, stop--> STOPPING
        \\--another computer, a latched stop, a node missing, foreign or at fault--> DONE <--at rest, then off--/

Nothing is sent before `go`. While moving it sends the same frames as the flight program, by the same code: TIME_SYNC,
DRIVE_ENABLE, COMPUTER_HEARTBEAT, the commands of four wheels (off where nothing is requested) and of the axis.
It ends with zero rate until the wheels are at rest, then DRIVE_ENABLE without enable and four times OFF.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import Enum
from itertools import chain

from onboard.bringup.can.moving.move import Move
from onboard.bringup.can.moving.permit import Permit
from onboard.config import Can, Rover
from onboard.devices.nodes import Nodes
from onboard.records import Frame, WheelCommand, WheelMode, WheelState
from protocol.tables.modes import Mode

LISTEN_NS, SETTLE_NS, OFF_NS, REST_LIMIT_NS = 1_200_000_000, 200_000_000, 200_000_000, 4_000_000_000
ARRIVED_RAD, REST_RADPS = 0.02, 0.05
WRONG_WAY_NS, WRONG_WAY_RADPS, WRONG_WAY_RAD, RUNAWAY_RADPS = 500_000_000, 0.1, 0.1, 0.5
TURNED_RATIO = 0.1


class Phase(Enum):
    """Phase of a movement."""

    LISTENING = "listening"
    READY = "ready"
    MOVING = "moving"
    STOPPING = "stopping"
    DONE = "done"


@dataclass(slots=True)
class _Begun:
    """State of the wheels at `go`.

    at_ns: time of `go`.
    wheels: state of each wheel then.
    fastest_radps: fastest rate of each wheel since then, in the requested direction.
    """

    at_ns: int = 0
    wheels: tuple[WheelState | None, ...] = (None,) * 4
    fastest_radps: list[float] = field(default_factory=lambda: [0.0] * 4)


class Jog:
    """State machine of a movement, run by `tick`.

    problem: one line with the reason of a refusal or an early end, empty without one.
    """

    def __init__(self, move: Move, rover: Rover, can: Can) -> None:
        self.move = move
        self.nodes = Nodes(rover, can)
        self.nodes.enabled = False
        self.phase = Phase.LISTENING
        self.problem = ""
        self.stopped = False  # set by `stop`
        self._silent_ns = can.silent_ns
        self._permit = Permit(self.nodes, move.nodes)
        self._since_ns: int | None = None  # start of the phase
        self._begun = _Begun()
        self._there_ns: int | None = None

    def go(self, now_ns: int) -> None:
        """Go from READY to MOVING; the operator has agreed."""
        if self.phase is Phase.READY:
            self._begun = _Begun(now_ns, self.nodes.wheels)
            self._enter(Phase.MOVING, now_ns)
            self.nodes.enabled = True
            if self.move.tilt_rad is not None:
                self.nodes.park_tilt(self.move.tilt_rad)

    def stop(self) -> None:
        """End the movement with the next tick; without effect before `go`."""
        self.stopped = True

    def tick(self, frames: Sequence[Frame], now_ns: int) -> tuple[Frame, ...]:
        """Process the received frames and return the frames to send; call it every 10 ms."""
        self._since_ns = now_ns if self._since_ns is None else self._since_ns
        self._hear(frames, now_ns)
        match self.phase:
            case Phase.LISTENING:
                self._listen(now_ns)
            case Phase.READY:
                self._refuse(now_ns)
            case Phase.MOVING:
                self._watch(now_ns)
            case Phase.STOPPING:
                self._rest(now_ns)
        if self.phase not in (Phase.MOVING, Phase.STOPPING):
            return ()
        self.nodes.set_wheels(self._commands())
        return self.nodes.send(now_ns, Mode.STANDBY)

    def turned_rad(self, n: int) -> float:
        """Angle that wheel 1 to 4 has turned since `go`."""
        then, now = self._begun.wheels[n - 1], self.nodes.wheels[n - 1]
        return now.position_rad - then.position_rad if then and now else 0.0

    # -- the phases ------------------------------------------------------------------------------------------

    def _enter(self, phase: Phase, now_ns: int) -> None:
        self.phase, self._since_ns = phase, now_ns

    def _hear(self, frames: Sequence[Frame], now_ns: int) -> None:
        self.nodes.receive(frames, now_ns)
        self._permit.hear(frames)

    def _listen(self, now_ns: int) -> None:
        if self._refuse(now_ns):
            return
        if now_ns - (self._since_ns or 0) >= LISTEN_NS:
            self._end(next(self._missing(), ""), now_ns)
            if not self.problem:
                self._enter(Phase.READY, now_ns)

    def _refuse(self, now_ns: int) -> bool:
        self._end(next(self._permit.forbidden(), ""), now_ns)
        return bool(self.problem)

    def _watch(self, now_ns: int) -> None:
        self._note()
        self._end(next(chain(self._permit.forbidden(), self._silent(now_ns), self._astray(now_ns)), ""), now_ns)
        over = now_ns - self._begun.at_ns >= self.move.limit_s * 1e9
        if self.phase is not Phase.MOVING:
            return
        if self.stopped or self._arrived(now_ns):
            self._enter(Phase.STOPPING, now_ns)
        elif over:
            self._end(next(self._short(), ""), now_ns)
            self._enter(Phase.STOPPING, now_ns)

    def _rest(self, now_ns: int) -> None:
        waited_ns = now_ns - (self._since_ns or 0)
        if self.nodes.enabled:
            turning = any(wheel and abs(wheel.rate_radps) > REST_RADPS for wheel in self.nodes.wheels)
            if waited_ns >= SETTLE_NS and (not turning or waited_ns >= REST_LIMIT_NS):
                self.nodes.enabled = False
                self._since_ns = now_ns
        elif waited_ns >= OFF_NS:
            self._enter(Phase.DONE, now_ns)

    def _end(self, problem: str, now_ns: int) -> None:
        if problem:
            self.problem = problem
            self._enter(Phase.STOPPING if self.phase is Phase.MOVING else Phase.DONE, now_ns)

    def _commands(self) -> tuple[WheelCommand, ...]:
        """RUN for a wheel that turns, HOLD for one that steers, OFF for others; at rest OFF for all."""
        made = []
        for asked_rad, rate_radps, then in zip(self.move.steer_rad, self.move.rate_radps, self._begun.wheels):
            mode = WheelMode.RUN if rate_radps else WheelMode.OFF if asked_rad is None else WheelMode.HOLD
            steer_rad = asked_rad if asked_rad is not None else then.steer_rad if then else 0.0
            rate_radps = rate_radps if self.phase is Phase.MOVING else 0.0
            made.append(WheelCommand(mode if self.nodes.enabled else WheelMode.OFF, steer_rad, rate_radps))
        return tuple(made)

    # -- reasons to stop ---------------------------------------------------------------------------------------

    def _missing(self) -> Iterator[str]:
        """Reports of expected nodes and feedback that have not been received by now."""
        yield from self._permit.missing()
        for n in self.move.wheels:
            if self.nodes.wheels[n - 1] is None:
                yield f"WHEEL_{n} sends no feedback: it will not be moved blindly"
        if self.move.tilt_rad is not None and self.nodes.tilt_angle_rad is None:
            yield "TILT sends no feedback: it will not be moved blindly"

    def _silent(self, now_ns: int) -> Iterator[str]:
        for n in self.move.wheels:
            age_ns = min(self.nodes.wheel_age_ns(n, now_ns), now_ns - self._begun.at_ns)
            if age_ns > self._silent_ns:
                yield f"WHEEL_{n} went silent {age_ns / 1e6:.0f} ms ago"

    def _astray(self, now_ns: int) -> Iterator[str]:
        """Reports of wheels that do not follow their command."""
        late = now_ns - self._begun.at_ns > WRONG_WAY_NS
        for n, (wheel, then) in enumerate(zip(self.nodes.wheels, self._begun.wheels), 1):
            if wheel is None or then is None:
                continue
            asked_radps, steer_rad = self.move.rate_radps[n - 1], self.move.steer_rad[n - 1]
            if abs(wheel.rate_radps) > 1.5 * abs(asked_radps) + RUNAWAY_RADPS:
                yield f"WHEEL_{n} turns at {wheel.rate_radps:+.2f} rad/s, asked were {asked_radps:+.2f}: it runs away"
            if late and asked_radps and wheel.rate_radps * asked_radps < -WRONG_WAY_RADPS * abs(asked_radps):
                yield f"WHEEL_{n} turns the other way: exchange the poles of its motor or the lines of its encoder"
            if steer_rad is None:
                continue
            if abs(wheel.steer_rad - steer_rad) > WRONG_WAY_RAD + abs(then.steer_rad - steer_rad):
                yield f"WHEEL_{n} steers away from its angle: exchange the poles of its steering motor or of its pot"

    # -- the end ---------------------------------------------------------------------------------------------

    def _note(self) -> None:
        for index, (wheel, asked) in enumerate(zip(self.nodes.wheels, self.move.rate_radps)):
            if wheel and asked:
                rate_radps = wheel.rate_radps if asked > 0 else -wheel.rate_radps
                self._begun.fastest_radps[index] = max(self._begun.fastest_radps[index], rate_radps)

    def _arrived(self, now_ns: int) -> bool:
        """True if everything has been at its target for 0.2 s; never for a wheel that turns."""
        if any(self.move.rate_radps) or next(self._short(), ""):
            self._there_ns = None
            return False
        self._there_ns = now_ns if self._there_ns is None else self._there_ns
        return now_ns - self._there_ns >= SETTLE_NS

    def _short(self) -> Iterator[str]:
        """Reports of wheels and axis that are off their target now."""
        for n, (wheel, steer_rad) in enumerate(zip(self.nodes.wheels, self.move.steer_rad), 1):
            if steer_rad is not None and wheel and abs(wheel.steer_rad - steer_rad) > ARRIVED_RAD:
                yield f"WHEEL_{n} stands at {wheel.steer_rad:+.3f} rad, asked were {steer_rad:+.3f}"
        for n, (asked, fastest) in enumerate(zip(self.move.rate_radps, self._begun.fastest_radps), 1):
            if asked and fastest < TURNED_RATIO * abs(asked):
                yield f"WHEEL_{n} did not turn: power of the drives, motor, encoder? Its status frame may say"
        angle_rad, tilt_rad = self.nodes.tilt_angle_rad, self.move.tilt_rad
        if tilt_rad is not None and angle_rad is not None and abs(angle_rad - tilt_rad) > ARRIVED_RAD:
            yield f"TILT stands at {angle_rad:+.3f} rad, asked were {tilt_rad:+.3f}"
