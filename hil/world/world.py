"""World that the bench emulates, without its wires: plant, nodes, scanner, true state.

Bench (sockets) and InMemory extend it.

    advance             -> devices' frames and bytes up to n + 1 are stored
    frames, lidar_says  -> input of the flight program in its next tick
    hear                -> its output reaches the devices; it acts from the next advance on

Faults of hil.faults.injection act on this class, so they are the same for every connection of the flight program.
"""

from __future__ import annotations

import hashlib
import struct
from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from hil.devices.can.nodes import Nodes, build_nodes
from hil.devices.can.wire import CanWire
from hil.devices.lidar.light import Surface, sector
from hil.devices.lidar.sensor import Lidar
from hil.plant.plant import STEP_NS, Plant
from hil.records import PlantState, TrueTurn
from hil.terrain.field import Field
from hil.terrain.obstacle import Obstacle
from hil.world.computer import Computer
from hil.world.contacts import Contact
from hil.world.disk import Disk
from hil.world.fitting import Fitting
from hil.world.surfaces import Surfaces, asked
from hil.world.trace import Trace
from hil.world.truth import Truth
from onboard.config import Rover
from onboard.extrinsics import lidar_place, lidar_rotation
from onboard.native import each, elementary, linear
from onboard.records import BusTrouble, Frame
from protocol.conventions import TICK_NS
from protocol.generated.can_codec import TiltState

NS = 1_000_000_000
STREAMS = ("can_to_onboard", "can_to_nodes", "lidar_to_onboard", "lidar_to_sensor")
_HEAD = struct.Struct("<HB")
DRIVING_MPS = 0.05  # base_link moves: not a turn on the spot
TURNING_RADPS = 0.02  # a quarter of the slowest turn that the flight program commands


class Stream:
    """Count, bytes, SHA-256 and CRC of the data that passed on one channel in one direction."""

    def __init__(self) -> None:
        self.pieces = self.bytes = self.crc = 0
        self._sum = hashlib.sha256()

    def add(self, data: bytes, pieces: int = 1) -> None:
        """Add data."""
        self.pieces += pieces
        self.bytes += len(data)
        self.crc = crc32(data, self.crc)
        self._sum.update(data)

    def report(self) -> dict[str, object]:
        """Fields for the certificate."""
        return {"pieces": self.pieces, "bytes": self.bytes, "sha256": self._sum.hexdigest()}


@dataclass(slots=True)
class Wires:
    """Faults on the bench's side of the wires.

    lidar_plugged: False if the scanner's cable is unplugged
    jobs_late_ticks: delay of job results; not used in lock-step over sockets, which waits for them
    """

    lidar_plugged: bool = True
    jobs_late_ticks: int = 0


@dataclass(slots=True)
class Progress:
    """Values of the progress line."""

    now_s: float = 0.0
    distance_to_goal_m: float = 0.0
    way_m: float = 0.0
    sweeping: bool = False
    driving: bool = False
    sweeps: int = 0
    turning: bool = False
    overruns: int = 0
    contacts: Sequence[Contact] = ()
    link: dict[str, int] = field(default_factory=dict)


