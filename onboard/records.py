"""The records that flow through the rover, one dataclass for each arrow of the data's way.

Frozen; arrays inside are owned by the record and not written after it is built. Times are onboard
nanoseconds since the start of the run unless a name says otherwise; angles radians; SI.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.ports import BusStatus as BusStatus
from onboard.ports import BusTrouble as BusTrouble
from onboard.ports import Health as Health
from onboard.ports import Machine as Machine
from onboard.ports import PortState as PortState
from onboard.ports import Save, Saved
from onboard.ports import Timing as Timing
from onboard.scan import BeamStatus as BeamStatus
from onboard.scan import Scan as Scan

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]
I32 = NDArray[np.int32]
Bool = NDArray[np.bool_]


# -- ports: what the shell tells the core, and what the core asks of the shell --------------------------------

class Frame(NamedTuple):
    """One CAN frame. `stamp_ns` is the time of its arrival (0 on frames to be sent)."""

    can_id: int
    data: bytes
    stamp_ns: int = 0


class Chunk(NamedTuple):
    """Bytes read from a stream in one piece, with the time they arrived."""

    rx_ns: int
    data: bytes


class LinkMessage(NamedTuple):
    """One datagram after the shell checked its tag. `kind` is protocol.link.Kind; `station` the key id.

    `accepted` False: the payload is empty and `verdict` says which check failed.
    """

    rx_ns: int
    accepted: bool
    verdict: str
    station: int
    kind: int
    payload: bytes


class JobDone(NamedTuple):
    """A finished job, taken at this tick. `value` is what its function returned."""

    job_id: int
    value: Any


@dataclass(frozen=True, slots=True)
class JobRequest:
    """Long work for beside the tick: `function` ("module:name") of `arguments`; its result is taken at `due_tick`."""

    job_id: int
    name: str
    function: str
    arguments: tuple[Any, ...]
    due_tick: int


@dataclass(frozen=True, slots=True)
class Inputs:
    """Everything the outside tells the core in one tick: the schema of the record."""

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
    saved: tuple[Saved, ...] = ()
    timing: Timing = Timing()
    machine: Machine | None = None  # in the ticks after a look at it


class Event(NamedTuple):
    """Something worth telling a person, once. `name` is a row of protocol.modes.EVENTS."""

    now_ns: int
    severity: str
    name: str
    text: str
    data: Mapping[str, Any] = {}


@dataclass(frozen=True, slots=True)
class Outputs:
    """Everything the core asks of the outside in one tick."""

    can_frames: tuple[Frame, ...] = ()
    can_connect: bool = False
    lidar_bytes: bytes = b""
    lidar_connect: bool = False
    link_payloads: tuple[tuple[int, bytes], ...] = ()  # (protocol.link.Kind, untagged payload)
    jobs: tuple[JobRequest, ...] = ()
    cancelled: tuple[int, ...] = ()  # ids of jobs that are no longer wanted
    events: tuple[Event, ...] = ()
    pose: tuple[float, float, float, float, float, float] = (0.0,) * 6  # estimate: x, y, z (m), roll, pitch, yaw (rad)
    state_digest: bytes = b""
    saves: tuple[Save, ...] = ()
    reboot: bool = False  # the flight program is to end after this tick and be started anew


# -- what the devices measured ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class TiltTrack:
    """Samples of the tilt angle. times_ns: (k,) int64 rising, onboard time; angles_rad: (k,) float64, positive down."""

    times_ns: NDArray[np.int64]
    angles_rad: F64


class WheelState(NamedTuple):
    """One wheel as its node last told. `position_rad` is the unwrapped encoder; `age_ns` counts from arrival."""

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
    """The power node's newest word. charge_ratio 0..1."""

    voltage_v: float
    current_a: float
    charge_ratio: float
    temperature_c: float
    age_ns: int
    brown_out: bool = False  # in the node's own judgement


# -- where the rover is and what it wants ----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Pose:
    """base_link in the map frame; roll, pitch, yaw intrinsic z-y-x (REP-103)."""

    x_m: float
    y_m: float
    z_m: float = 0.0
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0

    def matrix(self) -> F64:
        """T_map_base, (4, 4) float64: takes base coordinates to map coordinates."""
        cr, sr = np.cos(self.roll_rad), np.sin(self.roll_rad)
        cp, sp = np.cos(self.pitch_rad), np.sin(self.pitch_rad)
        cy, sy = np.cos(self.yaw_rad), np.sin(self.yaw_rad)
        return np.array([
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, self.x_m],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, self.y_m],
            [-sp, cp * sr, cp * cr, self.z_m],
            [0.0, 0.0, 0.0, 1.0],
        ])


@dataclass(frozen=True, slots=True)
class Estimate:
    """The filter's word: pose, its covariance (4, 4) over x, y, z, yaw, and the body rates."""

    pose: Pose
    covariance: F64
    speed_mps: float
    yaw_rate_radps: float


class Twist(NamedTuple):
    """Motion of base_link in its own axes."""

    vx_mps: float = 0.0
    vy_mps: float = 0.0
    yaw_radps: float = 0.0


