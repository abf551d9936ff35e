"""Messages of a ROS 2 bag, computed tick by tick from a record. The table TOPICS lists them.

/odom, /tf            from /out/pose, 20 a second; the twist from the wheels' reports, sigmas from the telemetry
/joint_states         from /in/can, 20 a second          /points          from /in/lidar and /in/can, each sweep
/map, /grid_map,      from /plan, each plan              /diagnostics     from /out/link, each sent state
/path/global, /local                                     /rosout          from /out/event
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Collection, Iterator, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from onboard.bringup.lidar.sweeps import sweeps_in
from onboard.bringup.records.foxglove import EVERY
from onboard.bringup.ros2 import clouds, maps, motion, state
from onboard.config import Config
from onboard.devices.nodes import Nodes
from onboard.motion.odometry import Odometry
from onboard.planning.archive import from_npz
from onboard.record.reader import Record, inputs_of, reading
from onboard.record.rows import ROWS
from onboard.record.schema import POSE
from onboard.records import Inputs, Twist
from protocol.generated import eldorado_dialect as dialect
from protocol.link.datagrams import DatagramKind
from protocol.tables import telemetry


class Topic(NamedTuple):
    """One topic of the bag.

    kind: message type.
    source: channel of the record from which it is computed.
    latched: True if a late subscriber gets the newest message.
    """

    kind: str
    source: str
    latched: bool = False


class BagMessage(NamedTuple):
    """One message with its topic and the onboard time at which its content was known."""

    at_ns: int
    topic: str
    message: Any


TOPICS: Mapping[str, Topic] = MappingProxyType(
    {
        "/odom": Topic("nav_msgs/msg/Odometry", "/out/pose"),
        "/tf": Topic("tf2_msgs/msg/TFMessage", "/out/pose"),
        "/joint_states": Topic("sensor_msgs/msg/JointState", "/in/can"),
        "/points": Topic("sensor_msgs/msg/PointCloud2", "/in/lidar"),
        "/map": Topic("nav_msgs/msg/OccupancyGrid", "/plan", latched=True),
        "/grid_map": Topic("grid_map_msgs/msg/GridMap", "/plan", latched=True),
        "/path/global": Topic("nav_msgs/msg/Path", "/plan", latched=True),
        "/path/local": Topic("nav_msgs/msg/Path", "/plan", latched=True),
        "/diagnostics": Topic("diagnostic_msgs/msg/DiagnosticArray", "/out/link"),
        "/rosout": Topic("rcl_interfaces/msg/Log", "/out/event"),
    }
)
_POSE_TICKS = EVERY["/out/pose"]


def messages(record: Record, config: Config, channels: Collection[str]) -> Iterator[BagMessage]:
    """Yield the messages of some channels of the record, by time. Raises DamagedRecordError."""
    streams = [_Follower(config).follow(record, channels)]
    if "/in/lidar" in channels:
        streams.append(_clouds(record, config))
    yield from heapq.merge(*streams, key=lambda message: message.at_ns)


def _clouds(record: Record, config: Config) -> Iterator[BagMessage]:
    def all_inputs() -> Iterator[Inputs]:
        for number, recorded in record.ticks():
            yield inputs_of(number, recorded)[0]

    for sweep in sweeps_in(all_inputs(), config):
        yield BagMessage(clouds.last_ns(sweep.scan), "/points", clouds.cloud(sweep.scan, config.rover))


class _Follower:
    """State of the rover that several messages need: wheels, twist, newest telemetry."""

    def __init__(self, config: Config) -> None:
        self._nodes = Nodes(config.rover, config.can)
        self._odometry = Odometry(config.rover)
        self._mavlink = dialect.MAVLink(None)
        self._mavlink.robust_parsing = True  # messages of another dialect are passed over
        self._values: dict[str, float] = {}
        self._twist = Twist()

    def follow(self, record: Record, channels: Collection[str]) -> Iterator[BagMessage]:
        """Yield the messages of all channels but the scanner's."""
        for number, recorded in record.ticks():
            inputs, _ = inputs_of(number, recorded)
            self._nodes.receive(inputs.can_frames, inputs.now_ns, inputs.can)
            self._twist = self._odometry.update(self._nodes.wheels, inputs.now_ns).twist
            with reading(number, "its outputs"):
                yield from self._of_tick(number, recorded, inputs.now_ns, channels)

    def _of_tick(
        self, number: int, recorded: Mapping[str, bytes], now_ns: int, channels: Collection[str]
    ) -> Iterator[BagMessage]:
        present = {topic for topic in channels if topic in recorded}
        state_sent = self._receive_telemetry(recorded.get("/out/link", b""))
        if "/out/link" in present and state_sent:
            yield BagMessage(now_ns, "/diagnostics", state.diagnostics(self._values, now_ns))
        if number % _POSE_TICKS == 0:
            yield from self._motion(recorded, now_ns, present)
        if "/plan" in present:
            yield from _plan(recorded["/plan"], now_ns)
        if "/out/event" in present:
            for event in ROWS["/out/event"](recorded["/out/event"]):
                yield BagMessage(now_ns, "/rosout", state.log(event))

    def _motion(self, recorded: Mapping[str, bytes], now_ns: int, present: Collection[str]) -> Iterator[BagMessage]:
        if "/out/pose" in present:
            pose = POSE.unpack(recorded["/out/pose"])
            sigmas = (self._values.get("sigma_position_m", math.nan), self._values.get("sigma_yaw_rad", math.nan))
            yield BagMessage(now_ns, "/odom", motion.odometry(pose, self._twist, sigmas, now_ns))
            yield BagMessage(now_ns, "/tf", motion.transform(pose, now_ns))
        if "/in/can" in present:
            joints = motion.joints(self._nodes.wheels, self._nodes.tilt_angle_rad, now_ns)
            yield BagMessage(now_ns, "/joint_states", joints)

    def _receive_telemetry(self, link: bytes) -> bool:
        """Take the telemetry that the rover sent in this tick; True if the state with its faults was in it."""
        state_sent = False
        for row in ROWS["/out/link"](link):
            if row["kind"] != DatagramKind.MAVLINK.name:
                continue
            for message in self._mavlink.parse_buffer(bytearray.fromhex(row["payload"])) or ():
                values = telemetry.values(message)
                self._values |= values
                state_sent |= "faults" in values
        return state_sent


def _plan(raw: bytes, now_ns: int) -> Iterator[BagMessage]:
    plan = from_npz(raw)
    yield BagMessage(now_ns, "/map", maps.occupancy(plan, now_ns))
    yield BagMessage(now_ns, "/grid_map", maps.grid_map(plan, now_ns))
    yield BagMessage(now_ns, "/path/global", maps.path(plan.global_path, now_ns))
    yield BagMessage(now_ns, "/path/local", maps.path(plan.path, now_ns))
