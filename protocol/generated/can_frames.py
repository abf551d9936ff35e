"""The frames of rover.dbc in words, made by tools/make_can_frames.py. Change the DBC and run `make codec`.

FRAMES: can id -> Layout, in the order of priority. The codec of the same frames is protocol/generated/can_codec.py.
"""

from typing import NamedTuple


class Signal(NamedTuple):
    """One signal: little-endian, `start` is its least significant bit. `choices`: names of the values 0, 1, 2, ..."""

    name: str
    start: int
    length: int
    signed: bool
    scale: float
    low: float
    high: float
    unit: str
    comment: str
    choices: tuple[str, ...] = ()


class Layout(NamedTuple):
    """One frame. `cycle_ms`: regular interval, `fast_ms`: while its sender is busy, `delay_ms`: shortest between two
    frames sent on events; 0 where there is none. `family`: shared by frames of one layout.
    """

    name: str
    can_id: int
    family: str
    sender: str
    receivers: tuple[str, ...]
    event: bool
    cycle_ms: int
    fast_ms: int
    delay_ms: int
    comment: str
    signals: tuple[Signal, ...]

BITS_PER_S = 500000

NODES: dict[str, str] = {
    "COMPUTER": "the flight computer",
    "WHEEL_1": "steering and drive of wheel 1",
    "WHEEL_2": "steering and drive of wheel 2",
    "WHEEL_3": "steering and drive of wheel 3",
    "WHEEL_4": "steering and drive of wheel 4",
    "TILT": "axis of the scanner",
    "IMU": "inertial sensor",
    "POWER": "battery and switches",
    "GUARD": "independent watcher of the bus",
}

_COMPUTER_HEARTBEAT = (
    Signal('mode', 0, 8, False, 1, 0, 255, '', 'mode of the computer'),
    Signal('beats', 8, 16, False, 1, 0, 65535, '', 'counts up, wraps'),
    Signal('boot_count', 24, 16, False, 1, 0, 65535, '', 'starts of the program, wraps'),
    Signal('counter', 52, 4, False, 1, 0, 15, '', 'alive counter, one more with each frame'),
    Signal('crc', 56, 8, False, 1, 0, 255, '', 'CRC-8 over id and bytes 0 to 6'),
)

_DRIVE_ENABLE = (
    Signal('enable', 0, 1, False, 1, 0, 1, '', '1: drives may turn'),
    Signal('mode', 1, 8, False, 1, 0, 255, '', 'mode of the computer'),
    Signal('counter', 52, 4, False, 1, 0, 15, '', 'alive counter, one more with each frame'),
    Signal('crc', 56, 8, False, 1, 0, 255, '', 'CRC-8 over id and bytes 0 to 6'),
)

_EMERGENCY_STOP = (
    Signal('reason', 0, 8, False, 1, 0, 255, '', 'why the sender stops the rover', ('NONE', 'OPERATOR', 'FAULT', 'BUTTON', 'WATCHDOG', 'GUARD')),
    Signal('detail', 8, 16, False, 1, 0, 65535, '', 'what the sender adds: a fault bit, a node'),
    Signal('counter', 52, 4, False, 1, 0, 15, '', 'alive counter, one more with each frame'),
    Signal('crc', 56, 8, False, 1, 0, 255, '', 'CRC-8 over id and bytes 0 to 6'),
)

_IMU_ACCEL = (
    Signal('x_mps2', 0, 16, True, 0.001, -32.767, 32.767, 'm/s^2', 'x axis of base_link'),
    Signal('y_mps2', 16, 16, True, 0.001, -32.767, 32.767, 'm/s^2', 'y axis of base_link'),
    Signal('z_mps2', 32, 16, True, 0.001, -32.767, 32.767, 'm/s^2', 'z axis of base_link'),
    Signal('status', 48, 4, False, 1, 0, 15, '', 'bit 0: an axis is saturated'),
    Signal('counter', 52, 4, False, 1, 0, 15, '', 'alive counter, one more with each frame'),
    Signal('crc', 56, 8, False, 1, 0, 255, '', 'CRC-8 over id and bytes 0 to 6'),
)