class WheelMode(IntEnum):
    """Mode field of WHEEL_n_COMMAND."""

    OFF = 0
    HOLD = 1
    RUN = 2


class WheelCommand(NamedTuple):
    """One wheel's order."""

    mode: WheelMode
    steer_rad: float
    rate_radps: float


@dataclass(frozen=True, slots=True)
class Path:
    """Stations to drive: (k, 3) float64 x, y, body yaw in the map frame, at most `spacing_m` apart along the way.

    Successive stations with the same place and other yaw are a turn on the spot. The body may move in any direction
    relative to its yaw (crab, backwards): every station's pose was checked free. clearance_m: (k,) float64, distance of
    each to the nearest blocked pose, at most what was looked for; None where nobody looked.
    """

    stations: F64
    clearance_m: F64 | None = None

    @property
    def length_m(self) -> float:
        """Length of the way of base_link."""
        if len(self.stations) < 2:
            return 0.0
        return float(np.hypot(*np.diff(self.stations[:, :2], axis=0).T).sum())


# -- the map ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Cloud:
    """Beams of one stop in the map frame.

    origin_m: (3,) the scanner's centre, one for all beams (the rover stands). ends_m: (n, 3) float32, the hit, or for a
    beam without a hit within the mapping range the point at that range. hit: (n,) bool. sigma_range_m: 1 sigma noise.
    """

    origin_m: F64
    ends_m: F32
    hit: Bool
    sigma_range_m: float = 0.02


@dataclass(frozen=True, slots=True)
class Entry:
    """A cloud in base_link axes, the pose at which it enters the map, and the number of its stop."""

    cloud_base: Cloud
    pose: Pose
    stop: int


@dataclass(frozen=True, slots=True)
class Grid:
    """Where a grid lies. Arrays on it are (rows, columns) = z[j, i], row j along +y, column i along +x.

    x0_m, y0_m: centre of cell (0, 0); they lie on (k + 1/2) * cell_m, so moving a grid never resamples.
    """

    x0_m: float
    y0_m: float
    cell_m: float
    rows: int
    columns: int

    def cell(self, x_m: float, y_m: float) -> tuple[int, int]:
        """(j, i) of the cell that holds the point; may lie outside the grid."""
        return round((y_m - self.y0_m) / self.cell_m), round((x_m - self.x0_m) / self.cell_m)

    def contains(self, j: int, i: int) -> bool:
        """Whether the cell is on the grid."""
        return 0 <= j < self.rows and 0 <= i < self.columns

    def centre(self, j: int, i: int) -> tuple[float, float]:
        """(x_m, y_m) of a cell's centre."""
        return self.x0_m + i * self.cell_m, self.y0_m + j * self.cell_m


@dataclass(frozen=True, slots=True)
class Ldem:
    """The local digital elevation map: statistics of each cell, all (rows, columns); `10-navigation` section 3.

    n: int32 hits. sum_z, sum_z2: float64 of heights (m, m2). z_hi, z_lo: float32 highest and lowest hit, NaN without.
    sum_sigma: float32, sum of sigma_z of the hits. z_ray: float32, lowest height at which a beam crossed the cell
    without hitting in it, +inf where none did. view_m: float32 distance of the nearest view, inf where none.
    stop: int16 of the nearest view, -1 where none. assumed_z: float32, plane under the start, NaN where not assumed.
    """

    grid: Grid
    n: I32
    sum_z: F64
    sum_z2: F64
    z_hi: F32
    z_lo: F32
    sum_sigma: F32
    z_ray: F32
    view_m: F32
    stop: NDArray[np.int16]
    assumed_z: F32


@dataclass(frozen=True, slots=True)
class Surface:
    """What the planner knows of the ground, all (rows, columns); made from an Ldem by perception.cell_classes.

    cell_class: uint8 of CellClass. z_mean, z_top, z_bot: float32 de-biased heights, NaN where unknown.
    z_ray: float32, +inf where no beam crossed.
    """

    grid: Grid
    cell_class: U8
    z_mean: F32
    z_top: F32
    z_bot: F32
    z_ray: F32


class CellClass(IntEnum):
    """What the beams said of a cell."""

    OUTSIDE = 0
    OCCLUDED = 1
    HIT = 2
    FILLED = 3
    HOLE = 4
    ASSUMED = 5


class NodeSet(IntEnum):
    """The chapter's sets chi (Eq. 2 to 5, made non-circular)."""

    OUTSIDE = 0
    OCCLUDED = 1
    OBSTACLE = 2
    FREE = 3


@dataclass(frozen=True, slots=True)
class Gdem:
    """The orbiter's map: heights_m (rows, columns) float32, NaN = no data. `note` says where it came from."""

    grid: Grid
    heights_m: F32
    note: str = ""


@dataclass(frozen=True, slots=True)
class Decision:
    """What the mission rule chose and why. kind: 'drive' (then scan), 'goal' (then done), 'arrived', 'unreachable'.

    `rule` is the rule's name (R4 ...). heading_rad: to look at when scanning at the stop.
    """

    kind: str
    rule: str
    reason: str
    path: Path
    heading_rad: float
    data: Mapping[str, Any] = field(default_factory=dict)