class World:
    """Plant and devices on one field, their time, and the data exchanged with the flight program.

    rover: rover as it was built (`hil.faults.build_errors`), whatever the flight program's configuration
    soil: row of hil.plant.soil.CLASSES
    """

    def __init__(
        self, ground: Field, seed: int, rover: Rover, truth: Truth, step_ns: int = STEP_NS, soil: str = "nominal"
    ) -> None:
        self.field, self._rover, self.truth = ground, rover, truth
        self.plant = Plant(ground, seed, step_ns, rover, soil)
        self.fitting = Fitting()
        self.nodes: Nodes = build_nodes(seed, rover)
        self.lidar = Lidar(seed, self._cast)
        self._surfaces: Surfaces | None = None
        self.wires, self.computer, self.disk = Wires(), Computer(), Disk()
        self.can = CanWire(seed)
        self.lidar_open = False
        self.streams = {name: Stream() for name in STREAMS}
        self.trace = Trace((*STREAMS, "can_stamps", "can_controller", "computer", "disk", "ground", "plant"))
        self.progress = Progress()
        self.obstacles: list[Obstacle] = []  # trenches and steps put into the ground during the run
        self.tick = 0
        self.state: PlantState = self.plant.reset(ground.start)
        self.start = self.state.pose  # pose after settling; the flight program's configured start
        self._stamps_crc = self._controller_crc = 0
        self._frames: list[Frame] = []
        self._lidar_out: list[tuple[int, bytes]] = []
        self._directions = beam_directions()

    def fit(self, fitting: Fitting) -> None:
        """Set ray caster, nodes and scanner, before the first tick."""
        self.fitting = fitting
        self.plant.ground.cast_by(fitting.rays)
        self.nodes = build_nodes(self.plant.seed, self._rover, fitting.sensors)
        profile = fitting.lidar.applied()
        self.lidar = Lidar(self.plant.seed, self._cast, profile, look=self._look if asked(fitting.lidar) else _blind)
        self.lidar.optics.light.counted = sector(fitting.sector_rad)

    def lose(self, participant: str) -> None:
        """Accept that a process of the run was killed: it sends nothing from now on. Implemented by each bench."""
        raise NotImplementedError(participant)

    def regain(self, participant: str) -> None:
        """Connect a restarted process. Implemented by benches with processes."""
        raise NotImplementedError(participant)

    # -- the world as the scanner sees it --------------------------------------------------------------------------

    def _cast(self, times_ns: NDArray[np.int64]) -> NDArray[np.float64]:
        """Ranges of one turn: each beam with the tilt and the rover's pose at its own time."""
        positions, quaternions = self.plant.poses_at(times_ns)
        tilt = self.nodes.tilt.angles_at(times_ns)
        flat = self._directions
        in_base = np.column_stack([flat[:, 0] * each.cos(tilt), flat[:, 1], -flat[:, 0] * each.sin(tilt)])
        mount, turned = lidar_place(self._rover), lidar_rotation(self._rover)
        if turned is not None:
            in_base = linear.product(in_base, turned.T)
        origins = positions + rotate(quaternions, np.broadcast_to(mount, in_base.shape))
        origins, directions = np.ascontiguousarray(origins), rotate(quaternions, in_base)
        ranges = self.plant.cast(origins, directions, 30.0)
        sweep = self.progress.sweeps if self.progress.sweeping else 0
        self._turn = TrueTurn(int(times_ns[-1]), sweep, origins, directions, ranges)
        self.truth.add_turn(self._turn)
        return ranges

    def _look(self) -> Surface:
        """Surfaces met by the beams of the newest turn."""
        if self._surfaces is None or self._surfaces.field is not self.plant.field:
            self._surfaces = Surfaces(self.plant.field, self.fitting.lidar, self.plant.seed)
        turn = self._turn
        return self._surfaces.met(turn.origins_m, turn.directions, turn.ranges_m)

    # -- one tick ----------------------------------------------------------------------------------------------------

    def advance(self, until_ns: int) -> None:
        """Step plant and devices to `until_ns`; the devices' output is stored for the next tick."""
        self.plant.apply(self.nodes.drives())
        self.state = self.plant.step(TICK_NS)
        self.truth.add(self.state)
        self.nodes.step(until_ns, self.state)
        self.lidar.step(until_ns)
        self._frames += self.nodes.send()
        self._lidar_out += self.lidar.send()

    def frames(self) -> list[Frame]:
        """Nodes' frames since the last call."""
        frames, self._frames = self.can.to_computer(self._frames, self.tick * TICK_NS), []
        self._stamps_crc = crc32(array("q", [frame.stamp_ns for frame in frames]).tobytes(), self._stamps_crc)
        self.streams["can_to_onboard"].add(b"".join(map(pack_frame, frames)), len(frames))
        return frames

    def can_errors(self) -> list[BusTrouble]:
        """Errors that the computer's CAN controller reported since the last call."""
        errors = self.can.errors()
        self._controller_crc = crc32(bytes(errors), self._controller_crc)
        return errors

    def lidar_says(self) -> list[tuple[int, bytes]] | None:
        """Scanner's pieces since the last call, each with its time; None while the port is closed.

        An unplugged cable closes the port here, and bytes on their way are lost.
        """
        pieces, self._lidar_out = self._lidar_out, []
        if self.lidar_open and not self.wires.lidar_plugged:
            self.lidar_open = False
            self.lidar.disconnect()
        if not self.lidar_open:
            return None
        for _, data in pieces:
            self.streams["lidar_to_onboard"].add(data)
        return pieces

    def unheard(self) -> None:
        """Discard the devices' output of this tick: no receiver."""
        self._frames, self._lidar_out = [], []

    def hear(self, frames: Iterable[Frame], lidar_bytes: bytes, now_ns: int) -> None:
        """Deliver the flight program's output to the nodes and, while the port is open, to the scanner."""
        frames = self.can.to_nodes(list(frames))
        self.streams["can_to_nodes"].add(b"".join(map(pack_frame, frames)), len(frames))
        for frame in frames:
            self.nodes.receive(frame, now_ns)
        if self.lidar_open:
            self.streams["lidar_to_sensor"].add(lidar_bytes, bool(lidar_bytes))
            self.lidar.receive(lidar_bytes, now_ns)

    def plug_in(self) -> None:
        """Open the scanner's port for the flight program."""
        self.lidar_open = True
        self.lidar.connect()

    def note(self, now_ns: int) -> None:
        """Update progress and trace at the end of a tick."""
        sums = (stream.crc for stream in self.streams.values())
        ground = self.plant.ground_changes
        self.disk.note()
        inside = (self._stamps_crc, self._controller_crc, self.computer.crc, self.disk.refused_ticks)
        self.trace.add((*sums, *inside, ground, self.truth.crc))
        goal = self.field.goal_m
        x_m, y_m, _ = self.state.position_m.tolist()
        vx_mps, vy_mps, _ = self.state.velocity_mps.tolist()
        p, speed_mps = self.progress, elementary.hypot(vx_mps, vy_mps)
        p.now_s = now_ns / NS
        p.distance_to_goal_m = elementary.hypot(goal[0] - x_m, goal[1] - y_m)
        p.way_m += speed_mps * TICK_NS / NS
        p.driving = speed_mps > DRIVING_MPS
        p.turning = abs(float(self.state.angular_radps[2])) > TURNING_RADPS
        p.contacts = self.truth.contacts
        sweeping = self.nodes.tilt.state in (TiltState.SWEEPING, TiltState.GAP)
        p.sweeps += sweeping and not p.sweeping
        p.sweeping = sweeping

    def free(self) -> None:
        """Close the engine and the truth file."""
        self.plant.close()
        self.truth.close()


def _blind() -> None:
    """No surfaces: for a scanner whose errors do not depend on them."""


def pack_frame(frame: Frame) -> bytes:
    """Bytes of a frame as hashed for the certificate."""
    return _HEAD.pack(frame.can_id, len(frame.data)) + frame.data


def beam_directions() -> NDArray[np.float64]:
    """x and y of the 1081 beam directions in the scanner's plane, (1081, 2)."""
    angles = np.deg2rad(np.arange(1081) * 0.25 - 135.0)
    return np.column_stack([each.cos(angles), each.sin(angles)])


def rotate(quaternions_xyzw: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotate each of (n, 3) vectors by its (n, 4) quaternion."""
    x, y, z, w = quaternions_xyzw.T
    a, b, c = vectors.T
    p, q, r = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return np.column_stack((a + w * p + y * r - z * q, b + w * q + z * p - x * r, c + w * r + x * q - y * p))
