"""State machine of the calibration drive: inputs of a tick in, outputs out. Nothing is sent before `go`.

    LISTENING --1.2 s, nothing against it--> READY --go--> MOVING: step after step --all done--> STOPPING --> DONE
        \\--> DONE (refused)                                  \\------ problem, stop ----------------^ at rest, then off

A step rolls (`roll`) or scans (the flight program's `Sensing`). These end the drive: any condition that forbids a
movement by hand (`bringup.can.moving.permit`), a wheel, the inertial sensor or the scanner gone silent, a fault of the
flight program's wheel monitors, a slope, and a step that takes too long.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain

from onboard.bringup.calibrate.log import Log, Logger
from onboard.bringup.calibrate.plan import lag_steps, nod, square
from onboard.bringup.calibrate.roll import Roll
from onboard.bringup.can.moving.jog import LISTEN_NS, OFF_NS, REST_LIMIT_NS, REST_RADPS, SETTLE_NS, Phase
from onboard.bringup.can.moving.permit import Permit
from onboard.bringup.lidar.lag_sweeps import CLOCK_NS, begun
from onboard.config import Config, Rover
from onboard.core.faults.wheels.seen import WheelInputs
from onboard.core.faults.wheels.watch import WheelWatch
from onboard.core.mission.sweep import Sensing
from onboard.devices.lidar.session import LidarSession
from onboard.devices.nodes import NODES, Nodes
from onboard.motion.odometry import Odometry
from onboard.motion.odometry import OdometryStep as Moved
from onboard.perception.scan.sweep import segments
from onboard.records import Event, ImuSample, Inputs, Outputs, Scan, WheelCommand, WheelMode
from protocol.conventions import TICK_NS
from protocol.tables.modes import Mode

LATE_RATIO, LATE_S = 2.0, 20.0  # a step may take this much longer than planned
MOST_TRIES = 2  # tries of a scan
SLOPE_LIMIT_RAD = math.radians(12)
MEAN_TICKS = 100  # time constant of the means of gyro and accelerometer
EXPECTED = {"STEER_OFFSET", "SLIP_HIGH"}  # the drive measures the offset, and soft ground is no fault here
DRIVEN, WITH_LAG = "CALIBRATE", "lag"  # the event that stores the side of the square in a record; a word of its text
IMU_SILENT_NS = 100_000_000


class CalibrationDrive:
    """State machine of the drive, run by `tick`.

    problem: one line with the reason of a refusal or an early end.
    log: the readings so far.
    """

    def __init__(self, config: Config, side_m: float, with_lag: bool = True) -> None:
        self._config = replace(config, scanning=nod(config))
        self.steps = (*(lag_steps(config) if with_lag else ()), *square(side_m))
        self.at, self._about = 0, f"{side_m} {WITH_LAG}" if with_lag else str(side_m)
        self.nodes, self.lidar = Nodes(config.rover, config.can), LidarSession(config.lidar)
        self.nodes.enabled = False
        self.phase, self.problem, self.stopped = Phase.LISTENING, "", False
        self.agreed = False
        self._permit = Permit(self.nodes, NODES)
        self._odometry, self._watch = Odometry(config.rover), WheelWatch(config.rover)
        self._logger = Logger(self.steps, self._config)
        self._orders: tuple[WheelCommand, ...] = (WheelCommand(WheelMode.HOLD, 0.0, 0.0),) * 4
        self._imu: ImuSample | None = None
        self._bias_radps, self._force = 0.0, [0.0, 0.0, 0.0]
        self._since_ns: int | None = None  # start of the phase
        self._step_ns = 0
        self._doing = self._begun()

    def go(self, now_ns: int) -> None:
        """Go from READY to MOVING; the operator has agreed."""
        if self.phase is Phase.READY:
            self.agreed = True
            self._enter(Phase.MOVING, now_ns)
            self._step_ns = now_ns
            self.nodes.enabled = True

    def stop(self) -> None:
        """End the drive with the next tick; without effect before `go`."""
        self.stopped = True

    @property
    def rover(self) -> Rover:
        """The rover's configuration before the calibration."""
        return self._config.rover

    @property
    def latency_ns(self) -> int:
        """The scanner's latency in the configuration before the calibration."""
        return self._config.lidar.latency_ns

    @property
    def log(self) -> Log:
        """Readings of the drive so far."""
        return self._logger.log()

    @property
    def complete(self) -> bool:
        """True if every step is done."""
        return self.at == len(self.steps)

    @property
    def progress_ratio(self) -> float:
        """Approximate share of the drive's time that has passed."""
        past = sum(step.seconds for step in self.steps[: self.at])
        past += 0.0 if self.complete else self._doing.progress_ratio * self.steps[self.at].seconds
        return past / sum(step.seconds for step in self.steps)

    def tick(self, inputs: Inputs) -> Outputs:
        """Process the inputs of one tick of 10 ms and return its outputs."""
        now_ns, first = inputs.now_ns, self._since_ns is None
        self._since_ns = now_ns if self._since_ns is None else self._since_ns
        self.nodes.receive(inputs.can_frames, now_ns, inputs.can)
        self._permit.hear(inputs.can_frames)
        scans = self.lidar.receive(inputs.lidar_chunks, inputs.lidar_state, now_ns)
        self._imu = self.nodes.imu[-1] if self.nodes.imu else self._imu
        match self.phase:
            case Phase.LISTENING:
                self._listen(now_ns)
            case Phase.READY:
                self._end(next(self._permit.forbidden(), ""), now_ns)
            case Phase.MOVING:
                self._move(scans, now_ns)
            case Phase.STOPPING:
                self._rest(now_ns)
        if self.phase not in (Phase.MOVING, Phase.STOPPING):
            events = (Event(now_ns, "info", DRIVEN, self._about),) if first else ()
            return Outputs(lidar_bytes=self._farewell(now_ns), events=events, state_digest=self._digest())
        self.nodes.set_wheels(self._orders)
        return Outputs(
            can_frames=self.nodes.send(now_ns, Mode.STANDBY),
            lidar_bytes=self.lidar.send(now_ns),
            lidar_connect=self.lidar.wants_connect(now_ns),
            state_digest=self._digest(),
        )

    def _digest(self) -> bytes:
        items = (self.phase.value, self.at, self.nodes.digest_items(), self.lidar.digest_items())
        return hashlib.blake2b(repr(items).encode(), digest_size=8).digest()

    def _farewell(self, now_ns: int) -> bytes:
        return self.lidar.farewell(now_ns) if self.phase is Phase.DONE and not self.lidar.dark else b""

    # -- the phases ------------------------------------------------------------------------------------------

    def _enter(self, phase: Phase, now_ns: int) -> None:
        self.phase, self._since_ns = phase, now_ns

    def _end(self, problem: str, now_ns: int) -> None:
        if problem:
            self.problem = problem
            self._enter(Phase.STOPPING if self.phase is Phase.MOVING else Phase.DONE, now_ns)

    def _listen(self, now_ns: int) -> None:
        self._end(next(self._permit.forbidden(), ""), now_ns)
        if not self.problem and now_ns - (self._since_ns or 0) >= LISTEN_NS:
            self._end(next(chain(self._permit.missing(), self._unheard()), ""), now_ns)
            if not self.problem:
                self._enter(Phase.READY, now_ns)

    def _move(self, scans: Sequence[Scan], now_ns: int) -> None:
        moved = self._odometry.update(self.nodes.wheels, now_ns)
        self._mean(moved.standing)
        turn_radps = self._imu.gyro_radps[2] - self._bias_radps if self._imu else 0.0
        currents_a = self._currents_a(now_ns)
        if self._imu:
            self._logger.tick(self.at, now_ns, moved.standing, self.nodes.wheels, self._imu, self.nodes.wheel_status)
        self._watch.update(
            WheelInputs(now_ns, self._orders, self.nodes.wheels, currents_a, self._imu, moved, turn_radps, 0.0)
        )
        self._end(next(chain(self._permit.forbidden(), self._against(now_ns)), ""), now_ns)
        if self.stopped or self.problem:
            self._halt(now_ns)
        elif self._do(moved, turn_radps, scans, now_ns):
            self.at, self._step_ns = self.at + 1, now_ns
            if self.complete:
                self._halt(now_ns)
            else:
                self._doing = self._begun()

    def _halt(self, now_ns: int) -> None:
        self._orders = tuple(order._replace(mode=WheelMode.HOLD, rate_radps=0.0) for order in self._orders)
        self._enter(Phase.STOPPING, now_ns)

    def _rest(self, now_ns: int) -> None:
        self.lidar.stream(False)
        waited_ns = now_ns - (self._since_ns or 0)
        if self.nodes.enabled:
            turning = any(wheel and abs(wheel.rate_radps) > REST_RADPS for wheel in self.nodes.wheels)
            if waited_ns >= SETTLE_NS and (not turning or waited_ns >= REST_LIMIT_NS):
                self.nodes.enabled = False
                self._orders = tuple(order._replace(mode=WheelMode.OFF) for order in self._orders)
                self._since_ns = now_ns
        elif waited_ns >= OFF_NS:
            self._enter(Phase.DONE, now_ns)

    # -- the steps -------------------------------------------------------------------------------------------

    def _begun(self) -> Roll | Sensing:
        step, config = self.steps[self.at], self._config
        if step.nod is not None:
            return begun(config, step.nod)
        if step.scans:
            return Sensing(config, segments(config.scanning, config.rover.lidar_z_m))
        return Roll(step, config, self._orders)

    def _do(self, moved: Moved, turn_radps: float, scans: Sequence[Scan], now_ns: int) -> bool:
        """Run one tick of the step; return True if it is done."""
        if isinstance(self._doing, Roll):
            self._doing.tick(self.nodes.wheels, moved, turn_radps)
            self._orders = self._doing.orders
            return self._doing.done
        if self.at == 0 and self.steps[0].nod is not None and now_ns - self._step_ns < CLOCK_NS:
            self.lidar.stream(True)
            return False
        sweep = self._doing.step(self.lidar, self.nodes, scans, now_ns)
        if sweep is not None:
            self._logger.scan(self.at, sweep)
            self.lidar.stream(self._sweeps_next())
        return sweep is not None

    def _sweeps_next(self) -> bool:
        """True if the next step sweeps as well: then the stream and the estimate of the scanner's clock continue."""
        following = self.steps[self.at + 1 : self.at + 2]
        return any(step.scans or step.nod is not None for step in following)

    def _mean(self, standing: bool) -> None:
        if self._imu and standing:
            self._bias_radps += (self._imu.gyro_radps[2] - self._bias_radps) / MEAN_TICKS
            for k, force in enumerate(self._imu.accel_mps2):
                self._force[k] += (force - self._force[k]) / MEAN_TICKS

    def _currents_a(self, now_ns: int) -> tuple[float | None, ...]:
        return tuple(
            told.drive_current_a if told and told.stamp_ns > now_ns - TICK_NS else None
            for told in self.nodes.wheel_status
        )

    # -- reasons to stop ---------------------------------------------------------------------------------------

    def _unheard(self) -> Iterator[str]:
        names = [f"WHEEL_{n}" for n, wheel in enumerate(self.nodes.wheels, 1) if wheel is None]
        names += [] if self._imu else ["IMU"]
        if names:
            yield f"{', '.join(names)}: no measurements come, it will not drive blindly"

    def _against(self, now_ns: int) -> Iterator[str]:
        step, doing = self.steps[self.at], self._doing
        for n in (1, 2, 3, 4):
            if (age_ns := self.nodes.wheel_age_ns(n, now_ns)) > self._config.can.silent_ns:
                yield f"WHEEL_{n} went silent {age_ns / 1e6:.0f} ms ago"
        if (age_ns := self.nodes.imu_age_ns(now_ns)) > IMU_SILENT_NS:
            yield f"IMU went silent {age_ns / 1e6:.0f} ms ago"
        for name, wheels in self._watch.faults.items():
            if name not in EXPECTED:
                yield f"{name}{' of wheel ' + ', '.join(map(str, wheels)) if wheels else ''} in {step.name!r}"
        ahead, left, up = self._force
        if math.hypot(ahead, left) > math.tan(SLOPE_LIMIT_RAD) * up > 0.0:
            yield f"it stands on a slope of over {math.degrees(SLOPE_LIMIT_RAD):.0f} degrees: find level ground"
        if self.lidar.complaint:
            yield f"scanner: {self.lidar.complaint}"
        if isinstance(doing, Sensing) and doing.tries > MOST_TRIES:
            yield "the scanner or its axis gives no whole scan: `onboard lidar check`, `onboard can jog --tilt 0.2`"
        if now_ns - self._step_ns > (LATE_RATIO * step.seconds + LATE_S) * 1e9:
            yield f"{step.name!r} takes too long: {(now_ns - self._step_ns) * 1e-9:.0f} s"
