"""CAN codec, generated from rover.dbc by tools/make_can_codec.py. Change the DBC and run `make codec`.

encode_NAME(values..., counter) -> 8 bytes with alive counter and checksum; ValueError names a value out of its range.
decode_NAME(data) -> a tuple of physical values; WireError("out_of_range") or ("length"). The checksum: can.guard.
Values of unit scale are integers. TABLE: can id -> Row.
"""

from enum import IntEnum
from typing import Any, Callable, NamedTuple

from protocol import WireError
from protocol.can.crc import crc8 as _crc

_new = tuple.__new__
_from_bytes = int.from_bytes
_BYTE = tuple(bytes((value,)) for value in range(256))


class Row(NamedTuple):
    """One frame of the DBC. `cycle_ns`: longest regular interval, 0 without one. `event`: sent on events only."""

    name: str
    can_id: int
    sender: str
    cycle_ns: int
    event: bool
    seed: int
    fields: tuple[str, ...]
    encode: Callable[..., bytes]
    decode: Callable[[bytes], Any]


def _refuse(frame: str, **values: tuple[float, float, float]) -> None:
    for name, (value, low, high) in values.items():
        if not low <= value <= high:
            raise ValueError(f"{frame}.{name} = {value!r} is out of range {low!r} to {high!r}")


def _length(frame: str, data: bytes) -> WireError:
    return WireError("length", f"{frame} of {len(data)} bytes")


DBC_VERSION = 1
DBC_SHA256 = "fc36b9d6e356e62af49e563e655a3e1f8bd9f1a9001b7ed9152bc08973c7251a"


ENCODER_COUNTS_PER_TURN = 4096


class WheelMode(IntEnum):
    """Value table wheel_mode."""

    OFF = 0
    HOLD = 1
    RUN = 2


class TiltMode(IntEnum):
    """Value table tilt_mode."""

    OFF = 0
    PARK = 1
    SWEEP = 2


class TiltState(IntEnum):
    """Value table tilt_state."""

    OFF = 0
    PARKED = 1
    MOVING = 2
    SWEEPING = 3
    GAP = 4
    EMERGENCY_STOP = 5
    RESET_ARMED = 6


class NodeState(IntEnum):
    """Value table node_state."""

    BOOT = 0
    RUNNING = 1
    COMMAND_TIMEOUT = 2
    EMERGENCY_STOP = 3
    RESET_ARMED = 4
    FAULT = 5


class StopReason(IntEnum):
    """Value table stop_reason."""

    NONE = 0
    OPERATOR = 1
    FAULT = 2
    BUTTON = 3
    WATCHDOG = 4
    GUARD = 5


class EmergencyStopFrame(NamedTuple):
    """On the event, then at 10 Hz while asserted; latches on every node."""

    reason: int
    detail: int


def decode_EMERGENCY_STOP_COMPUTER(data):
    if len(data) != 8:
        raise _length("EMERGENCY_STOP", data)
    x = _from_bytes(data, "little")
    return _new(EmergencyStopFrame, ((x & 0xff), (x >> 8 & 0xffff),))


def encode_EMERGENCY_STOP_COMPUTER(reason, detail, counter):
    if not (0 <= reason <= 255 and 0 <= detail <= 65535 and 0 <= counter <= 15):
        _refuse("EMERGENCY_STOP_COMPUTER", reason=(reason, 0, 255), detail=(detail, 0, 65535), counter=(counter, 0, 15))
    x = reason | detail << 8 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x73)]


decode_EMERGENCY_STOP_WHEEL_1 = decode_EMERGENCY_STOP_COMPUTER


def encode_EMERGENCY_STOP_WHEEL_1(reason, detail, counter):
    if not (0 <= reason <= 255 and 0 <= detail <= 65535 and 0 <= counter <= 15):
        _refuse("EMERGENCY_STOP_WHEEL_1", reason=(reason, 0, 255), detail=(detail, 0, 65535), counter=(counter, 0, 15))
    x = reason | detail << 8 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x6e)]


decode_EMERGENCY_STOP_WHEEL_2 = decode_EMERGENCY_STOP_COMPUTER


def encode_EMERGENCY_STOP_WHEEL_2(reason, detail, counter):
    if not (0 <= reason <= 255 and 0 <= detail <= 65535 and 0 <= counter <= 15):
        _refuse("EMERGENCY_STOP_WHEEL_2", reason=(reason, 0, 255), detail=(detail, 0, 65535), counter=(counter, 0, 15))
    x = reason | detail << 8 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x49)]


decode_EMERGENCY_STOP_WHEEL_3 = decode_EMERGENCY_STOP_COMPUTER


def encode_EMERGENCY_STOP_WHEEL_3(reason, detail, counter):
    if not (0 <= reason <= 255 and 0 <= detail <= 65535 and 0 <= counter <= 15):
        _refuse("EMERGENCY_STOP_WHEEL_3", reason=(reason, 0, 255), detail=(detail, 0, 65535), counter=(counter, 0, 15))
    x = reason | detail << 8 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x54)]


decode_EMERGENCY_STOP_WHEEL_4 = decode_EMERGENCY_STOP_COMPUTER


def encode_EMERGENCY_STOP_WHEEL_4(reason, detail, counter):
    if not (0 <= reason <= 255 and 0 <= detail <= 65535 and 0 <= counter <= 15):
        _refuse("EMERGENCY_STOP_WHEEL_4", reason=(reason, 0, 255), detail=(detail, 0, 65535), counter=(counter, 0, 15))
    x = reason | detail << 8 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x7)]


decode_EMERGENCY_STOP_TILT = decode_EMERGENCY_STOP_COMPUTER


def encode_EMERGENCY_STOP_TILT(reason, detail, counter):
    if not (0 <= reason <= 255 and 0 <= detail <= 65535 and 0 <= counter <= 15):
        _refuse("EMERGENCY_STOP_TILT", reason=(reason, 0, 255), detail=(detail, 0, 65535), counter=(counter, 0, 15))
    x = reason | detail << 8 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x1a)]


decode_EMERGENCY_STOP_IMU = decode_EMERGENCY_STOP_COMPUTER


def encode_EMERGENCY_STOP_IMU(reason, detail, counter):
    if not (0 <= reason <= 255 and 0 <= detail <= 65535 and 0 <= counter <= 15):
        _refuse("EMERGENCY_STOP_IMU", reason=(reason, 0, 255), detail=(detail, 0, 65535), counter=(counter, 0, 15))
    x = reason | detail << 8 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x3d)]