_IMU_GYRO = (
    Signal('x_radps', 0, 16, True, 0.0001, -3.2767, 3.2767, 'rad/s', 'x axis of base_link'),
    Signal('y_radps', 16, 16, True, 0.0001, -3.2767, 3.2767, 'rad/s', 'y axis of base_link'),
    Signal('z_radps', 32, 16, True, 0.0001, -3.2767, 3.2767, 'rad/s', 'z axis of base_link'),
    Signal('status', 48, 4, False, 1, 0, 15, '', 'bit 0: an axis is saturated'),
    Signal('counter', 52, 4, False, 1, 0, 15, '', 'alive counter, one more with each frame'),
    Signal('crc', 56, 8, False, 1, 0, 255, '', 'CRC-8 over id and bytes 0 to 6'),
)

_NODE_HEARTBEAT = (
    Signal('state', 0, 4, False, 1, 0, 15, '', 'state of the node', ('BOOT', 'RUNNING', 'COMMAND_TIMEOUT', 'EMERGENCY_STOP', 'RESET_ARMED', 'FAULT')),
    Signal('uptime_s', 4, 16, False, 1, 0, 65535, 's', 'since its start, wraps'),
    Signal('tx_errors', 20, 8, False, 1, 0, 255, '', 'transmit error counter'),
    Signal('rx_errors', 28, 8, False, 1, 0, 255, '', 'receive error counter'),
    Signal('firmware', 36, 8, False, 1, 0, 255, '', 'version of the firmware'),
    Signal('dbc_version', 44, 8, False, 1, 0, 255, '', 'version of this file in the node'),
    Signal('counter', 52, 4, False, 1, 0, 15, '', 'alive counter, one more with each frame'),
    Signal('crc', 56, 8, False, 1, 0, 255, '', 'CRC-8 over id and bytes 0 to 6'),
)

_POWER_STATUS = (
    Signal('voltage_v', 0, 12, False, 0.01, 0, 40.95, 'V', 'bus voltage'),
    Signal('current_a', 12, 12, True, 0.02, -40.94, 40.94, 'A', 'from the battery, positive discharging'),
    Signal('charge_ratio', 24, 8, False, 0.004, 0, 1, '1', 'state of charge'),
    Signal('temperature_c', 32, 8, True, 1, -128, 127, 'degC', 'battery'),
    Signal('switches', 40, 8, False, 1, 0, 255, '', 'bit 0 drives, 1 scanner, 2 radio, 3 heater; bit 7 brown-out'),
    Signal('counter', 52, 4, False, 1, 0, 15, '', 'alive counter, one more with each frame'),
    Signal('crc', 56, 8, False, 1, 0, 255, '', 'CRC-8 over id and bytes 0 to 6'),
)

_RESET_REQUEST = (
    Signal('nonce', 0, 16, False, 1, 0, 65535, '', 'the same in both steps'),
    Signal('step', 16, 2, False, 1, 1, 2, '', '1 arms, 2 releases'),
    Signal('counter', 52, 4, False, 1, 0, 15, '', 'alive counter, one more with each frame'),
    Signal('crc', 56, 8, False, 1, 0, 255, '', 'CRC-8 over id and bytes 0 to 6'),
)

_TILT_COMMAND = (
    Signal('start_rad', 0, 13, True, 0.00034906585039886593, -1.4297737232337548, 1.429424657383356, 'rad', 'angle at the start time, positive down'),
    Signal('end_rad', 13, 13, True, 0.00034906585039886593, -1.4297737232337548, 1.429424657383356, 'rad', 'angle at the end'),
    Signal('rate_radps', 26, 8, False, 0.002181661564992912, 0, 0.5563236990731926, 'rad/s', 'magnitude of the constant rate; its sign follows from the angles'),
    Signal('start_ms', 34, 16, False, 1, 0, 65535, 'ms', 'bus time of the start, low 16 bits: the value nearest to now is meant'),
    Signal('mode', 50, 2, False, 1, 0, 2, '', 'what the axis does', ('OFF', 'PARK', 'SWEEP')),
    Signal('counter', 52, 4, False, 1, 0, 15, '', 'alive counter, one more with each frame'),
    Signal('crc', 56, 8, False, 1, 0, 255, '', 'CRC-8 over id and bytes 0 to 6'),
)

