"""Records that flow through the rover, one dataclass for each arrow of the data flow; all can be imported from here.

This file has the inputs and outputs of a tick and the measurements of the devices; the rest is in motion, maps, scan
and status. Frozen; arrays inside are owned by the record and not written after it is built. Times are onboard
nanoseconds since the start of the run unless a name says otherwise; angles radians; SI.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.native.arrays import F32 as F32
from onboard.native.arrays import F64 as F64
from onboard.records.maps import I32 as I32
from onboard.records.maps import U8 as U8
from onboard.records.maps import Bool as Bool
from onboard.records.maps import CellClass as CellClass
from onboard.records.maps import Cloud as Cloud
from onboard.records.maps import Entry as Entry
from onboard.records.maps import Gdem as Gdem
from onboard.records.maps import Grid as Grid
from onboard.records.maps import Ldem as Ldem
from onboard.records.maps import NodeSet as NodeSet
from onboard.records.maps import Surface as Surface
from onboard.records.motion import Decision as Decision
from onboard.records.motion import Estimate as Estimate
from onboard.records.motion import Path as Path
from onboard.records.motion import Pose as Pose
from onboard.records.motion import Twist as Twist
from onboard.records.motion import WheelCommand as WheelCommand
from onboard.records.motion import WheelMode as WheelMode
from onboard.records.scan import BeamStatus as BeamStatus
from onboard.records.scan import Scan as Scan
from onboard.records.status import BusStatus as BusStatus
from onboard.records.status import BusTrouble as BusTrouble
from onboard.records.status import Health as Health
from onboard.records.status import Machine as Machine
from onboard.records.status import PortState as PortState
from onboard.records.status import RecordedParts as RecordedParts
from onboard.records.status import RecordStatus as RecordStatus
from onboard.records.status import RecordTrouble as RecordTrouble
from onboard.records.status import Save, SaveResult
from onboard.records.status import Timing as Timing

# -- ports: inputs from the shell to the core, and requests of the core to the shell ---------------------------


class Frame(NamedTuple):
    """One CAN frame. `stamp_ns` is the time of its arrival (0 on frames to be sent)."""

    can_id: int
    data: bytes
    stamp_ns: int = 0


class Chunk(NamedTuple):
    """Bytes read from a stream in one piece, with their time of arrival."""

    rx_ns: int
    data: bytes


class LinkMessage(NamedTuple):
    """One datagram after the shell checked its tag.

    rx_ns: time of arrival.
    accepted: if False, the payload is empty.
    verdict: `ok`, `unkept` (onboard.records.status), or the check that failed.
    station: key id.
    kind: protocol.link.datagrams.DatagramKind.
    payload: without the tag.
    """

    rx_ns: int
    accepted: bool
    verdict: str
    station: int
    kind: int
    payload: bytes


class JobDone(NamedTuple):
    """Result of a finished job, taken at this tick. value: return value of its function."""

    job_id: int
    value: Any


@dataclass(frozen=True, slots=True)
class JobRequest:
    """Job outside the tick: `function` ("module:name") of `arguments`; its result is taken at `due_tick`."""

    job_id: int
    name: str
    function: str
    arguments: tuple[Any, ...]
    due_tick: int


@dataclass(frozen=True, slots=True)
class Inputs:
    """All inputs of the core in one tick: the schema of the record."""

    tick: int
    now_ns: int
    can_frames: tuple[Frame, ...] = ()
    can: BusStatus = BusStatus()
    lidar_chunks: tuple[Chunk, ...] = ()
    lidar_state: PortState = PortState.CLOSED
    link_messages: tuple[LinkMessage, ...] = ()
    link_state: PortState = PortState.OPEN
    jobs: tuple[JobDone, ...] = ()
    health: Health = Health()
    saved: tuple[SaveResult, ...] = ()
    timing: Timing = Timing()
    machine: Machine | None = None  # only in a tick after new figures were read
    record: RecordStatus = RecordStatus()


class Event(NamedTuple):
    """Event to report once to people. name: a row of protocol.tables.modes.EVENTS."""

    now_ns: int
    severity: str
    name: str
    text: str
    data: Mapping[str, Any] = {}


@dataclass(frozen=True, slots=True)
class Outputs:
    """All outputs of the core in one tick."""

    can_frames: tuple[Frame, ...] = ()
    can_connect: bool = False
    lidar_bytes: bytes = b""
    lidar_connect: bool = False
    link_payloads: tuple[tuple[int, bytes], ...] = ()  # (protocol.link.datagrams.DatagramKind, untagged payload)
    jobs: tuple[JobRequest, ...] = ()
    cancelled: tuple[int, ...] = ()  # ids of jobs that are no longer wanted
    events: tuple[Event, ...] = ()
    pose: tuple[float, float, float, float, float, float] = (0.0,) * 6  # estimate: x, y, z (m), roll, pitch, yaw (rad)
    state_digest: bytes = b""
    state: Mapping[str, tuple[float, ...]] = field(default_factory=dict)  # what the digest is of, by part
    saves: tuple[Save, ...] = ()
    reboot: bool = False  # the flight program ends after this tick, to be started again


# -- measurements of the devices -------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class TiltTrack:
    """Samples of the tilt angle. times_ns: (k,) int64 rising, onboard time; angles_rad: (k,) float64, positive down."""

    times_ns: NDArray[np.int64]
    angles_rad: F64


class WheelState(NamedTuple):
    """Newest report of one wheel's node. position_rad: unwrapped encoder; age_ns: time since arrival."""

    steer_rad: float
    position_rad: float
    rate_radps: float
    state: int
    age_ns: int


class ImuSample(NamedTuple):
    """Angular rate and specific force in base_link axes."""

    stamp_ns: int
    gyro_radps: tuple[float, float, float]
    accel_mps2: tuple[float, float, float]


class PowerState(NamedTuple):
    """Newest status of the power node. charge_ratio: 0 to 1."""

    voltage_v: float
    current_a: float
    charge_ratio: float
    temperature_c: float
    age_ns: int
    brown_out: bool = False  # by the node's own judgement