decode_EMERGENCY_STOP_POWER = decode_EMERGENCY_STOP_COMPUTER


def encode_EMERGENCY_STOP_POWER(reason, detail, counter):
    if not (0 <= reason <= 255 and 0 <= detail <= 65535 and 0 <= counter <= 15):
        _refuse("EMERGENCY_STOP_POWER", reason=(reason, 0, 255), detail=(detail, 0, 65535), counter=(counter, 0, 15))
    x = reason | detail << 8 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x20)]


decode_EMERGENCY_STOP_GUARD = decode_EMERGENCY_STOP_COMPUTER


def encode_EMERGENCY_STOP_GUARD(reason, detail, counter):
    if not (0 <= reason <= 255 and 0 <= detail <= 65535 and 0 <= counter <= 15):
        _refuse("EMERGENCY_STOP_GUARD", reason=(reason, 0, 255), detail=(detail, 0, 65535), counter=(counter, 0, 15))
    x = reason | detail << 8 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0xc8)]


class ResetRequestFrame(NamedTuple):
    """Two steps release an emergency stop; each node answers with a NODE_HEARTBEAT out of turn."""

    nonce: int
    step: int


def decode_RESET_REQUEST(data):
    if len(data) != 8:
        raise _length("RESET_REQUEST", data)
    x = _from_bytes(data, "little")
    step = x >> 16 & 0x3
    if not 1 <= step <= 2:
        raise WireError("out_of_range", f"RESET_REQUEST.step raw {step}")
    return _new(ResetRequestFrame, ((x & 0xffff), step,))


def encode_RESET_REQUEST(nonce, step, counter):
    if not (0 <= nonce <= 65535 and 1 <= step <= 2 and 0 <= counter <= 15):
        _refuse("RESET_REQUEST", nonce=(nonce, 0, 65535), step=(step, 1, 2), counter=(counter, 0, 15))
    x = nonce | step << 16 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x39)]


class TimeSyncFrame(NamedTuple):
    """Bus time, for start times only: nodes stamp with their own clocks."""

    bus_time_us: int


def decode_TIME_SYNC(data):
    if len(data) != 8:
        raise _length("TIME_SYNC", data)
    x = _from_bytes(data, "little")
    return _new(TimeSyncFrame, ((x & 0xffffffffffff),))


def encode_TIME_SYNC(bus_time_us, counter):
    if not (0 <= bus_time_us <= 281474976710655 and 0 <= counter <= 15):
        _refuse("TIME_SYNC", bus_time_us=(bus_time_us, 0, 281474976710655), counter=(counter, 0, 15))
    x = bus_time_us | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x98)]


class DriveEnableFrame(NamedTuple):
    """Without enable, or 500 ms without this frame, the drives ramp to zero."""

    enable: int
    mode: int


def decode_DRIVE_ENABLE(data):
    if len(data) != 8:
        raise _length("DRIVE_ENABLE", data)
    x = _from_bytes(data, "little")
    return _new(DriveEnableFrame, ((x & 0x1), (x >> 1 & 0xff),))


def encode_DRIVE_ENABLE(enable, mode, counter):
    if not (0 <= enable <= 1 and 0 <= mode <= 255 and 0 <= counter <= 15):
        _refuse("DRIVE_ENABLE", enable=(enable, 0, 1), mode=(mode, 0, 255), counter=(counter, 0, 15))
    x = enable | mode << 1 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0xf2)]


class WheelCommandFrame(NamedTuple):
    """One order; 100 ms without a valid one: the drive ramps to zero, steering is held, the state says so."""

    mode: int
    steer_rad: float
    rate_radps: float


def decode_WHEEL_1_COMMAND(data):
    if len(data) != 8:
        raise _length("WHEEL_COMMAND", data)
    x = _from_bytes(data, "little")
    mode = x & 0x3
    if not 0 <= mode <= 2:
        raise WireError("out_of_range", f"WHEEL_COMMAND.mode raw {mode}")
    steer_rad = ((x >> 2 & 0xffff) ^ 0x8000) - 0x8000
    if not -32000 <= steer_rad <= 32000:
        raise WireError("out_of_range", f"WHEEL_COMMAND.steer_rad raw {steer_rad}")
    rate_radps = ((x >> 18 & 0xffff) ^ 0x8000) - 0x8000
    if not -32000 <= rate_radps <= 32000:
        raise WireError("out_of_range", f"WHEEL_COMMAND.rate_radps raw {rate_radps}")
    return _new(WheelCommandFrame, (mode, steer_rad * 0.0001, rate_radps * 0.0005,))


def encode_WHEEL_1_COMMAND(mode, steer_rad, rate_radps, counter):
    if not (0 <= mode <= 2 and -3.2 <= steer_rad <= 3.2 and -16 <= rate_radps <= 16 and 0 <= counter <= 15):
        _refuse("WHEEL_1_COMMAND", mode=(mode, 0, 2), steer_rad=(steer_rad, -3.2, 3.2), rate_radps=(rate_radps, -16, 16), counter=(counter, 0, 15))
    x = mode | (round(steer_rad / 0.0001) & 0xffff) << 2 | (round(rate_radps / 0.0005) & 0xffff) << 18 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0xef)]


decode_WHEEL_2_COMMAND = decode_WHEEL_1_COMMAND


def encode_WHEEL_2_COMMAND(mode, steer_rad, rate_radps, counter):
    if not (0 <= mode <= 2 and -3.2 <= steer_rad <= 3.2 and -16 <= rate_radps <= 16 and 0 <= counter <= 15):
        _refuse("WHEEL_2_COMMAND", mode=(mode, 0, 2), steer_rad=(steer_rad, -3.2, 3.2), rate_radps=(rate_radps, -16, 16), counter=(counter, 0, 15))
    x = mode | (round(steer_rad / 0.0001) & 0xffff) << 2 | (round(rate_radps / 0.0005) & 0xffff) << 18 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0xc8)]


decode_WHEEL_3_COMMAND = decode_WHEEL_1_COMMAND


def encode_WHEEL_3_COMMAND(mode, steer_rad, rate_radps, counter):
    if not (0 <= mode <= 2 and -3.2 <= steer_rad <= 3.2 and -16 <= rate_radps <= 16 and 0 <= counter <= 15):
        _refuse("WHEEL_3_COMMAND", mode=(mode, 0, 2), steer_rad=(steer_rad, -3.2, 3.2), rate_radps=(rate_radps, -16, 16), counter=(counter, 0, 15))
    x = mode | (round(steer_rad / 0.0001) & 0xffff) << 2 | (round(rate_radps / 0.0005) & 0xffff) << 18 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0xd5)]


