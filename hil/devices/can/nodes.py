"""Emulated CAN nodes of the rover: wheels, tilt axis, inertial sensor, power.

Each has `receive(frame, now_ns)`, `step(now_ns, truth)`, `send()`; `build_nodes` returns all in one object. Faults are
attributes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hil.devices.can.errors import USUAL, ImuErrors, PowerErrors, SensorErrors, WheelErrors
from hil.devices.can.node import Node, Noise
from hil.devices.can.tilt import TiltNode
from hil.own_functions import generator
from hil.records import PlantState, WheelDrive
from onboard.config import Rover
from onboard.extrinsics import Rows, imu_rotation, rotated, steer_offsets_rad
from onboard.records import Frame
from protocol.can.guard import Every
from protocol.generated.can_codec import ENCODER_COUNTS_PER_TURN, NodeState, WheelMode

DRIVE_ENABLE, POWER_STATUS, GYRO, ACCEL = 0x100, 0x200, 0x1D0, 0x1D1
WHEEL_COMMAND, WHEEL_FEEDBACK, WHEEL_STATUS = 0x100, 0x180, 0x1A0  # + number of the wheel
COMMAND_TIMEOUT_NS, ENABLE_TIMEOUT_NS = 100_000_000, 500_000_000
SLEW_RADPS2, STOP_RADPS2 = 1.0, 4.0
TORQUE_NM_PER_A = 0.8
STALL_NM, STALL_GAIN_NM_PER_RADPS = 8.0, 40.0  # speed loop of a drive that cannot turn
JUMP_SIGMA, JUMP_COUNTS = 2.0, 300.0  # a jumping encoder: 4.6 % of the samples jump, by this times a normal number
DRAWING = Rover()


class Encoder(Enum):
    """State of a wheel's encoder."""

    GOOD = "counts"
    DEAD = "gives no more pulses: the count stays, the rate is 0"
    FROZEN = "its register hangs: count and rate stay as they were"
    JUMPING = "counts, and jumps"


