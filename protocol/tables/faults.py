"""TABLE of faults: condition, detection time limit and response of each.

This is the only list: monitors yield these names, the executive runs the responses, docs page and tests are generated
from it. Detection time counts from the first missing or violating sample to the tick whose outputs contain the
response.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class ResponseStep(Enum):
    """One step of a response."""

    STOP = "zero wheel rates while the fault lasts"
    DISCARD_SWEEP = "no sweep runs while it lasts; one that ran is scanned again, at most 3 times, then mode SAFE"
    ESTIMATE_ANEW = "what was known of the clock or the bias is learned again; no order is timed by it"
    BACK_OFF = "the way is ended: back 0.3 m as it was driven, scan, plan again; SAFE after so many tries in a mission"
    LOOK = "the way is ended: scan where the rover stands, register, plan again; SAFE if the fault outlasts that"
    RESCAN = "the way is ended where the rover stands: scan, plan again"
    SLOW = "half the speed while the fault lasts"
    DEGRADE = "on without what is broken, if safety.degraded_drive and no second wheel is; else mode SAFE, latched"
    SAFE = "mode SAFE, latched until resume"
    STANDBY = "finish the leg, then mode STANDBY"
    ESTOP = "mode ESTOP, latched until reset"
    REPORT = "an event to the ground"
    RESTART_BUS = "the bus is opened again at once, then after 0.1, 0.2, 0.4, 0.8 and 1.6 s"
    IGNORE = "what is wrong is dropped before anything uses it"
    SHED = "what can wait is left: telemetry ten times slower, no products, while the fault lasts"
    OBEY = "what was ordered, in the tick that hears it"
    COMMIT = "the strategy no longer chooses: only the optimistic way's next look (R5), to mission.stop_limit"
    GIVE_UP = "the mission ends as failed, with the nearest reachable pose and the number of cells in the way"
    KEEP_LESS = "the record waits in memory, and drops by priority: maps of plans, outputs, at last all; tried again"
    SAFE_OVER_LIMIT = "mode SAFE, latched until resume, when the tries are used up or a second, higher limit is passed"


@dataclass(frozen=True, slots=True)
class Fault:
    """One row of the fault table.

    number: number on the wire, never reused for another fault.
    name: name of the fault.
    condition: what is detected, text for people.
    detect_s: detection time limit, s.
    response: steps of the response.
    latched: True if the fault or its response ends only by an operator's command.
    suppressed_by: faults that explain this one; it is not reported while one of them is active.
    tries: limit of BACK_OFF in a mission.
    maskable: True if an operator may suspend its response for a while; False for faults that protect the rover.
    """

    number: int
    name: str
    condition: str
    detect_s: float
    response: tuple[ResponseStep, ...]
    latched: bool
    suppressed_by: tuple[str, ...] = ()
    tries: int = 0
    maskable: bool = False


FAULTS = (
    Fault(
        1,
        "LIDAR_SILENT",
        "no valid frame for 4 periods of the commanded stream and 50 ms (0.45 s for the guard's)",
        0.15,
        (ResponseStep.STOP, ResponseStep.DISCARD_SWEEP, ResponseStep.REPORT),
        latched=False,
        maskable=True,
    ),
    Fault(
        2,
        "WHEEL_STALE",
        "feedback of a wheel older than 30 ms",
        0.04,
        (ResponseStep.STOP,),
        latched=False,
        suppressed_by=("CAN_BUS_OFF",),
    ),
    Fault(
        3,
        "WHEEL_SILENT",
        "feedback of a wheel older than 200 ms",
        0.21,
        (ResponseStep.STOP, ResponseStep.SAFE, ResponseStep.REPORT),
        latched=True,
        suppressed_by=("CAN_BUS_OFF",),
    ),
    Fault(
        4,
        "CAN_BUS_OFF",
        "the bus is closed, bus-off or down, or no frame of any node",
        0.05,
        (ResponseStep.STOP, ResponseStep.RESTART_BUS, ResponseStep.SAFE_OVER_LIMIT, ResponseStep.REPORT),
        latched=False,
    ),
    Fault(
        5,
        "NODE_LOST",
        "no heartbeat of the tilt, IMU or power node for 1.5 s",
        1.6,
        (ResponseStep.STOP, ResponseStep.SAFE, ResponseStep.REPORT),
        latched=True,
        suppressed_by=("CAN_BUS_OFF",),
        maskable=True,
    ),
    Fault(
        6,
        "IMU_DEAD",
        "IMU samples older than 30 ms",
        0.04,
        (ResponseStep.STOP,),
        latched=False,
        suppressed_by=("CAN_BUS_OFF",),
    ),
    Fault(
        7,
        "TILT_ANGLE",
        "roll or pitch over the limit",
        0.05,
        (ResponseStep.STOP, ResponseStep.SAFE, ResponseStep.REPORT),
        latched=True,
    ),
    Fault(
        8,
        "COMMAND_LOST",
        "no authenticated contact for the configured time",
        1.0,
        (ResponseStep.STANDBY, ResponseStep.REPORT),
        latched=False,
        maskable=True,
    ),
    Fault(
        9, "JOB_LATE", "long work was not done at its tick", 1.0, (ResponseStep.REPORT,), latched=False, maskable=True
    ),
    Fault(
        10,
        "ESTOP_PRESSED",
        "an emergency stop frame of any node",
        0.02,
        (ResponseStep.STOP, ResponseStep.ESTOP, ResponseStep.REPORT),
        latched=True,
    ),
    Fault(
        11,
        "CAN_BABBLE",
        "frames of one id far above its rate, or a bus over 80 % full",
        0.2,
        (ResponseStep.IGNORE, ResponseStep.SAFE_OVER_LIMIT, ResponseStep.REPORT),
        latched=False,
        suppressed_by=("CAN_BUS_OFF",),
        maskable=True,
    ),
    Fault(
        12,
        "CAN_CORRUPT",
        "over 20 errors a second of checksum, counter, length, range or time stamp",
        0.2,
        (ResponseStep.IGNORE, ResponseStep.SAFE_OVER_LIMIT, ResponseStep.REPORT),
        latched=False,
        suppressed_by=("CAN_BUS_OFF", "CAN_BABBLE"),
        maskable=True,
    ),
    Fault(
        13,
        "ENCODER_BAD",
        "a wheel's encoder is dead, frozen or jumps, against current, order and its own rate",
        1.0,
        (ResponseStep.DEGRADE, ResponseStep.REPORT),
        latched=True,
        maskable=True,
    ),
    Fault(
        14,
        "WHEEL_STUCK",
        "a wheel does not turn and draws its stall current, or none and is dragged",
        1.0,
        (ResponseStep.RESCAN, ResponseStep.DEGRADE, ResponseStep.REPORT),
        latched=True,
        maskable=True,
    ),
    Fault(
        15,
        "WHEEL_FREE",
        "a wheel rolls along and draws nothing while the others work",
        1.0,
        (ResponseStep.RESCAN, ResponseStep.DEGRADE, ResponseStep.REPORT),
        latched=True,
        maskable=True,
    ),
    Fault(
        16,
        "WHEEL_WEAK",
        "a wheel turns slower than ordered and draws too little to change it",
        1.0,
        (ResponseStep.RESCAN, ResponseStep.DEGRADE, ResponseStep.REPORT),
        latched=True,
        maskable=True,
    ),
    Fault(
        17,
        "STEER_STUCK",
        "a steering angle more than 3 degrees off its rate-limited model",
        0.5,
        (ResponseStep.RESCAN, ResponseStep.DEGRADE, ResponseStep.REPORT),
        latched=True,
        maskable=True,
    ),
    Fault(
        18,
        "STEER_OFFSET",
        "a steering reading stands off its order; the gyro says, over 5 m driven, which is wrong",
        46.0,
        (ResponseStep.REPORT,),
        latched=True,
        maskable=True,
    ),
    Fault(
        19,
        "SLIP_HIGH",
        "the wheels' way against gyro, accelerometer and registrations, over 1 m driven",
        9.1,
        (ResponseStep.SLOW, ResponseStep.REPORT),
        latched=False,
        maskable=True,
    ),
    Fault(
        20,
        "NOT_MOVING",
        "the wheels turn and accelerometer and gyro say the rover stands",
        5.0,
        (ResponseStep.BACK_OFF, ResponseStep.REPORT),
        latched=False,
        tries=3,
        maskable=True,
    ),
    Fault(
        21,
        "HAZARD_AHEAD",
        "a step, hole or thing on the wheels' way that the drive guard has seen twice",
        0.2,
        (ResponseStep.STOP, ResponseStep.BACK_OFF, ResponseStep.REPORT),
        latched=False,
        tries=20,
    ),
    Fault(
        22,
        "POSE_UNSURE",
        "1 sigma of the pose over the limit in a mission",
        0.12,
        (ResponseStep.LOOK, ResponseStep.REPORT),
        latched=False,
        maskable=True,
    ),
    Fault(
        39,
        "KEEP_OUT",
        "the rover's outline touches a keep-out fence",
        0.02,
        (ResponseStep.BACK_OFF, ResponseStep.REPORT),
        latched=False,
        tries=3,
    ),
    Fault(
        40,
        "DISK_FULL",
        "the record is not written: no room on the disk, or less than has to stay free",
        1.0,
        (ResponseStep.KEEP_LESS, ResponseStep.REPORT),
        latched=False,
        maskable=True,
    ),
    Fault(
        41,
        "RECORD_FAIL",
        "the record is not written: the disk is read-only, gone or broken",
        1.0,
        (ResponseStep.KEEP_LESS, ResponseStep.REPORT),
        latched=False,
        maskable=True,
    ),
    Fault(
        42,
        "LIDAR_GARBLED",
        "over 20 % of the scanner's frames of the last 2 s, and 4 at least, failed their "
        "checks; or it sends more than any scanner does",
        2.0,
        (ResponseStep.IGNORE, ResponseStep.DISCARD_SWEEP, ResponseStep.REPORT),
        latched=False,
        maskable=True,
    ),
    Fault(
        43,
        "LIDAR_DIRTY",
        "of 40 scans' beams to the ground 40 % are torn by missing ones, or 10 % have no word; or "
        "a mission ends since it sees too little",
        1.1,
        (ResponseStep.DISCARD_SWEEP, ResponseStep.REPORT),
        latched=False,
        maskable=True,
    ),
    Fault(
        44,
        "LIDAR_CLOCK",
        "the scanner's counter jumps or starts again; reported for a second",
        0.1,
        (ResponseStep.ESTIMATE_ANEW, ResponseStep.DISCARD_SWEEP, ResponseStep.REPORT),
        latched=False,
        maskable=True,
    ),
    Fault(
        45,
        "CLOCK_JUMP",
        "UTC or the clock of the tilt node jumps; told for a second",
        1.0,
        (ResponseStep.ESTIMATE_ANEW, ResponseStep.DISCARD_SWEEP, ResponseStep.REPORT),
        latched=False,
        maskable=True,
    ),
    Fault(
        46,
        "TILT_STALL",
        "the tilt axis makes less than 30 % of the way of its orders",
        0.3,
        (ResponseStep.DISCARD_SWEEP, ResponseStep.REPORT),
        latched=False,
        suppressed_by=("CAN_BUS_OFF",),
        maskable=True,
    ),
    Fault(
        47,
        "IMU_BIAS",
        "at rest the gyro reads over 0.1 degrees a second otherwise than at the last rest",
        3.0,
        (ResponseStep.ESTIMATE_ANEW, ResponseStep.REPORT),
        latched=False,
        maskable=True,
    ),
    Fault(
        24,
        "NODE_FOREIGN",
        "a node's heartbeat carries another DBC version",
        0.02,
        (ResponseStep.STOP, ResponseStep.SAFE, ResponseStep.REPORT),
        latched=True,
    ),
    Fault(
        25,
        "NODE_TWICE",
        "two nodes send under one id: two alive counters interleave",
        1.0,
        (ResponseStep.STOP, ResponseStep.SAFE, ResponseStep.REPORT),
        latched=True,
        suppressed_by=("CAN_BABBLE",),
    ),
    Fault(
        26,
        "POWER_LOW",
        "two words of the power node with charge or voltage under their limits",
        0.5,
        (ResponseStep.STOP, ResponseStep.SHED, ResponseStep.SAFE, ResponseStep.REPORT),
        latched=True,
        suppressed_by=("BROWN_OUT",),
        maskable=True,
    ),
    Fault(
        27,
        "BROWN_OUT",
        "two words of the power node with a voltage that the devices do not stand",
        0.5,
        (ResponseStep.STOP, ResponseStep.SHED, ResponseStep.SAFE_OVER_LIMIT, ResponseStep.REPORT),
        latched=False,
        tries=3,
    ),
    Fault(
        28,
        "TICK_LATE",
        "5 ticks or more left out within a second",
        1.0,
        (ResponseStep.SHED, ResponseStep.SAFE_OVER_LIMIT, ResponseStep.REPORT),
        latched=False,
        suppressed_by=("CONTROL_LATE",),
        maskable=True,
    ),
    Fault(
        29,
        "CONTROL_LATE",
        "a tick's orders come over 50 ms after their time; found in that tick",
        0.1,
        (ResponseStep.STOP, ResponseStep.SAFE_OVER_LIMIT, ResponseStep.REPORT),
        latched=False,
        tries=3,
    ),
    Fault(
        30,
        "NO_PATH",
        "no way to the goal over free or unknown ground (R9)",
        0.02,
        (ResponseStep.GIVE_UP, ResponseStep.REPORT),
        latched=False,
        suppressed_by=("LIDAR_DIRTY",),
    ),
    Fault(
        31,
        "LOOP",
        "a strategy's stops have not lowered the way left by 0.5 m within 2 stops (R10)",
        0.02,
        (ResponseStep.COMMIT, ResponseStep.REPORT),
        latched=False,
    ),
    Fault(
        32,
        "OPERATOR",
        "the operator says stop, safe or emergency_stop",
        0.01,
        (ResponseStep.OBEY, ResponseStep.REPORT),
        latched=False,
    ),
    Fault(
        33,
        "COMPUTER_STRAINED",
        "processor, memory or temperature of the computer past a limit at three looks",
        2.1,
        (ResponseStep.REPORT,),
        latched=False,
        maskable=True,
    ),
)

BY_NAME = {fault.name: fault for fault in FAULTS}


def named(bits: int) -> tuple[str, ...]:
    """Names of the faults in a telemetry word, bit = number; bits without a row are ignored."""
    return tuple(fault.name for fault in FAULTS if bits >> fault.number & 1)