_TILT_FEEDBACK = (
    Signal('node_time_us', 0, 24, False, 1, 0, 16777215, 'us', "the node's own clock at the encoder sample, wraps in 16.8 s"),
    Signal('angle_rad', 24, 12, True, 0.0015339807878856412, -3.141592653589793, 3.1400586728019073, 'rad', 'encoder, 4096 counts a turn, positive down'),
    Signal('rate_radps', 36, 12, True, 0.0003, -0.6144, 0.6141, 'rad/s', 'rate of the axis'),
    Signal('state', 48, 4, False, 1, 0, 15, '', 'state of the axis', ('OFF', 'PARKED', 'MOVING', 'SWEEPING', 'GAP', 'EMERGENCY_STOP', 'RESET_ARMED')),
    Signal('counter', 52, 4, False, 1, 0, 15, '', 'alive counter, one more with each frame'),
    Signal('crc', 56, 8, False, 1, 0, 255, '', 'CRC-8 over id and bytes 0 to 6'),
)

_TIME_SYNC = (
    Signal('bus_time_us', 0, 48, False, 1, 0, 281474976710655, 'us', 'bus time when the frame was handed to the driver'),
    Signal('counter', 52, 4, False, 1, 0, 15, '', 'alive counter, one more with each frame'),
    Signal('crc', 56, 8, False, 1, 0, 255, '', 'CRC-8 over id and bytes 0 to 6'),
)

_WHEEL_COMMAND = (
    Signal('mode', 0, 2, False, 1, 0, 2, '', 'what the drives do', ('OFF', 'HOLD', 'RUN')),
    Signal('steer_rad', 2, 16, True, 0.0001, -3.2, 3.2, 'rad', 'steering angle, positive counter-clockwise from above'),
    Signal('rate_radps', 18, 16, True, 0.0005, -16, 16, 'rad/s', 'wheel rate, positive forward'),
    Signal('counter', 52, 4, False, 1, 0, 15, '', 'alive counter, one more with each frame'),
    Signal('crc', 56, 8, False, 1, 0, 255, '', 'CRC-8 over id and bytes 0 to 6'),
)

_WHEEL_FEEDBACK = (
    Signal('steer_rad', 0, 16, True, 0.0001, -3.2767, 3.2767, 'rad', 'steering angle from the pot'),
    Signal('encoder_count', 16, 16, False, 1, 0, 65535, 'count', 'encoder position, wraps; 4096 counts a turn'),
    Signal('rate_radps', 32, 16, True, 0.0005, -16.3835, 16.3835, 'rad/s', 'wheel rate from the encoder'),
    Signal('state', 48, 4, False, 1, 0, 15, '', 'state of the node', ('BOOT', 'RUNNING', 'COMMAND_TIMEOUT', 'EMERGENCY_STOP', 'RESET_ARMED', 'FAULT')),
    Signal('counter', 52, 4, False, 1, 0, 15, '', 'alive counter, one more with each frame'),
    Signal('crc', 56, 8, False, 1, 0, 255, '', 'CRC-8 over id and bytes 0 to 6'),
)

_WHEEL_STATUS = (
    Signal('drive_current_a', 0, 12, True, 0.01, -20.47, 20.47, 'A', 'current of the drive motor, signed as its torque'),
    Signal('steer_current_a', 12, 12, True, 0.01, -20.47, 20.47, 'A', 'current of the steering motor'),
    Signal('temperature_c', 24, 8, True, 1, -128, 127, 'degC', 'hottest winding'),
    Signal('faults', 32, 16, False, 1, 0, 65535, '', 'bit 0 drive, 1 steering, 2 encoder, 3 over-current, 4 over-temperature'),
    Signal('counter', 52, 4, False, 1, 0, 15, '', 'alive counter, one more with each frame'),
    Signal('crc', 56, 8, False, 1, 0, 255, '', 'CRC-8 over id and bytes 0 to 6'),
)