def _clip(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


class WheelNode(Node):
    """Steering and drive of wheel `n`.

    zero_rad: true steering angle when the unit reports 0, from the build
    Faults, besides `silent`:
    drive_stuck: the motor pushes with all its current against a jammed gear (the plant's `jam`)
    steer_stuck_rad: angle at which the steering is stuck, or None
    encoder: state of the encoder
    pot_offset_rad: error of the pot's reading; the steering counts its own motor's turns and reaches the commanded
        angle
    A free or weak drive: the plant's `set_motor`.
    """

    def __init__(
        self, n: int, rng: np.random.Generator, zero_rad: float = 0.0, errors: WheelErrors = USUAL.wheel
    ) -> None:
        super().__init__(f"WHEEL_{n}", {DRIVE_ENABLE, WHEEL_COMMAND + n}, rng)
        self.n, self.zero_rad, self._errors = n, zero_rad, errors
        self.drive_stuck = False
        self.steer_stuck_rad: float | None = None
        self.encoder = Encoder.GOOD
        self.pot_offset_rad = float(rng.normal(0.0, errors.pot_offset_rad))
        self.timed_out = True
        self._noise = Noise(rng)
        self._mode, self._steer_rad, self._rate_radps = WheelMode.OFF, 0.0, 0.0
        self._command_ns = self._enable_ns = -(10**12)
        self._enable = False
        self._held_rad: float | None = 0.0
        self._drive_radps = 0.0
        self._then_ns = 0
        self._count, self._seen_radps = 0, 0.0
        self._jump_counts = 0
        self._status = Every(50_000_000, n * 10_000_000)
        self._temperature_c = 20.0

    @property
    def node_state(self) -> NodeState:
        """State in heartbeat and feedback."""
        state = super().node_state
        return NodeState.COMMAND_TIMEOUT if state is NodeState.RUNNING and self.timed_out else state

    def drive(self) -> WheelDrive:
        """Targets that the motor drivers send to the plant, after ramp, timeout and faults."""
        steer_rad = self.zero_rad + (self._steer_rad if self._held_rad is None else self._held_rad)
        if self.steer_stuck_rad is not None:
            steer_rad = self.steer_stuck_rad
        return WheelDrive(steer_rad, self._drive_radps)

    def order(self, can_id: int, values: Any, now_ns: int) -> None:
        """Handle DRIVE_ENABLE or this wheel's command."""
        if can_id == DRIVE_ENABLE:
            self._enable, self._enable_ns = bool(values.enable), now_ns
        else:
            self._mode, self._steer_rad, self._rate_radps = WheelMode(values.mode), values.steer_rad, values.rate_radps
            self._command_ns = now_ns

    def step(self, now_ns: int, truth: PlantState) -> None:
        """Ramp the drive, hold or release the steering, measure, and put the due frames into `out`."""
        wheel = truth.wheels[self.n - 1]
        dt_s, self._then_ns = (now_ns - self._then_ns) / 1e9, now_ns
        self.timed_out = now_ns - self._command_ns > COMMAND_TIMEOUT_NS
        enabled = self._enable and now_ns - self._enable_ns <= ENABLE_TIMEOUT_NS
        dead = self.timed_out or self.latched
        target = self._rate_radps if self._mode is WheelMode.RUN and enabled and not dead else 0.0
        slew = (STOP_RADPS2 if self.latched else SLEW_RADPS2) * dt_s
        self._drive_radps += _clip(target - self._drive_radps, slew)
        if not dead and self._mode is not WheelMode.OFF:
            self._held_rad = None
        elif self._held_rad is None:
            self._held_rad = wheel.steer_rad - self.zero_rad
        self._measure(now_ns, wheel.steer_rad - self.zero_rad, wheel.position_rad, wheel.rate_radps)
        if self._status.due(now_ns):
            self._tell_status(now_ns, wheel.torque_nm, dt_s)
        self.beat(now_ns)

    def _measure(self, now_ns: int, steer_rad: float, position_rad: float, rate_radps: float) -> None:
        noise = self._noise.next
        pot_rad = _clip(steer_rad + self.pot_offset_rad + self._errors.pot_noise_rad * noise(), 3.2767)
        count = math.floor(position_rad * (ENCODER_COUNTS_PER_TURN / math.tau))
        seen_radps = _clip(rate_radps + self._errors.rate_noise_radps * noise(), 16.38)
        if self.encoder is Encoder.JUMPING and abs(noise()) > JUMP_SIGMA:
            self._jump_counts += round(JUMP_COUNTS * noise())
        if self.encoder is Encoder.DEAD:
            self._seen_radps = 0.0
        elif self.encoder is not Encoder.FROZEN:
            self._count, self._seen_radps = count + self._jump_counts, seen_radps
        can_id = WHEEL_FEEDBACK + self.n
        data = self.sender.encode(can_id, pot_rad, self._count & 0xFFFF, self._seen_radps, self.node_state)
        self.out.append(Frame(can_id, data, now_ns))

    def _tell_status(self, now_ns: int, torque_nm: float, dt_s: float) -> None:
        if self.drive_stuck:  # the gear holds the wheel; the motor's load is the block, not the ground
            torque_nm = _clip(self._drive_radps * STALL_GAIN_NM_PER_RADPS, STALL_NM)
        drive_a = _clip(torque_nm / TORQUE_NM_PER_A + self._errors.current_noise_a * self._noise.next(), 20.47)
        steer_a = _clip(0.1 + self._errors.current_noise_a * self._noise.next(), 20.47)
        self._temperature_c += dt_s * (0.05 * drive_a * drive_a - 0.02 * (self._temperature_c - 20.0))
        can_id = WHEEL_STATUS + self.n
        data = self.sender.encode(can_id, drive_a, steer_a, round(_clip(self._temperature_c, 127.0)), 0)
        self.out.append(Frame(can_id, data, now_ns))


class ImuNode(Node):
    """Inertial sensor: angular rate and specific force at its place.

    Errors: white noise, walking bias, scale error, saturation.

    rotation: mounting, rows that turn its axes into base_link's
    gyro_bias_radps, accel_bias_mps2: lists of three; a scenario may step them as a fault
    silent: fault, see Node
    """

    def __init__(self, rng: np.random.Generator, rotation: Rows | None = None, errors: ImuErrors = USUAL.imu) -> None:
        super().__init__("IMU", set(), rng)
        self._into = None if rotation is None else tuple(zip(*rotation))  # base_link's axes into its own
        self._errors, self._noise = errors, Noise(rng)
        lever_m = np.array([errors.lever_x_m, errors.lever_y_m, errors.lever_z_m])
        self._lever_m = lever_m if lever_m.any() else None
        self._spun_radps, self._then_ns = np.zeros(3), 0
        self.gyro_bias_radps: list[float] = rng.normal(0.0, errors.gyro_bias_radps, 3).tolist()
        self.accel_bias_mps2: list[float] = rng.normal(0.0, errors.accel_bias_mps2, 3).tolist()
        self._gyro_scale: list[float] = (1.0 + rng.normal(0.0, errors.scale_error_ratio, 3)).tolist()
        self._accel_scale: list[float] = (1.0 + rng.normal(0.0, errors.scale_error_ratio, 3)).tolist()

    def step(self, now_ns: int, truth: PlantState) -> None:
        """Measure once; the frames go to `out`."""
        e = self._errors
        self._axes(
            GYRO,
            now_ns,
            rotated(self._into, truth.angular_radps.tolist()),
            self._gyro_scale,
            self.gyro_bias_radps,
            (e.gyro_noise_radps, e.gyro_walk_radps, e.gyro_limit_radps),
        )
        self._axes(
            ACCEL,
            now_ns,
            rotated(self._into, self._felt(now_ns, truth).tolist()),
            self._accel_scale,
            self.accel_bias_mps2,
            (e.accel_noise_mps2, e.accel_walk_mps2, e.accel_limit_mps2),
        )
        self.beat(now_ns)

    def _felt(self, now_ns: int, truth: PlantState) -> NDArray[np.float64]:
        """Specific force at the sensor, (3,); a lever adds the terms of base_link's rotation."""
        spin, lever_m = truth.angular_radps, self._lever_m
        grown, dt_s = spin - self._spun_radps, (now_ns - self._then_ns) / 1e9
        self._spun_radps, self._then_ns = spin, now_ns
        if lever_m is None or dt_s <= 0:
            return truth.specific_force_mps2
        return truth.specific_force_mps2 + np.cross(grown / dt_s, lever_m) + np.cross(spin, np.cross(spin, lever_m))

    def _axes(
        self,
        can_id: int,
        now_ns: int,
        true: Sequence[float],
        scale: list[float],
        bias: list[float],
        model: tuple[float, float, float],
    ) -> None:
        sigma, walk, limit = model
        noise, seen, status = self._noise.next, [], 0
        for axis in (0, 1, 2):
            bias[axis] += walk * noise()
            value = true[axis] * scale[axis] + bias[axis] + sigma * noise()
            if abs(value) > limit:
                value, status = _clip(value, limit), 1
            seen.append(value)
        self.out.append(Frame(can_id, self.sender.encode(can_id, *seen, status), now_ns))


class PowerNode(Node):
    """Battery and power node.

    The charge falls by the integral of the power of wheels and other loads; voltage follows from charge and current.

    Faults, besides `silent`:
    charge_ratio: charge, may be set
    sag_v: subtracted from the voltage; below `brown_out_v` the brown-out bit is set
    """

    def __init__(self, rng: np.random.Generator, errors: PowerErrors = USUAL.power) -> None:
        super().__init__("POWER", set(), rng)
        self._errors, self._noise = errors, Noise(rng)
        self.charge_ratio = errors.start_ratio
        self.sag_v = 0.0
        self._energy_j = 0.0
        self._then_ns = 0
        self._status = Every(200_000_000)

    def step(self, now_ns: int, truth: PlantState) -> None:
        """Subtract the energy of this step from the charge."""
        dt_s, self._then_ns = (now_ns - self._then_ns) / 1e9, now_ns
        power_w = self._errors.rest_w
        for wheel in truth.wheels:
            power_w += abs(wheel.torque_nm * wheel.rate_radps) / self._errors.efficiency_ratio
        self.charge_ratio = max(0.0, self.charge_ratio - power_w * dt_s / self._errors.capacity_j)
        if self._status.due(now_ns):
            open_v = 23.0 + 6.0 * self.charge_ratio
            current_a = _clip(power_w / open_v + self._errors.current_noise_a * self._noise.next(), 40.9)
            voltage_v = max(0.0, min(40.9, open_v - self._errors.inner_ohm * current_a - self.sag_v))
            switches = 0b0111 | (0x80 if voltage_v < self._errors.brown_out_v else 0)
            ratio = min(1.0, self.charge_ratio)
            data = self.sender.encode(POWER_STATUS, voltage_v, current_a, ratio, 15, switches)
            self.out.append(Frame(POWER_STATUS, data, now_ns))
        self.beat(now_ns)


class Nodes:
    """All nodes behind one `receive`, `step`, `send`, in the fixed order wheels 1 to 4, tilt, IMU, power."""

    def __init__(self, wheels: tuple[WheelNode, ...], tilt: TiltNode, imu: ImuNode, power: PowerNode) -> None:
        self.wheels, self.tilt, self.imu, self.power = wheels, tilt, imu, power
        self.all: tuple[Any, ...] = (*wheels, tilt, imu, power)
        self._hearers: dict[int, list[Any]] = {}
        for node in self.all:
            for can_id in sorted(node.hears):
                self._hearers.setdefault(can_id, []).append(node)

    def receive(self, frame: Frame, now_ns: int) -> None:
        """Deliver one frame of the bus to the nodes that receive its id."""
        for node in self._hearers.get(frame.can_id, ()):
            node.receive(frame, now_ns)

    def step(self, now_ns: int, truth: PlantState) -> None:
        """Step every node by one tick."""
        for node in self.all:
            node.step(now_ns, truth)

    def send(self) -> list[Frame]:
        """Frames of the tick, sorted by stamp, within one stamp by id, as in arbitration."""
        frames = [frame for node in self.all for frame in node.send()]
        for frame in frames:
            if frame.can_id < 0x20:  # the other nodes receive a node's stop too
                self.receive(frame, frame.stamp_ns)
        frames.sort(key=lambda frame: (frame.stamp_ns, frame.can_id))
        return frames

    def drives(self) -> tuple[WheelDrive, ...]:
        """Targets of the four wheels for the plant."""
        return tuple(wheel.drive() for wheel in self.wheels)


def build_nodes(seed: int, rover: Rover = DRAWING, errors: SensorErrors = USUAL) -> Nodes:
    """Seven nodes of a rover as built; each has its own random generator, a child of `seed`."""
    streams = [generator(child) for child in np.random.SeedSequence([seed, 0xCA]).spawn(7)]
    zeros = enumerate(steer_offsets_rad(rover), 1)
    wheels = tuple(WheelNode(n, streams[n - 1], zero, errors.wheel) for n, zero in zeros)
    imu = ImuNode(streams[5], imu_rotation(rover), errors.imu)
    return Nodes(wheels, TiltNode(streams[4], errors.tilt), imu, PowerNode(streams[6], errors.power))
