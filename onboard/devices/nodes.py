"""CAN nodes of the rover as the computer sees them: frames in, newest values out; orders in, frames out."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from onboard import config
from onboard.devices.can_recovery import Bus, CanRecovery
from onboard.devices.can_watch import CanWatch
from onboard.devices.emergency import Emergency
from onboard.devices.tilt import SegmentLike, Tilt
from onboard.extrinsics import imu_rotation, rotated, steer_offsets_rad
from onboard.records import BusStatus, Frame, ImuSample, PowerState, TiltTrack, WheelCommand, WheelMode, WheelState
from protocol.can.guard import Counts, Every, Guard, Sender
from protocol.generated.can_codec import ENCODER_COUNTS_PER_TURN, TABLE, NodeState

TIME_SYNC, DRIVE_ENABLE, TILT_COMMAND, HEARTBEAT = 0x080, 0x100, 0x120, 0x300
WHEEL_COMMAND, WHEEL_FEEDBACK, WHEEL_STATUS = 0x100, 0x180, 0x1A0  # + number of the wheel
TILT_FEEDBACK, GYRO, ACCEL, POWER_STATUS = 0x1C0, 0x1D0, 0x1D1, 0x200
NODES = tuple(row.sender for row in TABLE.values() if row.name.startswith("NODE_HEARTBEAT"))
RAD_PER_COUNT = math.tau / ENCODER_COUNTS_PER_TURN
BROWN_OUT_SWITCH = 0x80  # of POWER_STATUS.switches
FAST_NS, SLOW_NS, TICK_NS = 20_000_000, 100_000_000, 10_000_000
_STOPPED = WheelCommand(WheelMode.OFF, 0.0, 0.0)
_OPEN = BusStatus()


class WheelStatus(NamedTuple):
    """Housekeeping of one wheel; `faults` as in the DBC."""

    drive_current_a: float
    steer_current_a: float
    temperature_c: float
    faults: int
    stamp_ns: int


class _Wheel:
    """The newest feedback of one wheel, its encoder unwrapped."""

    __slots__ = ("count", "raw", "values")

    def __init__(self) -> None:
        self.values: tuple[Any, int] | None = None  # feedback, stamp
        self.raw = self.count = 0

    def feedback(self, values: Any, stamp_ns: int) -> None:
        if self.values is not None:
            self.count += ((values.encoder_count - self.raw + 0x8000) & 0xFFFF) - 0x8000
        self.raw, self.values = values.encoder_count, (values, stamp_ns)

    def state(self, offset_rad: float, now_ns: int) -> WheelState | None:
        if self.values is None:
            return None
        told, stamp_ns = self.values
        return WheelState(
            told.steer_rad + offset_rad, self.count * RAD_PER_COUNT, told.rate_radps, told.state, now_ns - stamp_ns
        )


class Nodes:
    """The rover's nodes: call `receive` once a tick, then read; give orders, then `send`.

    wheels: newest state of each; None if none was received; ages at the last `receive`.
    bus: state of the bus.
    watch: errors in its frames.
    from_future: frames stamped later than now by over a tick.

    Readings and orders are converted here between the nodes' own zeros and the rover's axes: steering offsets, mounting
    of the sensor (`onboard.extrinsics`). No other part of the core uses them.
    """

    def __init__(self, rover: config.Rover, can: config.Can, boot_count: int = 1) -> None:
        self._rover, self.stale_ns = rover, can.stale_ns
        self._offsets_rad, self._imu_rotation = steer_offsets_rad(rover), imu_rotation(rover)
        self._boot_count = boot_count & 0xFFFF
        self._guard, self._sender = Guard(), Sender()
        self.bus, self.watch = CanRecovery(), CanWatch()
        self.from_future = 0
        self._back_ns = 0  # time since which the bus passes frames without a break
        self.tilt = Tilt()
        self._wheels = tuple(_Wheel() for _ in range(4))
        self.wheels: tuple[WheelState | None, ...] = (None,) * 4
        self._status: list[WheelStatus | None] = [None] * 4
        self._gyro: Any = None
        self._imu: list[ImuSample] = []
        self._imu_ns = 0
        self._power: tuple[Any, int] | None = None
        self._emergency = Emergency()
        self._commands: tuple[WheelCommand, ...] = (_STOPPED,) * 4
        self.enabled = True  # value of DRIVE_ENABLE while there is no emergency stop
        self._beats = self._now_ns = 0
        self._every = {
            "wheels": Every(FAST_NS),
            "time": Every(SLOW_NS),
            "enable": Every(SLOW_NS, 2 * TICK_NS),
            "beat": Every(SLOW_NS, 5 * TICK_NS),
        }
        self._handlers = self._table()

    # -- in --------------------------------------------------------------------------------------------------

    def receive(self, frames: Sequence[Frame], now_ns: int, status: BusStatus = _OPEN) -> None:
        """Process the tick's frames and bus status; bad frames are counted and dropped, babbling ids ignored."""
        self._now_ns = now_ns
        self._imu = []
        if self.bus.state is Bus.LOST:
            self._guard.rearm()
        self.watch.rates(frames, now_ns)
        receive, handlers, babbling, heard = self._guard.receive, self._handlers, self.watch.babbling, False
        for frame in frames:
            can_id, _, stamp_ns = frame
            values = None if can_id in babbling else receive(frame)
            if values is None:
                continue
            heard = True
            if stamp_ns > now_ns:  # a stamp in the future would look fresh too long
                self.from_future += stamp_ns > now_ns + TICK_NS  # less is normal: a late tick reads newer frames
                stamp_ns = now_ns
            handlers[can_id](values, stamp_ns)
        self.watch.checks(self._guard, self.from_future, now_ns)
        if self.bus.step(status, heard, now_ns):
            self._back_ns = now_ns
        self.wheels = tuple(wheel.state(offset, now_ns) for wheel, offset in zip(self._wheels, self._offsets_rad))

    @property
    def wheel_status(self) -> tuple[WheelStatus | None, ...]:
        """Currents, temperature and fault bits of the four wheels."""
        return tuple(self._status)

    @property
    def wheel_orders(self) -> tuple[WheelCommand, ...]:
        """Orders of the four wheels as clipped, with steering angles comparable with those of `wheels`."""
        return tuple(c._replace(steer_rad=c.steer_rad + off) for c, off in zip(self._commands, self._offsets_rad))

    @property
    def imu(self) -> tuple[ImuSample, ...]:
        """Samples that came in this tick: each acceleration with the angular rate sent before it."""
        return tuple(self._imu)

    @property
    def power(self) -> PowerState | None:
        """Newest status of the power node; None before the first."""
        if self._power is None:
            return None
        told, stamp_ns = self._power
        return PowerState(
            told.voltage_v,
            told.current_a,
            told.charge_ratio,
            float(told.temperature_c),
            self._now_ns - stamp_ns,
            bool(told.switches & BROWN_OUT_SWITCH),
        )

    @property
    def tilt_angle_rad(self) -> float | None:
        """Newest angle of the axis, positive down; None before the first."""
        return self.tilt.angle_rad

    @property
    def tilt_moving(self) -> bool:
        """True while the axis moves."""
        return self.tilt.moving

    def tilt_track(self, since_ns: int) -> TiltTrack:
        """Samples of the tilt angle from `since_ns` on, in onboard time; the last 40 s are stored."""
        return self.tilt.track(since_ns)

    def wheel_age_ns(self, n: int, now_ns: int) -> int:
        """Time since the last feedback of wheel 1 to 4, or since the bus passes frames if later; else since start."""
        told = self._wheels[n - 1].values
        return now_ns - max(told[1] if told else 0, self._back_ns)

    def imu_age_ns(self, now_ns: int) -> int:
        """Time since the last pair of IMU frames, or as wheel_age_ns."""
        return now_ns - max(self._imu_ns, self._back_ns)

    def heartbeat_age_ns(self, node: str, now_ns: int) -> int:
        """Time since the last heartbeat of a node (a name of NODES), or as wheel_age_ns."""
        return now_ns - max(self._emergency.heard_ns.get(node, 0), self._back_ns)

    def node_state(self, node: str) -> NodeState | None:
        """State in a node's last heartbeat; None before the first."""
        return self._emergency.states.get(node)

    @property
    def bus_well(self) -> bool:
        """True if the bus has passed frames for a moment."""
        return self.bus.state is Bus.WELL

    @property
    def guard_counts(self) -> Counts:
        """Sums over all ids, computed at each call; cheap: `bad_frames`, `lost_frames`. Of one id: `counts_of`."""
        return self._guard.total()

    @property
    def bad_frames(self) -> int:
        """Received frames that were dropped since the start: checksum, counter, range or length."""
        return self._guard.bad

    @property
    def lost_frames(self) -> int:
        """Frames that were never received, by their counters."""
        return self._guard.lost

    @property
    def unknown_frames(self) -> int:
        """Frames with an id that the DBC does not have."""
        return self._guard.unknown

    def counts_of(self, can_id: int) -> Counts:
        """The guard's counts of one id of the DBC."""
        return self._guard.counts(can_id)

    # -- orders ----------------------------------------------------------------------------------------------

    def set_wheels(self, commands: Sequence[WheelCommand]) -> None:
        """Set the orders of the four wheels, sent at 50 Hz, clipped to the limits. ValueError for NaN or not 4.

        An order to stop does not wait for its period: the next `send` sends it.
        """
        if len(commands) != 4:
            raise ValueError(f"{len(commands)} wheel commands for 4 wheels")
        steer, rate = self._rover.steer_limit_rad, self._rover.wheel_rate_limit_radps
        for n, command in enumerate(commands, 1):
            if not (math.isfinite(command.steer_rad) and math.isfinite(command.rate_radps)):
                raise ValueError(f"the order of wheel {n} is no number: {command!r}")
        if any(c.rate_radps for c in self._commands) and not any(c.rate_radps for c in commands):
            self._every["wheels"].now()
        self._commands = tuple(
            WheelCommand(c.mode, max(-steer, min(steer, c.steer_rad - off)), max(-rate, min(rate, c.rate_radps)))
            for c, off in zip(commands, self._offsets_rad)
        )

    def sweep(self, segments: Sequence[SegmentLike], start_ns: int) -> None:
        """Sweep the axis from `start_ns`; postponed if the next send is less than 0.2 s before. ValueError if empty."""
        self.tilt.sweep(segments, start_ns)

    def park_tilt(self, angle_rad: float) -> None:
        """Move the axis to an angle and hold it there; ends a sweep."""
        self.tilt.park(angle_rad, self._now_ns)

    def sweep_done(self, now_ns: int) -> bool:
        """Return whether the last sweep has ended with its samples in; False if none was begun or a park ended it."""
        return self.tilt.sweep_done(now_ns)

    def emergency_stop(self, reason: int, detail: int = 0) -> None:
        """Stop every node, at once and at 10 Hz until `reset`. `reason` is a StopReason."""
        self._emergency.stop(int(reason), detail)

    def reset(self, nonce: int) -> None:
        """Begin the two steps that release an emergency stop; see `resetting` and `emergency`."""
        self._emergency.reset(nonce)

    @property
    def emergency(self) -> tuple[str, int, int] | None:
        """Sender, reason and detail of the first active emergency stop; None if there is none."""
        return self._emergency.called

    @property
    def resetting(self) -> bool:
        """True while a reset is under way: until all nodes with a heartbeat have answered both steps, at most 3 s."""
        return self._emergency.resetting

    # -- out -------------------------------------------------------------------------------------------------

    def send(self, now_ns: int, mode: int) -> tuple[Frame, ...]:
        """Return the frames that are due at this tick. mode: of the rover, 0 to 255."""
        frames: list[Frame] = []
        every = self._every

        def put(can_id: int, *values: Any) -> None:
            frames.append(Frame(can_id, self._sender.encode(can_id, *values)))

        self._emergency.send(now_ns, put)
        if every["time"].due(now_ns):
            put(TIME_SYNC, now_ns // 1000)
        if every["enable"].due(now_ns):
            put(DRIVE_ENABLE, int(self.enabled and self.emergency is None), mode)
        if every["wheels"].due(now_ns):
            for n, command in enumerate(self._commands, 1):
                put(WHEEL_COMMAND + n, int(command.mode), command.steer_rad, command.rate_radps)
        order = self.tilt.send(now_ns)
        if order is not None:
            put(TILT_COMMAND, *order)
        if every["beat"].due(now_ns):
            self._beats += 1
            put(HEARTBEAT, mode, self._beats & 0xFFFF, self._boot_count)
        return tuple(frames)

    def farewell(self, now_ns: int, mode: int) -> tuple[Frame, ...]:
        """Return the last frames of a run: the wheels' orders are sent at once, due or not."""
        self._every["wheels"] = Every(FAST_NS)
        return self.send(now_ns, mode)

    def digest_items(self) -> tuple[float | int, ...]:
        """Values of this state that go into the state digest."""
        items: list[float | int] = [self._guard.unknown, self._guard.bad, self._beats, int(self.emergency is not None)]
        for wheel, command in zip(self._wheels, self._commands):
            told = wheel.values[0] if wheel.values else (0.0, 0, 0.0, 0)
            items += [wheel.count, *told, int(command.mode), command.steer_rad, command.rate_radps]
        items += [*self.bus.digest_items(), *self.watch.digest_items()]
        return (*items, *self.tilt.digest(), *(self._power[0] if self._power else ()))

    # -- handlers --------------------------------------------------------------------------------------------

    def _table(self) -> dict[int, Callable[[Any, int], None]]:
        table: dict[int, Callable[[Any, int], None]] = {
            TILT_FEEDBACK: self.tilt.feedback,
            GYRO: self._on_gyro,
            ACCEL: self._on_accel,
            POWER_STATUS: self._on_power,
        }
        for n, wheel in enumerate(self._wheels, 1):
            table[WHEEL_FEEDBACK + n] = wheel.feedback
            table[WHEEL_STATUS + n] = self._status_of(n)
        for can_id, row in TABLE.items():
            if row.name.startswith("NODE_HEARTBEAT"):
                table[can_id] = self._heartbeat_of(row.sender)
            elif row.sender == "COMPUTER":
                table[can_id] = lambda _values, _stamp_ns: self.watch.copy_of_us()
            elif row.name.startswith("EMERGENCY_STOP"):
                table[can_id] = self._stop_of(row.sender)
        return table

    def _status_of(self, n: int) -> Callable[[Any, int], None]:
        def handler(values: Any, stamp_ns: int) -> None:
            self._status[n - 1] = WheelStatus._make((*values, stamp_ns))

        return handler

    def _heartbeat_of(self, node: str) -> Callable[[Any, int], None]:
        def handler(values: Any, stamp_ns: int) -> None:
            self._emergency.heartbeat(node, values.state, stamp_ns)
            self.watch.heartbeat(node, values.dbc_version)

        return handler

    def _stop_of(self, node: str) -> Callable[[Any, int], None]:
        def handler(values: Any, _stamp_ns: int) -> None:
            self._emergency.heard_stop(node, values.reason, values.detail)

        return handler

    def _on_gyro(self, values: Any, _stamp_ns: int) -> None:
        self._gyro = values

    def _on_accel(self, values: Any, stamp_ns: int) -> None:
        if self._gyro is not None:
            turn = self._imu_rotation
            self._imu.append(ImuSample(stamp_ns, rotated(turn, self._gyro[:3]), rotated(turn, values[:3])))
            self._imu_ns = stamp_ns
            self._gyro = None

    def _on_power(self, values: Any, stamp_ns: int) -> None:
        self._power = values, stamp_ns