decode_WHEEL_4_COMMAND = decode_WHEEL_1_COMMAND


def encode_WHEEL_4_COMMAND(mode, steer_rad, rate_radps, counter):
    if not (0 <= mode <= 2 and -3.2 <= steer_rad <= 3.2 and -16 <= rate_radps <= 16 and 0 <= counter <= 15):
        _refuse("WHEEL_4_COMMAND", mode=(mode, 0, 2), steer_rad=(steer_rad, -3.2, 3.2), rate_radps=(rate_radps, -16, 16), counter=(counter, 0, 15))
    x = mode | (round(steer_rad / 0.0001) & 0xffff) << 2 | (round(rate_radps / 0.0005) & 0xffff) << 18 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x86)]


class TiltCommandFrame(NamedTuple):
    """One segment of constant rate, sent at least 0.2 s ahead, repeated at 10 Hz; frames with one start time are one command."""

    start_rad: float
    end_rad: float
    rate_radps: float
    start_ms: int
    mode: int


def decode_TILT_COMMAND(data):
    if len(data) != 8:
        raise _length("TILT_COMMAND", data)
    x = _from_bytes(data, "little")
    mode = x >> 50 & 0x3
    if not 0 <= mode <= 2:
        raise WireError("out_of_range", f"TILT_COMMAND.mode raw {mode}")
    return _new(TiltCommandFrame, ((((x & 0x1fff) ^ 0x1000) - 0x1000) * 0.00034906585039886593, (((x >> 13 & 0x1fff) ^ 0x1000) - 0x1000) * 0.00034906585039886593, (x >> 26 & 0xff) * 0.002181661564992912, (x >> 34 & 0xffff), mode,))


def encode_TILT_COMMAND(start_rad, end_rad, rate_radps, start_ms, mode, counter):
    if not (-1.4297737232337548 <= start_rad <= 1.429424657383356 and -1.4297737232337548 <= end_rad <= 1.429424657383356 and 0 <= rate_radps <= 0.5563236990731926 and 0 <= start_ms <= 65535 and 0 <= mode <= 2 and 0 <= counter <= 15):
        _refuse("TILT_COMMAND", start_rad=(start_rad, -1.4297737232337548, 1.429424657383356), end_rad=(end_rad, -1.4297737232337548, 1.429424657383356), rate_radps=(rate_radps, 0, 0.5563236990731926), start_ms=(start_ms, 0, 65535), mode=(mode, 0, 2), counter=(counter, 0, 15))
    x = (round(start_rad / 0.00034906585039886593) & 0x1fff) | (round(end_rad / 0.00034906585039886593) & 0x1fff) << 13 | round(rate_radps / 0.002181661564992912) << 26 | start_ms << 34 | mode << 50 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x75)]


class WheelFeedbackFrame(NamedTuple):
    """What the wheel does, at the same instant for all fields."""

    steer_rad: float
    encoder_count: int
    rate_radps: float
    state: int


def decode_WHEEL_1_FEEDBACK(data):
    if len(data) != 8:
        raise _length("WHEEL_FEEDBACK", data)
    x = _from_bytes(data, "little")
    steer_rad = ((x & 0xffff) ^ 0x8000) - 0x8000
    if not -32767 <= steer_rad <= 32767:
        raise WireError("out_of_range", f"WHEEL_FEEDBACK.steer_rad raw {steer_rad}")
    rate_radps = ((x >> 32 & 0xffff) ^ 0x8000) - 0x8000
    if not -32767 <= rate_radps <= 32767:
        raise WireError("out_of_range", f"WHEEL_FEEDBACK.rate_radps raw {rate_radps}")
    return _new(WheelFeedbackFrame, (steer_rad * 0.0001, (x >> 16 & 0xffff), rate_radps * 0.0005, (x >> 48 & 0xf),))


def encode_WHEEL_1_FEEDBACK(steer_rad, encoder_count, rate_radps, state, counter):
    if not (-3.2767 <= steer_rad <= 3.2767 and 0 <= encoder_count <= 65535 and -16.3835 <= rate_radps <= 16.3835 and 0 <= state <= 15 and 0 <= counter <= 15):
        _refuse("WHEEL_1_FEEDBACK", steer_rad=(steer_rad, -3.2767, 3.2767), encoder_count=(encoder_count, 0, 65535), rate_radps=(rate_radps, -16.3835, 16.3835), state=(state, 0, 15), counter=(counter, 0, 15))
    x = (round(steer_rad / 0.0001) & 0xffff) | encoder_count << 16 | (round(rate_radps / 0.0005) & 0xffff) << 32 | state << 48 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0xc9)]


decode_WHEEL_2_FEEDBACK = decode_WHEEL_1_FEEDBACK


def encode_WHEEL_2_FEEDBACK(steer_rad, encoder_count, rate_radps, state, counter):
    if not (-3.2767 <= steer_rad <= 3.2767 and 0 <= encoder_count <= 65535 and -16.3835 <= rate_radps <= 16.3835 and 0 <= state <= 15 and 0 <= counter <= 15):
        _refuse("WHEEL_2_FEEDBACK", steer_rad=(steer_rad, -3.2767, 3.2767), encoder_count=(encoder_count, 0, 65535), rate_radps=(rate_radps, -16.3835, 16.3835), state=(state, 0, 15), counter=(counter, 0, 15))
    x = (round(steer_rad / 0.0001) & 0xffff) | encoder_count << 16 | (round(rate_radps / 0.0005) & 0xffff) << 32 | state << 48 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0xee)]


decode_WHEEL_3_FEEDBACK = decode_WHEEL_1_FEEDBACK


def encode_WHEEL_3_FEEDBACK(steer_rad, encoder_count, rate_radps, state, counter):
    if not (-3.2767 <= steer_rad <= 3.2767 and 0 <= encoder_count <= 65535 and -16.3835 <= rate_radps <= 16.3835 and 0 <= state <= 15 and 0 <= counter <= 15):
        _refuse("WHEEL_3_FEEDBACK", steer_rad=(steer_rad, -3.2767, 3.2767), encoder_count=(encoder_count, 0, 65535), rate_radps=(rate_radps, -16.3835, 16.3835), state=(state, 0, 15), counter=(counter, 0, 15))
    x = (round(steer_rad / 0.0001) & 0xffff) | encoder_count << 16 | (round(rate_radps / 0.0005) & 0xffff) << 32 | state << 48 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0xf3)]


