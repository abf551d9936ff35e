"""TABLE of telemetry items: name, unit, rate, priority, limits, and the MAVLink field that carries each.

An item without a MAVLink field of its own is sent in ITEMS, by its number. To add an item: add a row here and a sampler
in onboard/core/telemetry.py. Numbers are on the wire and never reused.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any, NamedTuple

from protocol.mavlink_frames import enu_angles, frd_from_flu, ned_from_enu


class Priority(IntEnum):
    """Downlink priority; the lowest number is sent first."""

    REPORT = 1
    HOUSEKEEPING = 2
    EVENT = 3
    BULK = 4


class Item(NamedTuple):
    """One telemetry item.

    id: number on the wire.
    name: name, with the unit.
    unit: SI unit.
    rate_hz: transmission rate.
    meaning: text for people.
    message, field: MAVLink message and field that carry it; "": ITEMS.
    scale: field value = item value * scale.
    limits: (low, high); the ground marks a value outside; None: no limit.
    priority: downlink priority.
    """

    id: int
    name: str
    unit: str
    rate_hz: float
    meaning: str
    message: str = ""
    field: str = ""
    scale: float = 1.0
    limits: tuple[float, float] | None = None
    priority: Priority = Priority.HOUSEKEEPING


_R, _P, _A, _W, _S, _J = "ROVER_STATE", "LOCAL_POSITION_NED", "ATTITUDE", "WHEELS", "SYS_STATUS", "PROGRESS"
_L = "LINK_STATE"
_NO_LIMIT = math.inf
TABLE = (
    Item(1, "mode", "", 2, "protocol.tables.modes.Mode", _R, "mode"),
    Item(2, "phase", "", 2, "protocol.tables.modes.Phase", _R, "phase"),
    Item(3, "stop", "", 2, "number of the present stop", _R, "stop"),
    Item(4, "faults", "", 2, "one bit for each active row of the fault table, bit = id", _R, "faults", limits=(0, 0)),
    Item(5, "goal_x_m", "m", 2, "goal, east", _R, "goal_east"),
    Item(6, "goal_y_m", "m", 2, "goal, north", _R, "goal_north"),
    Item(7, "goal_distance_m", "m", 2, "straight distance to the goal", _R, "distance"),
    Item(8, "speed_mps", "m/s", 2, "speed along the body's x axis", _R, "speed", limits=(-0.2, 0.2)),
    Item(9, "sigma_position_m", "m", 2, "1 sigma of the position", _R, "sigma_position", limits=(0, 0.5)),
    Item(10, "sigma_yaw_rad", "rad", 2, "1 sigma of the heading", _R, "sigma_yaw", limits=(0, 0.1)),
    Item(11, "x_m", "m", 2, "base_link, east", _P, "x"),
    Item(12, "y_m", "m", 2, "base_link, north", _P, "y"),
    Item(13, "z_m", "m", 2, "base_link, up", _P, "z"),
    Item(14, "roll_rad", "rad", 2, "roll", _A, "roll", limits=(-0.44, 0.44)),
    Item(15, "pitch_rad", "rad", 2, "pitch, positive nose down", _A, "pitch", limits=(-0.44, 0.44)),
    Item(16, "yaw_rad", "rad", 2, "yaw, from east to north", _A, "yaw"),
    Item(17, "yaw_rate_radps", "rad/s", 2, "yaw rate, counter-clockwise", _A, "yawspeed"),
    *(
        Item(
            20 + n,
            f"steer_{n}_rad",
            "rad",
            2,
            f"steering angle of wheel {n}",
            _W,
            f"steer[{n - 1}]",
            limits=(-1.84, 1.84),
        )
        for n in (1, 2, 3, 4)
    ),
    *(
        Item(24 + n, f"rate_{n}_radps", "rad/s", 2, f"rate of wheel {n}", _W, f"rate[{n - 1}]", limits=(-4.2, 4.2))
        for n in (1, 2, 3, 4)
    ),
    *(Item(28 + n, f"wheel_state_{n}", "", 2, f"state byte of wheel {n}", _W, f"state[{n - 1}]") for n in (1, 2, 3, 4)),
    Item(40, "voltage_v", "V", 1, "battery voltage", _S, "voltage_battery", 1e3, limits=(22, 30)),
    Item(41, "current_a", "A", 1, "battery current", _S, "current_battery", 1e2, limits=(-20, 20)),
    Item(42, "charge_ratio", "1", 1, "charge left", _S, "battery_remaining", 1e2, limits=(0.2, 1)),
    Item(43, "battery_temperature_c", "°C", 1, "battery temperature", limits=(-20, 50)),
    Item(50, "lidar_good", "", 1, "good LIDAR frames since the start"),
    Item(51, "lidar_bad", "", 1, "bad LIDAR frames since the start"),
    Item(52, "tick_worst_ms", "ms", 1, "longest tick of the last second", limits=(0, 10)),
    Item(62, "tick_late_ms", "ms", 1, "latest wake-up of a tick in the last second", limits=(0, 5)),
    Item(63, "ticks_slipped", "", 1, "ticks left out since the start", limits=(0, 0)),
    Item(64, "groups_over", "", 1, "runs of rate groups over their budget since the start"),
    Item(65, "jobs_late", "", 1, "results of long work that came after their tick", limits=(0, 0)),
    Item(66, "cpu_ratio", "1", 1, "share of the computer's cores at work", limits=(0, 0.98)),
    Item(67, "process_ratio", "1", 1, "cores that the flight program takes"),
    Item(68, "rss_mb", "MB", 1, "resident memory of the flight program", limits=(0, 1000)),
    Item(69, "free_memory_mb", "MB", 1, "memory of the computer that is free", limits=(64, _NO_LIMIT)),
    Item(70, "computer_temperature_c", "°C", 1, "hottest sensor of the computer", limits=(-20, 90)),
    Item(71, "free_disk_mb", "MB", 1, "free on the fullest disk that is written to", limits=(64, _NO_LIMIT)),
    Item(53, "link_received", "", 1, "authenticated uplink datagrams since the start"),
    Item(54, "link_refused", "", 1, "refused uplink datagrams since the start", limits=(0, _NO_LIMIT)),
    Item(55, "events_waiting", "", 1, "events not yet acknowledged by the ground"),
    Item(56, "lidar_clock_offset_s", "s", 1, "onboard time minus the LIDAR's counter"),
    Item(57, "lidar_clock_ppm", "ppm", 1, "how much slower than ours the LIDAR's clock runs", limits=(-200, 200)),
    Item(58, "lidar_clock_sigma_ms", "ms", 1, "1 sigma of a scan's time, without the constant delay", limits=(0, 0.5)),
    Item(59, "lidar_clock_samples", "", 1, "frames on which the LIDAR's clock rests"),
    Item(61, "lidar_clock_breaks", "", 1, "jumps and reboots of the LIDAR's counter since the start", limits=(0, 0)),
    Item(80, "dictionary_version", "", 2, "protocol.versions: of commands, telemetry, modes, faults", _L, "dictionary"),
    Item(81, "dbc_version", "", 2, "protocol.versions: of the CAN database", _L, "dbc"),
    Item(82, "dialect_version", "", 2, "protocol.versions: of the MAVLink messages", _L, "dialect"),
    Item(83, "lease_station", "", 2, "station that holds the control lease, 0: nobody", _L, "lease"),
    Item(84, "key_epoch", "", 2, "key epoch in force", _L, "epoch"),
    Item(85, "sigma_major_m", "m", 1, "1 sigma of the place along the long axis of its ellipse", limits=(0, 0.5)),
    Item(86, "sigma_minor_m", "m", 1, "1 sigma of the place across the long axis of its ellipse"),
    Item(87, "sigma_axis_rad", "rad", 1, "direction of the long axis of the ellipse, from east to north"),
    Item(88, "slip_ratio", "1", 1, "share of the wheels' travel that the body lacks, 0 while it is not judged"),
    *(Item(88 + n, f"steer_ordered_{n}_rad", "rad", 1, f"steering angle ordered of wheel {n}") for n in (1, 2, 3, 4)),
    *(Item(92 + n, f"rate_ordered_{n}_radps", "rad/s", 1, f"rate ordered of wheel {n}") for n in (1, 2, 3, 4)),
    Item(60, "job_ratio", "1", 2, "how far the long work is", _J, "ratio"),
)
BY_NAME = {row.name: row for row in TABLE}
BY_ID = {row.id: row for row in TABLE}
ITEMS_SLOTS = 8


def rate_hz(message: str) -> float:
    """Rate of a message: the highest rate of the items in it."""
    return max(row.rate_hz for row in TABLE if row.message == message)


MESSAGES = tuple(dict.fromkeys(row.message for row in TABLE))  # "" is ITEMS


def _frames() -> tuple[tuple[str, tuple[Item, ...]], ...]:
    found: list[tuple[str, tuple[Item, ...]]] = []
    for message in MESSAGES:
        rows = tuple(row for row in TABLE if row.message == message)
        size = len(rows) if message else ITEMS_SLOTS
        found += [(message, rows[at : at + size]) for at in range(0, len(rows), size)]
    return tuple(found)


FRAMES = _frames()  # message and the items that one frame of it carries: they arrive together


def out_of_limits(name: str, value: float) -> bool:
    """True if the value is outside the limits of its item."""
    limits = BY_NAME[name].limits
    return limits is not None and not limits[0] <= value <= limits[1]


def values(message: Any) -> dict[str, float]:
    """Return the items of a decoded MAVLink message by name, in our frames and units."""
    kind = message.get_type()
    if kind == "ITEMS":
        return {BY_ID[i].name: value for i, value in zip(message.item, message.value) if i in BY_ID}
    read = {row.name: _field(message, row) for row in TABLE if row.message and row.message == kind}
    if kind == "LOCAL_POSITION_NED":
        read["x_m"], read["y_m"], read["z_m"] = ned_from_enu(message.x, message.y, message.z)
    elif kind == "ATTITUDE":
        read["roll_rad"], read["pitch_rad"], read["yaw_rad"] = enu_angles(message.roll, message.pitch, message.yaw)
        read["yaw_rate_radps"] = frd_from_flu(message.rollspeed, message.pitchspeed, message.yawspeed)[2]
    return read


def _field(message: Any, row: Item) -> float:
    base, bracket, index = row.field.partition("[")
    found = getattr(message, base)
    value: float = found[int(index[:-1])] if bracket else found
    return value if row.scale == 1.0 else value / row.scale  # keeps a 64-bit integer an integer