FRAMES: dict[int, Layout] = {
    0x010: Layout(
        "EMERGENCY_STOP_COMPUTER", 0x010, "EMERGENCY_STOP", "COMPUTER",
        ('WHEEL_1', 'WHEEL_2', 'WHEEL_3', 'WHEEL_4', 'TILT', 'IMU', 'POWER', 'GUARD'),
        True, 100, 0, 10,
        'On the event, then at 10 Hz while asserted; latches on every node.',
        _EMERGENCY_STOP,
    ),
    0x011: Layout(
        "EMERGENCY_STOP_WHEEL_1", 0x011, "EMERGENCY_STOP", "WHEEL_1",
        ('COMPUTER', 'WHEEL_2', 'WHEEL_3', 'WHEEL_4', 'TILT', 'IMU', 'POWER', 'GUARD'),
        True, 100, 0, 10,
        'On the event, then at 10 Hz while asserted; latches on every node.',
        _EMERGENCY_STOP,
    ),
    0x012: Layout(
        "EMERGENCY_STOP_WHEEL_2", 0x012, "EMERGENCY_STOP", "WHEEL_2",
        ('COMPUTER', 'WHEEL_1', 'WHEEL_3', 'WHEEL_4', 'TILT', 'IMU', 'POWER', 'GUARD'),
        True, 100, 0, 10,
        'On the event, then at 10 Hz while asserted; latches on every node.',
        _EMERGENCY_STOP,
    ),
    0x013: Layout(
        "EMERGENCY_STOP_WHEEL_3", 0x013, "EMERGENCY_STOP", "WHEEL_3",
        ('COMPUTER', 'WHEEL_1', 'WHEEL_2', 'WHEEL_4', 'TILT', 'IMU', 'POWER', 'GUARD'),
        True, 100, 0, 10,
        'On the event, then at 10 Hz while asserted; latches on every node.',
        _EMERGENCY_STOP,
    ),
    0x014: Layout(
        "EMERGENCY_STOP_WHEEL_4", 0x014, "EMERGENCY_STOP", "WHEEL_4",
        ('COMPUTER', 'WHEEL_1', 'WHEEL_2', 'WHEEL_3', 'TILT', 'IMU', 'POWER', 'GUARD'),
        True, 100, 0, 10,
        'On the event, then at 10 Hz while asserted; latches on every node.',
        _EMERGENCY_STOP,
    ),
    0x015: Layout(
        "EMERGENCY_STOP_TILT", 0x015, "EMERGENCY_STOP", "TILT",
        ('COMPUTER', 'WHEEL_1', 'WHEEL_2', 'WHEEL_3', 'WHEEL_4', 'IMU', 'POWER', 'GUARD'),
        True, 100, 0, 10,
        'On the event, then at 10 Hz while asserted; latches on every node.',
        _EMERGENCY_STOP,
    ),
    0x016: Layout(
        "EMERGENCY_STOP_IMU", 0x016, "EMERGENCY_STOP", "IMU",
        ('COMPUTER', 'WHEEL_1', 'WHEEL_2', 'WHEEL_3', 'WHEEL_4', 'TILT', 'POWER', 'GUARD'),
        True, 100, 0, 10,
        'On the event, then at 10 Hz while asserted; latches on every node.',
        _EMERGENCY_STOP,
    ),
    0x017: Layout(
        "EMERGENCY_STOP_POWER", 0x017, "EMERGENCY_STOP", "POWER",
        ('COMPUTER', 'WHEEL_1', 'WHEEL_2', 'WHEEL_3', 'WHEEL_4', 'TILT', 'IMU', 'GUARD'),
        True, 100, 0, 10,
        'On the event, then at 10 Hz while asserted; latches on every node.',
        _EMERGENCY_STOP,
    ),
    0x01f: Layout(
        "EMERGENCY_STOP_GUARD", 0x01f, "EMERGENCY_STOP", "GUARD",
        ('COMPUTER', 'WHEEL_1', 'WHEEL_2', 'WHEEL_3', 'WHEEL_4', 'TILT', 'IMU', 'POWER'),
        True, 100, 0, 10,
        'On the event, then at 10 Hz while asserted; latches on every node.',
        _EMERGENCY_STOP,
    ),
    0x020: Layout(
        "RESET_REQUEST", 0x020, "RESET_REQUEST", "COMPUTER",
        ('WHEEL_1', 'WHEEL_2', 'WHEEL_3', 'WHEEL_4', 'TILT', 'IMU', 'POWER', 'GUARD'),
        True, 0, 0, 100,
        'Two steps release an emergency stop; each node answers with a NODE_HEARTBEAT out of turn.',
        _RESET_REQUEST,
    ),
    0x080: Layout(
        "TIME_SYNC", 0x080, "TIME_SYNC", "COMPUTER",
        ('TILT',),
        False, 100, 0, 0,
        'Bus time, for start times only: nodes stamp with their own clocks.',
        _TIME_SYNC,
    ),
    0x100: Layout(
        "DRIVE_ENABLE", 0x100, "DRIVE_ENABLE", "COMPUTER",
        ('WHEEL_1', 'WHEEL_2', 'WHEEL_3', 'WHEEL_4'),
        False, 100, 0, 0,
        'Without enable, or 500 ms without this frame, the drives ramp to zero.',
        _DRIVE_ENABLE,
    ),
    0x101: Layout(
        "WHEEL_1_COMMAND", 0x101, "WHEEL_COMMAND", "COMPUTER",
        ('WHEEL_1',),
        False, 20, 0, 0,
        'One order; 100 ms without a valid one: the drive ramps to zero, steering is held, the state says so.',
        _WHEEL_COMMAND,
    ),
    0x102: Layout(
        "WHEEL_2_COMMAND", 0x102, "WHEEL_COMMAND", "COMPUTER",
        ('WHEEL_2',),
        False, 20, 0, 0,
        'One order; 100 ms without a valid one: the drive ramps to zero, steering is held, the state says so.',
        _WHEEL_COMMAND,
    ),
    0x103: Layout(
        "WHEEL_3_COMMAND", 0x103, "WHEEL_COMMAND", "COMPUTER",
        ('WHEEL_3',),
        False, 20, 0, 0,
        'One order; 100 ms without a valid one: the drive ramps to zero, steering is held, the state says so.',
        _WHEEL_COMMAND,
    ),
    0x104: Layout(
        "WHEEL_4_COMMAND", 0x104, "WHEEL_COMMAND", "COMPUTER",
        ('WHEEL_4',),
        False, 20, 0, 0,
        'One order; 100 ms without a valid one: the drive ramps to zero, steering is held, the state says so.',
        _WHEEL_COMMAND,
    ),
    0x120: Layout(
        "TILT_COMMAND", 0x120, "TILT_COMMAND", "COMPUTER",
        ('TILT',),
        False, 100, 0, 10,
        'One segment of constant rate, sent at least 0.2 s ahead, repeated at 10 Hz; frames with one start time are one command.',
        _TILT_COMMAND,
    ),
    0x181: Layout(
        "WHEEL_1_FEEDBACK", 0x181, "WHEEL_FEEDBACK", "WHEEL_1",
        ('COMPUTER',),
        False, 10, 0, 0,
        'What the wheel does, at the same instant for all fields.',
        _WHEEL_FEEDBACK,
    ),
    0x182: Layout(
        "WHEEL_2_FEEDBACK", 0x182, "WHEEL_FEEDBACK", "WHEEL_2",
        ('COMPUTER',),
        False, 10, 0, 0,
        'What the wheel does, at the same instant for all fields.',
        _WHEEL_FEEDBACK,
    ),
    0x183: Layout(
        "WHEEL_3_FEEDBACK", 0x183, "WHEEL_FEEDBACK", "WHEEL_3",
        ('COMPUTER',),
        False, 10, 0, 0,
        'What the wheel does, at the same instant for all fields.',
        _WHEEL_FEEDBACK,
    ),
    0x184: Layout(
        "WHEEL_4_FEEDBACK", 0x184, "WHEEL_FEEDBACK", "WHEEL_4",
        ('COMPUTER',),
        False, 10, 0, 0,
        'What the wheel does, at the same instant for all fields.',
        _WHEEL_FEEDBACK,
    ),
    0x1a1: Layout(
        "WHEEL_1_STATUS", 0x1a1, "WHEEL_STATUS", "WHEEL_1",
        ('COMPUTER',),
        False, 50, 0, 0,
        'Housekeeping of one wheel.',
        _WHEEL_STATUS,
    ),
    0x1a2: Layout(
        "WHEEL_2_STATUS", 0x1a2, "WHEEL_STATUS", "WHEEL_2",
        ('COMPUTER',),
        False, 50, 0, 0,
        'Housekeeping of one wheel.',
        _WHEEL_STATUS,
    ),
    0x1a3: Layout(
        "WHEEL_3_STATUS", 0x1a3, "WHEEL_STATUS", "WHEEL_3",
        ('COMPUTER',),
        False, 50, 0, 0,
        'Housekeeping of one wheel.',
        _WHEEL_STATUS,
    ),
    0x1a4: Layout(
        "WHEEL_4_STATUS", 0x1a4, "WHEEL_STATUS", "WHEEL_4",
        ('COMPUTER',),
        False, 50, 0, 0,
        'Housekeeping of one wheel.',
        _WHEEL_STATUS,
    ),
    0x1c0: Layout(
        "TILT_FEEDBACK", 0x1c0, "TILT_FEEDBACK", "TILT",
        ('COMPUTER',),
        False, 100, 5, 0,
        '200 Hz while the axis sweeps, 10 Hz parked.',
        _TILT_FEEDBACK,
    ),
    0x1d0: Layout(
        "IMU_GYRO", 0x1d0, "IMU_GYRO", "IMU",
        ('COMPUTER',),
        False, 10, 0, 0,
        'Angular rate.',
        _IMU_GYRO,
    ),
    0x1d1: Layout(
        "IMU_ACCEL", 0x1d1, "IMU_ACCEL", "IMU",
        ('COMPUTER',),
        False, 10, 0, 0,
        'Specific force, sampled with the gyro frame before it.',
        _IMU_ACCEL,
    ),
    0x200: Layout(
        "POWER_STATUS", 0x200, "POWER_STATUS", "POWER",
        ('COMPUTER',),
        False, 200, 0, 0,
        'The power system.',
        _POWER_STATUS,
    ),
    0x300: Layout(
        "COMPUTER_HEARTBEAT", 0x300, "COMPUTER_HEARTBEAT", "COMPUTER",
        ('WHEEL_1', 'WHEEL_2', 'WHEEL_3', 'WHEEL_4', 'TILT', 'IMU', 'POWER', 'GUARD'),
        False, 100, 0, 0,
        'The computer lives.',
        _COMPUTER_HEARTBEAT,
    ),
    0x301: Layout(
        "NODE_HEARTBEAT_WHEEL_1", 0x301, "NODE_HEARTBEAT", "WHEEL_1",
        ('COMPUTER',),
        False, 500, 0, 50,
        'At 2 Hz, and out of turn as the answer to RESET_REQUEST.',
        _NODE_HEARTBEAT,
    ),
    0x302: Layout(
        "NODE_HEARTBEAT_WHEEL_2", 0x302, "NODE_HEARTBEAT", "WHEEL_2",
        ('COMPUTER',),
        False, 500, 0, 50,
        'At 2 Hz, and out of turn as the answer to RESET_REQUEST.',
        _NODE_HEARTBEAT,
    ),
    0x303: Layout(
        "NODE_HEARTBEAT_WHEEL_3", 0x303, "NODE_HEARTBEAT", "WHEEL_3",
        ('COMPUTER',),
        False, 500, 0, 50,
        'At 2 Hz, and out of turn as the answer to RESET_REQUEST.',
        _NODE_HEARTBEAT,
    ),
    0x304: Layout(
        "NODE_HEARTBEAT_WHEEL_4", 0x304, "NODE_HEARTBEAT", "WHEEL_4",
        ('COMPUTER',),
        False, 500, 0, 50,
        'At 2 Hz, and out of turn as the answer to RESET_REQUEST.',
        _NODE_HEARTBEAT,
    ),
    0x305: Layout(
        "NODE_HEARTBEAT_TILT", 0x305, "NODE_HEARTBEAT", "TILT",
        ('COMPUTER',),
        False, 500, 0, 50,
        'At 2 Hz, and out of turn as the answer to RESET_REQUEST.',
        _NODE_HEARTBEAT,
    ),
    0x306: Layout(
        "NODE_HEARTBEAT_IMU", 0x306, "NODE_HEARTBEAT", "IMU",
        ('COMPUTER',),
        False, 500, 0, 50,
        'At 2 Hz, and out of turn as the answer to RESET_REQUEST.',
        _NODE_HEARTBEAT,
    ),
    0x307: Layout(
        "NODE_HEARTBEAT_POWER", 0x307, "NODE_HEARTBEAT", "POWER",
        ('COMPUTER',),
        False, 500, 0, 50,
        'At 2 Hz, and out of turn as the answer to RESET_REQUEST.',
        _NODE_HEARTBEAT,
    ),
}