decode_WHEEL_4_FEEDBACK = decode_WHEEL_1_FEEDBACK


def encode_WHEEL_4_FEEDBACK(steer_rad, encoder_count, rate_radps, state, counter):
    if not (-3.2767 <= steer_rad <= 3.2767 and 0 <= encoder_count <= 65535 and -16.3835 <= rate_radps <= 16.3835 and 0 <= state <= 15 and 0 <= counter <= 15):
        _refuse("WHEEL_4_FEEDBACK", steer_rad=(steer_rad, -3.2767, 3.2767), encoder_count=(encoder_count, 0, 65535), rate_radps=(rate_radps, -16.3835, 16.3835), state=(state, 0, 15), counter=(counter, 0, 15))
    x = (round(steer_rad / 0.0001) & 0xffff) | encoder_count << 16 | (round(rate_radps / 0.0005) & 0xffff) << 32 | state << 48 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0xa0)]


class WheelStatusFrame(NamedTuple):
    """Housekeeping of one wheel."""

    drive_current_a: float
    steer_current_a: float
    temperature_c: int
    faults: int


def decode_WHEEL_1_STATUS(data):
    if len(data) != 8:
        raise _length("WHEEL_STATUS", data)
    x = _from_bytes(data, "little")
    drive_current_a = ((x & 0xfff) ^ 0x800) - 0x800
    if not -2047 <= drive_current_a <= 2047:
        raise WireError("out_of_range", f"WHEEL_STATUS.drive_current_a raw {drive_current_a}")
    steer_current_a = ((x >> 12 & 0xfff) ^ 0x800) - 0x800
    if not -2047 <= steer_current_a <= 2047:
        raise WireError("out_of_range", f"WHEEL_STATUS.steer_current_a raw {steer_current_a}")
    return _new(WheelStatusFrame, (drive_current_a * 0.01, steer_current_a * 0.01, (((x >> 24 & 0xff) ^ 0x80) - 0x80), (x >> 32 & 0xffff),))


def encode_WHEEL_1_STATUS(drive_current_a, steer_current_a, temperature_c, faults, counter):
    if not (-20.47 <= drive_current_a <= 20.47 and -20.47 <= steer_current_a <= 20.47 and -128 <= temperature_c <= 127 and 0 <= faults <= 65535 and 0 <= counter <= 15):
        _refuse("WHEEL_1_STATUS", drive_current_a=(drive_current_a, -20.47, 20.47), steer_current_a=(steer_current_a, -20.47, 20.47), temperature_c=(temperature_c, -128, 127), faults=(faults, 0, 65535), counter=(counter, 0, 15))
    x = (round(drive_current_a / 0.01) & 0xfff) | (round(steer_current_a / 0.01) & 0xfff) << 12 | (temperature_c & 0xff) << 24 | faults << 32 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x4e)]


decode_WHEEL_2_STATUS = decode_WHEEL_1_STATUS


def encode_WHEEL_2_STATUS(drive_current_a, steer_current_a, temperature_c, faults, counter):
    if not (-20.47 <= drive_current_a <= 20.47 and -20.47 <= steer_current_a <= 20.47 and -128 <= temperature_c <= 127 and 0 <= faults <= 65535 and 0 <= counter <= 15):
        _refuse("WHEEL_2_STATUS", drive_current_a=(drive_current_a, -20.47, 20.47), steer_current_a=(steer_current_a, -20.47, 20.47), temperature_c=(temperature_c, -128, 127), faults=(faults, 0, 65535), counter=(counter, 0, 15))
    x = (round(drive_current_a / 0.01) & 0xfff) | (round(steer_current_a / 0.01) & 0xfff) << 12 | (temperature_c & 0xff) << 24 | faults << 32 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x69)]


decode_WHEEL_3_STATUS = decode_WHEEL_1_STATUS


def encode_WHEEL_3_STATUS(drive_current_a, steer_current_a, temperature_c, faults, counter):
    if not (-20.47 <= drive_current_a <= 20.47 and -20.47 <= steer_current_a <= 20.47 and -128 <= temperature_c <= 127 and 0 <= faults <= 65535 and 0 <= counter <= 15):
        _refuse("WHEEL_3_STATUS", drive_current_a=(drive_current_a, -20.47, 20.47), steer_current_a=(steer_current_a, -20.47, 20.47), temperature_c=(temperature_c, -128, 127), faults=(faults, 0, 65535), counter=(counter, 0, 15))
    x = (round(drive_current_a / 0.01) & 0xfff) | (round(steer_current_a / 0.01) & 0xfff) << 12 | (temperature_c & 0xff) << 24 | faults << 32 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x74)]


decode_WHEEL_4_STATUS = decode_WHEEL_1_STATUS


def encode_WHEEL_4_STATUS(drive_current_a, steer_current_a, temperature_c, faults, counter):
    if not (-20.47 <= drive_current_a <= 20.47 and -20.47 <= steer_current_a <= 20.47 and -128 <= temperature_c <= 127 and 0 <= faults <= 65535 and 0 <= counter <= 15):
        _refuse("WHEEL_4_STATUS", drive_current_a=(drive_current_a, -20.47, 20.47), steer_current_a=(steer_current_a, -20.47, 20.47), temperature_c=(temperature_c, -128, 127), faults=(faults, 0, 65535), counter=(counter, 0, 15))
    x = (round(drive_current_a / 0.01) & 0xfff) | (round(steer_current_a / 0.01) & 0xfff) << 12 | (temperature_c & 0xff) << 24 | faults << 32 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x27)]


class TiltFeedbackFrame(NamedTuple):
    """200 Hz while the axis sweeps, 10 Hz parked."""

    node_time_us: int
    angle_rad: float
    rate_radps: float
    state: int


def decode_TILT_FEEDBACK(data):
    if len(data) != 8:
        raise _length("TILT_FEEDBACK", data)
    x = _from_bytes(data, "little")
    return _new(TiltFeedbackFrame, ((x & 0xffffff), (((x >> 24 & 0xfff) ^ 0x800) - 0x800) * 0.0015339807878856412, (((x >> 36 & 0xfff) ^ 0x800) - 0x800) * 0.0003, (x >> 48 & 0xf),))


def encode_TILT_FEEDBACK(node_time_us, angle_rad, rate_radps, state, counter):
    if not (0 <= node_time_us <= 16777215 and -3.141592653589793 <= angle_rad <= 3.1400586728019073 and -0.6144 <= rate_radps <= 0.6141 and 0 <= state <= 15 and 0 <= counter <= 15):
        _refuse("TILT_FEEDBACK", node_time_us=(node_time_us, 0, 16777215), angle_rad=(angle_rad, -3.141592653589793, 3.1400586728019073), rate_radps=(rate_radps, -0.6144, 0.6141), state=(state, 0, 15), counter=(counter, 0, 15))
    x = node_time_us | (round(angle_rad / 0.0015339807878856412) & 0xfff) << 24 | (round(rate_radps / 0.0003) & 0xfff) << 36 | state << 48 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0xc7)]


class ImuGyroFrame(NamedTuple):
    """Angular rate."""

    x_radps: float
    y_radps: float
    z_radps: float
    status: int


def decode_IMU_GYRO(data):
    if len(data) != 8:
        raise _length("IMU_GYRO", data)
    x = _from_bytes(data, "little")
    x_radps = ((x & 0xffff) ^ 0x8000) - 0x8000
    if not -32767 <= x_radps <= 32767:
        raise WireError("out_of_range", f"IMU_GYRO.x_radps raw {x_radps}")
    y_radps = ((x >> 16 & 0xffff) ^ 0x8000) - 0x8000
    if not -32767 <= y_radps <= 32767:
        raise WireError("out_of_range", f"IMU_GYRO.y_radps raw {y_radps}")
    z_radps = ((x >> 32 & 0xffff) ^ 0x8000) - 0x8000
    if not -32767 <= z_radps <= 32767:
        raise WireError("out_of_range", f"IMU_GYRO.z_radps raw {z_radps}")
    return _new(ImuGyroFrame, (x_radps * 0.0001, y_radps * 0.0001, z_radps * 0.0001, (x >> 48 & 0xf),))


def encode_IMU_GYRO(x_radps, y_radps, z_radps, status, counter):
    if not (-3.2767 <= x_radps <= 3.2767 and -3.2767 <= y_radps <= 3.2767 and -3.2767 <= z_radps <= 3.2767 and 0 <= status <= 15 and 0 <= counter <= 15):
        _refuse("IMU_GYRO", x_radps=(x_radps, -3.2767, 3.2767), y_radps=(y_radps, -3.2767, 3.2767), z_radps=(z_radps, -3.2767, 3.2767), status=(status, 0, 15), counter=(counter, 0, 15))
    x = (round(x_radps / 0.0001) & 0xffff) | (round(y_radps / 0.0001) & 0xffff) << 16 | (round(z_radps / 0.0001) & 0xffff) << 32 | status << 48 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0xa)]


class ImuAccelFrame(NamedTuple):
    """Specific force, sampled with the gyro frame before it."""

    x_mps2: float
    y_mps2: float
    z_mps2: float
    status: int


def decode_IMU_ACCEL(data):
    if len(data) != 8:
        raise _length("IMU_ACCEL", data)
    x = _from_bytes(data, "little")
    x_mps2 = ((x & 0xffff) ^ 0x8000) - 0x8000
    if not -32767 <= x_mps2 <= 32767:
        raise WireError("out_of_range", f"IMU_ACCEL.x_mps2 raw {x_mps2}")
    y_mps2 = ((x >> 16 & 0xffff) ^ 0x8000) - 0x8000
    if not -32767 <= y_mps2 <= 32767:
        raise WireError("out_of_range", f"IMU_ACCEL.y_mps2 raw {y_mps2}")
    z_mps2 = ((x >> 32 & 0xffff) ^ 0x8000) - 0x8000
    if not -32767 <= z_mps2 <= 32767:
        raise WireError("out_of_range", f"IMU_ACCEL.z_mps2 raw {z_mps2}")
    return _new(ImuAccelFrame, (x_mps2 * 0.001, y_mps2 * 0.001, z_mps2 * 0.001, (x >> 48 & 0xf),))


def encode_IMU_ACCEL(x_mps2, y_mps2, z_mps2, status, counter):
    if not (-32.767 <= x_mps2 <= 32.767 and -32.767 <= y_mps2 <= 32.767 and -32.767 <= z_mps2 <= 32.767 and 0 <= status <= 15 and 0 <= counter <= 15):
        _refuse("IMU_ACCEL", x_mps2=(x_mps2, -32.767, 32.767), y_mps2=(y_mps2, -32.767, 32.767), z_mps2=(z_mps2, -32.767, 32.767), status=(status, 0, 15), counter=(counter, 0, 15))
    x = (round(x_mps2 / 0.001) & 0xffff) | (round(y_mps2 / 0.001) & 0xffff) << 16 | (round(z_mps2 / 0.001) & 0xffff) << 32 | status << 48 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x17)]


class PowerStatusFrame(NamedTuple):
    """The power system."""

    voltage_v: float
    current_a: float
    charge_ratio: float
    temperature_c: int
    switches: int


def decode_POWER_STATUS(data):
    if len(data) != 8:
        raise _length("POWER_STATUS", data)
    x = _from_bytes(data, "little")
    current_a = ((x >> 12 & 0xfff) ^ 0x800) - 0x800
    if not -2047 <= current_a <= 2047:
        raise WireError("out_of_range", f"POWER_STATUS.current_a raw {current_a}")
    charge_ratio = x >> 24 & 0xff
    if not 0 <= charge_ratio <= 250:
        raise WireError("out_of_range", f"POWER_STATUS.charge_ratio raw {charge_ratio}")
    return _new(PowerStatusFrame, ((x & 0xfff) * 0.01, current_a * 0.02, charge_ratio * 0.004, (((x >> 32 & 0xff) ^ 0x80) - 0x80), (x >> 40 & 0xff),))


def encode_POWER_STATUS(voltage_v, current_a, charge_ratio, temperature_c, switches, counter):
    if not (0 <= voltage_v <= 40.95 and -40.94 <= current_a <= 40.94 and 0 <= charge_ratio <= 1 and -128 <= temperature_c <= 127 and 0 <= switches <= 255 and 0 <= counter <= 15):
        _refuse("POWER_STATUS", voltage_v=(voltage_v, 0, 40.95), current_a=(current_a, -40.94, 40.94), charge_ratio=(charge_ratio, 0, 1), temperature_c=(temperature_c, -128, 127), switches=(switches, 0, 255), counter=(counter, 0, 15))
    x = round(voltage_v / 0.01) | (round(current_a / 0.02) & 0xfff) << 12 | round(charge_ratio / 0.004) << 24 | (temperature_c & 0xff) << 32 | switches << 40 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x26)]


class ComputerHeartbeatFrame(NamedTuple):
    """The computer lives."""

    mode: int
    beats: int
    boot_count: int


def decode_COMPUTER_HEARTBEAT(data):
    if len(data) != 8:
        raise _length("COMPUTER_HEARTBEAT", data)
    x = _from_bytes(data, "little")
    return _new(ComputerHeartbeatFrame, ((x & 0xff), (x >> 8 & 0xffff), (x >> 24 & 0xffff),))


def encode_COMPUTER_HEARTBEAT(mode, beats, boot_count, counter):
    if not (0 <= mode <= 255 and 0 <= beats <= 65535 and 0 <= boot_count <= 65535 and 0 <= counter <= 15):
        _refuse("COMPUTER_HEARTBEAT", mode=(mode, 0, 255), beats=(beats, 0, 65535), boot_count=(boot_count, 0, 65535), counter=(counter, 0, 15))
    x = mode | beats << 8 | boot_count << 24 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x6a)]


class NodeHeartbeatFrame(NamedTuple):
    """At 2 Hz, and out of turn as the answer to RESET_REQUEST."""

    state: int
    uptime_s: int
    tx_errors: int
    rx_errors: int
    firmware: int
    dbc_version: int


def decode_NODE_HEARTBEAT_WHEEL_1(data):
    if len(data) != 8:
        raise _length("NODE_HEARTBEAT", data)
    x = _from_bytes(data, "little")
    return _new(NodeHeartbeatFrame, ((x & 0xf), (x >> 4 & 0xffff), (x >> 20 & 0xff), (x >> 28 & 0xff), (x >> 36 & 0xff), (x >> 44 & 0xff),))


def encode_NODE_HEARTBEAT_WHEEL_1(state, uptime_s, tx_errors, rx_errors, firmware, dbc_version, counter):
    if not (0 <= state <= 15 and 0 <= uptime_s <= 65535 and 0 <= tx_errors <= 255 and 0 <= rx_errors <= 255 and 0 <= firmware <= 255 and 0 <= dbc_version <= 255 and 0 <= counter <= 15):
        _refuse("NODE_HEARTBEAT_WHEEL_1", state=(state, 0, 15), uptime_s=(uptime_s, 0, 65535), tx_errors=(tx_errors, 0, 255), rx_errors=(rx_errors, 0, 255), firmware=(firmware, 0, 255), dbc_version=(dbc_version, 0, 255), counter=(counter, 0, 15))
    x = state | uptime_s << 4 | tx_errors << 20 | rx_errors << 28 | firmware << 36 | dbc_version << 44 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x77)]


decode_NODE_HEARTBEAT_WHEEL_2 = decode_NODE_HEARTBEAT_WHEEL_1


def encode_NODE_HEARTBEAT_WHEEL_2(state, uptime_s, tx_errors, rx_errors, firmware, dbc_version, counter):
    if not (0 <= state <= 15 and 0 <= uptime_s <= 65535 and 0 <= tx_errors <= 255 and 0 <= rx_errors <= 255 and 0 <= firmware <= 255 and 0 <= dbc_version <= 255 and 0 <= counter <= 15):
        _refuse("NODE_HEARTBEAT_WHEEL_2", state=(state, 0, 15), uptime_s=(uptime_s, 0, 65535), tx_errors=(tx_errors, 0, 255), rx_errors=(rx_errors, 0, 255), firmware=(firmware, 0, 255), dbc_version=(dbc_version, 0, 255), counter=(counter, 0, 15))
    x = state | uptime_s << 4 | tx_errors << 20 | rx_errors << 28 | firmware << 36 | dbc_version << 44 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x50)]


decode_NODE_HEARTBEAT_WHEEL_3 = decode_NODE_HEARTBEAT_WHEEL_1


def encode_NODE_HEARTBEAT_WHEEL_3(state, uptime_s, tx_errors, rx_errors, firmware, dbc_version, counter):
    if not (0 <= state <= 15 and 0 <= uptime_s <= 65535 and 0 <= tx_errors <= 255 and 0 <= rx_errors <= 255 and 0 <= firmware <= 255 and 0 <= dbc_version <= 255 and 0 <= counter <= 15):
        _refuse("NODE_HEARTBEAT_WHEEL_3", state=(state, 0, 15), uptime_s=(uptime_s, 0, 65535), tx_errors=(tx_errors, 0, 255), rx_errors=(rx_errors, 0, 255), firmware=(firmware, 0, 255), dbc_version=(dbc_version, 0, 255), counter=(counter, 0, 15))
    x = state | uptime_s << 4 | tx_errors << 20 | rx_errors << 28 | firmware << 36 | dbc_version << 44 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x4d)]


decode_NODE_HEARTBEAT_WHEEL_4 = decode_NODE_HEARTBEAT_WHEEL_1


def encode_NODE_HEARTBEAT_WHEEL_4(state, uptime_s, tx_errors, rx_errors, firmware, dbc_version, counter):
    if not (0 <= state <= 15 and 0 <= uptime_s <= 65535 and 0 <= tx_errors <= 255 and 0 <= rx_errors <= 255 and 0 <= firmware <= 255 and 0 <= dbc_version <= 255 and 0 <= counter <= 15):
        _refuse("NODE_HEARTBEAT_WHEEL_4", state=(state, 0, 15), uptime_s=(uptime_s, 0, 65535), tx_errors=(tx_errors, 0, 255), rx_errors=(rx_errors, 0, 255), firmware=(firmware, 0, 255), dbc_version=(dbc_version, 0, 255), counter=(counter, 0, 15))
    x = state | uptime_s << 4 | tx_errors << 20 | rx_errors << 28 | firmware << 36 | dbc_version << 44 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x1e)]


decode_NODE_HEARTBEAT_TILT = decode_NODE_HEARTBEAT_WHEEL_1


def encode_NODE_HEARTBEAT_TILT(state, uptime_s, tx_errors, rx_errors, firmware, dbc_version, counter):
    if not (0 <= state <= 15 and 0 <= uptime_s <= 65535 and 0 <= tx_errors <= 255 and 0 <= rx_errors <= 255 and 0 <= firmware <= 255 and 0 <= dbc_version <= 255 and 0 <= counter <= 15):
        _refuse("NODE_HEARTBEAT_TILT", state=(state, 0, 15), uptime_s=(uptime_s, 0, 65535), tx_errors=(tx_errors, 0, 255), rx_errors=(rx_errors, 0, 255), firmware=(firmware, 0, 255), dbc_version=(dbc_version, 0, 255), counter=(counter, 0, 15))
    x = state | uptime_s << 4 | tx_errors << 20 | rx_errors << 28 | firmware << 36 | dbc_version << 44 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x3)]


decode_NODE_HEARTBEAT_IMU = decode_NODE_HEARTBEAT_WHEEL_1


def encode_NODE_HEARTBEAT_IMU(state, uptime_s, tx_errors, rx_errors, firmware, dbc_version, counter):
    if not (0 <= state <= 15 and 0 <= uptime_s <= 65535 and 0 <= tx_errors <= 255 and 0 <= rx_errors <= 255 and 0 <= firmware <= 255 and 0 <= dbc_version <= 255 and 0 <= counter <= 15):
        _refuse("NODE_HEARTBEAT_IMU", state=(state, 0, 15), uptime_s=(uptime_s, 0, 65535), tx_errors=(tx_errors, 0, 255), rx_errors=(rx_errors, 0, 255), firmware=(firmware, 0, 255), dbc_version=(dbc_version, 0, 255), counter=(counter, 0, 15))
    x = state | uptime_s << 4 | tx_errors << 20 | rx_errors << 28 | firmware << 36 | dbc_version << 44 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x24)]


decode_NODE_HEARTBEAT_POWER = decode_NODE_HEARTBEAT_WHEEL_1


def encode_NODE_HEARTBEAT_POWER(state, uptime_s, tx_errors, rx_errors, firmware, dbc_version, counter):
    if not (0 <= state <= 15 and 0 <= uptime_s <= 65535 and 0 <= tx_errors <= 255 and 0 <= rx_errors <= 255 and 0 <= firmware <= 255 and 0 <= dbc_version <= 255 and 0 <= counter <= 15):
        _refuse("NODE_HEARTBEAT_POWER", state=(state, 0, 15), uptime_s=(uptime_s, 0, 65535), tx_errors=(tx_errors, 0, 255), rx_errors=(rx_errors, 0, 255), firmware=(firmware, 0, 255), dbc_version=(dbc_version, 0, 255), counter=(counter, 0, 15))
    x = state | uptime_s << 4 | tx_errors << 20 | rx_errors << 28 | firmware << 36 | dbc_version << 44 | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, 0x39)]


TABLE: dict[int, Row] = {
    0x010: Row("EMERGENCY_STOP_COMPUTER", 0x010, "COMPUTER", 100000000, True, 0x73, ('reason', 'detail'), encode_EMERGENCY_STOP_COMPUTER, decode_EMERGENCY_STOP_COMPUTER),
    0x011: Row("EMERGENCY_STOP_WHEEL_1", 0x011, "WHEEL_1", 100000000, True, 0x6e, ('reason', 'detail'), encode_EMERGENCY_STOP_WHEEL_1, decode_EMERGENCY_STOP_WHEEL_1),
    0x012: Row("EMERGENCY_STOP_WHEEL_2", 0x012, "WHEEL_2", 100000000, True, 0x49, ('reason', 'detail'), encode_EMERGENCY_STOP_WHEEL_2, decode_EMERGENCY_STOP_WHEEL_2),
    0x013: Row("EMERGENCY_STOP_WHEEL_3", 0x013, "WHEEL_3", 100000000, True, 0x54, ('reason', 'detail'), encode_EMERGENCY_STOP_WHEEL_3, decode_EMERGENCY_STOP_WHEEL_3),
    0x014: Row("EMERGENCY_STOP_WHEEL_4", 0x014, "WHEEL_4", 100000000, True, 0x07, ('reason', 'detail'), encode_EMERGENCY_STOP_WHEEL_4, decode_EMERGENCY_STOP_WHEEL_4),
    0x015: Row("EMERGENCY_STOP_TILT", 0x015, "TILT", 100000000, True, 0x1a, ('reason', 'detail'), encode_EMERGENCY_STOP_TILT, decode_EMERGENCY_STOP_TILT),
    0x016: Row("EMERGENCY_STOP_IMU", 0x016, "IMU", 100000000, True, 0x3d, ('reason', 'detail'), encode_EMERGENCY_STOP_IMU, decode_EMERGENCY_STOP_IMU),
    0x017: Row("EMERGENCY_STOP_POWER", 0x017, "POWER", 100000000, True, 0x20, ('reason', 'detail'), encode_EMERGENCY_STOP_POWER, decode_EMERGENCY_STOP_POWER),
    0x01f: Row("EMERGENCY_STOP_GUARD", 0x01f, "GUARD", 100000000, True, 0xc8, ('reason', 'detail'), encode_EMERGENCY_STOP_GUARD, decode_EMERGENCY_STOP_GUARD),
    0x020: Row("RESET_REQUEST", 0x020, "COMPUTER", 0, True, 0x39, ('nonce', 'step'), encode_RESET_REQUEST, decode_RESET_REQUEST),
    0x080: Row("TIME_SYNC", 0x080, "COMPUTER", 100000000, False, 0x98, ('bus_time_us',), encode_TIME_SYNC, decode_TIME_SYNC),
    0x100: Row("DRIVE_ENABLE", 0x100, "COMPUTER", 100000000, False, 0xf2, ('enable', 'mode'), encode_DRIVE_ENABLE, decode_DRIVE_ENABLE),
    0x101: Row("WHEEL_1_COMMAND", 0x101, "COMPUTER", 20000000, False, 0xef, ('mode', 'steer_rad', 'rate_radps'), encode_WHEEL_1_COMMAND, decode_WHEEL_1_COMMAND),
    0x102: Row("WHEEL_2_COMMAND", 0x102, "COMPUTER", 20000000, False, 0xc8, ('mode', 'steer_rad', 'rate_radps'), encode_WHEEL_2_COMMAND, decode_WHEEL_2_COMMAND),
    0x103: Row("WHEEL_3_COMMAND", 0x103, "COMPUTER", 20000000, False, 0xd5, ('mode', 'steer_rad', 'rate_radps'), encode_WHEEL_3_COMMAND, decode_WHEEL_3_COMMAND),
    0x104: Row("WHEEL_4_COMMAND", 0x104, "COMPUTER", 20000000, False, 0x86, ('mode', 'steer_rad', 'rate_radps'), encode_WHEEL_4_COMMAND, decode_WHEEL_4_COMMAND),
    0x120: Row("TILT_COMMAND", 0x120, "COMPUTER", 100000000, False, 0x75, ('start_rad', 'end_rad', 'rate_radps', 'start_ms', 'mode'), encode_TILT_COMMAND, decode_TILT_COMMAND),
    0x181: Row("WHEEL_1_FEEDBACK", 0x181, "WHEEL_1", 10000000, False, 0xc9, ('steer_rad', 'encoder_count', 'rate_radps', 'state'), encode_WHEEL_1_FEEDBACK, decode_WHEEL_1_FEEDBACK),
    0x182: Row("WHEEL_2_FEEDBACK", 0x182, "WHEEL_2", 10000000, False, 0xee, ('steer_rad', 'encoder_count', 'rate_radps', 'state'), encode_WHEEL_2_FEEDBACK, decode_WHEEL_2_FEEDBACK),
    0x183: Row("WHEEL_3_FEEDBACK", 0x183, "WHEEL_3", 10000000, False, 0xf3, ('steer_rad', 'encoder_count', 'rate_radps', 'state'), encode_WHEEL_3_FEEDBACK, decode_WHEEL_3_FEEDBACK),
    0x184: Row("WHEEL_4_FEEDBACK", 0x184, "WHEEL_4", 10000000, False, 0xa0, ('steer_rad', 'encoder_count', 'rate_radps', 'state'), encode_WHEEL_4_FEEDBACK, decode_WHEEL_4_FEEDBACK),
    0x1a1: Row("WHEEL_1_STATUS", 0x1a1, "WHEEL_1", 50000000, False, 0x4e, ('drive_current_a', 'steer_current_a', 'temperature_c', 'faults'), encode_WHEEL_1_STATUS, decode_WHEEL_1_STATUS),
    0x1a2: Row("WHEEL_2_STATUS", 0x1a2, "WHEEL_2", 50000000, False, 0x69, ('drive_current_a', 'steer_current_a', 'temperature_c', 'faults'), encode_WHEEL_2_STATUS, decode_WHEEL_2_STATUS),
    0x1a3: Row("WHEEL_3_STATUS", 0x1a3, "WHEEL_3", 50000000, False, 0x74, ('drive_current_a', 'steer_current_a', 'temperature_c', 'faults'), encode_WHEEL_3_STATUS, decode_WHEEL_3_STATUS),
    0x1a4: Row("WHEEL_4_STATUS", 0x1a4, "WHEEL_4", 50000000, False, 0x27, ('drive_current_a', 'steer_current_a', 'temperature_c', 'faults'), encode_WHEEL_4_STATUS, decode_WHEEL_4_STATUS),
    0x1c0: Row("TILT_FEEDBACK", 0x1c0, "TILT", 100000000, False, 0xc7, ('node_time_us', 'angle_rad', 'rate_radps', 'state'), encode_TILT_FEEDBACK, decode_TILT_FEEDBACK),
    0x1d0: Row("IMU_GYRO", 0x1d0, "IMU", 10000000, False, 0x0a, ('x_radps', 'y_radps', 'z_radps', 'status'), encode_IMU_GYRO, decode_IMU_GYRO),
    0x1d1: Row("IMU_ACCEL", 0x1d1, "IMU", 10000000, False, 0x17, ('x_mps2', 'y_mps2', 'z_mps2', 'status'), encode_IMU_ACCEL, decode_IMU_ACCEL),
    0x200: Row("POWER_STATUS", 0x200, "POWER", 200000000, False, 0x26, ('voltage_v', 'current_a', 'charge_ratio', 'temperature_c', 'switches'), encode_POWER_STATUS, decode_POWER_STATUS),
    0x300: Row("COMPUTER_HEARTBEAT", 0x300, "COMPUTER", 100000000, False, 0x6a, ('mode', 'beats', 'boot_count'), encode_COMPUTER_HEARTBEAT, decode_COMPUTER_HEARTBEAT),
    0x301: Row("NODE_HEARTBEAT_WHEEL_1", 0x301, "WHEEL_1", 500000000, False, 0x77, ('state', 'uptime_s', 'tx_errors', 'rx_errors', 'firmware', 'dbc_version'), encode_NODE_HEARTBEAT_WHEEL_1, decode_NODE_HEARTBEAT_WHEEL_1),
    0x302: Row("NODE_HEARTBEAT_WHEEL_2", 0x302, "WHEEL_2", 500000000, False, 0x50, ('state', 'uptime_s', 'tx_errors', 'rx_errors', 'firmware', 'dbc_version'), encode_NODE_HEARTBEAT_WHEEL_2, decode_NODE_HEARTBEAT_WHEEL_2),
    0x303: Row("NODE_HEARTBEAT_WHEEL_3", 0x303, "WHEEL_3", 500000000, False, 0x4d, ('state', 'uptime_s', 'tx_errors', 'rx_errors', 'firmware', 'dbc_version'), encode_NODE_HEARTBEAT_WHEEL_3, decode_NODE_HEARTBEAT_WHEEL_3),
    0x304: Row("NODE_HEARTBEAT_WHEEL_4", 0x304, "WHEEL_4", 500000000, False, 0x1e, ('state', 'uptime_s', 'tx_errors', 'rx_errors', 'firmware', 'dbc_version'), encode_NODE_HEARTBEAT_WHEEL_4, decode_NODE_HEARTBEAT_WHEEL_4),
    0x305: Row("NODE_HEARTBEAT_TILT", 0x305, "TILT", 500000000, False, 0x03, ('state', 'uptime_s', 'tx_errors', 'rx_errors', 'firmware', 'dbc_version'), encode_NODE_HEARTBEAT_TILT, decode_NODE_HEARTBEAT_TILT),
    0x306: Row("NODE_HEARTBEAT_IMU", 0x306, "IMU", 500000000, False, 0x24, ('state', 'uptime_s', 'tx_errors', 'rx_errors', 'firmware', 'dbc_version'), encode_NODE_HEARTBEAT_IMU, decode_NODE_HEARTBEAT_IMU),
    0x307: Row("NODE_HEARTBEAT_POWER", 0x307, "POWER", 500000000, False, 0x39, ('state', 'uptime_s', 'tx_errors', 'rx_errors', 'firmware', 'dbc_version'), encode_NODE_HEARTBEAT_POWER, decode_NODE_HEARTBEAT_POWER),
}
