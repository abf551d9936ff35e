"""The bench: plant, devices, buses and the lock-step that ties them to the processes under test.

One tick n (10 ms), in this order:

    devices' bytes and frames up to n -> TICK n -> onboard thinks ... meanwhile plant and devices go on to n + 1
    onboard's DONE -> its frames and bytes are drained -> link (down) -> ground -> link (up)

So a command sent in tick n acts in the plant from n + 1 to n + 2: one tick of transport, and two cores are busy at
once. Only counts decide when a tick may run, never arrival time: same seed, same bytes, every run.
"""

from __future__ import annotations

import hashlib
import math
import struct
import time
from collections.abc import Callable, Set
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hil.can_hub import CanHub
from hil.devices.lidar import Lidar
from hil.devices.nodes import Nodes, build_nodes
from hil.lidar_server import LidarServer
from hil.lockstep import Barrier
from hil.plant import Plant
from hil.records import PlantState
from hil.terrain import Field
from hil.truth import Truth
from onboard.config import Rover
from onboard.records import Frame
from protocol.barrier import CLOSED, OPEN, Channel
from protocol.can_codec import TiltState
from protocol.conventions import TICK_NS

NS = 1_000_000_000
STREAMS = ("can_to_onboard", "can_to_nodes", "lidar_to_onboard", "lidar_to_sensor")
DRIVING_MPS = 0.05  # base_link moves: not a turn on the spot
WIRE_LIMIT_S = 30.0  # wall time for bytes that onboard says it has sent


class Stream:
    """Cumulative count, bytes and SHA-256 of what passed on one channel in one direction."""

    def __init__(self) -> None:
        self.pieces = self.bytes = 0
        self._sum = hashlib.sha256()

    def add(self, data: bytes, pieces: int = 1) -> None:
        """Some bytes more."""
        self.pieces += pieces
        self.bytes += len(data)
        self._sum.update(data)

    def report(self) -> dict[str, object]:
        """For the certificate."""
        return {"pieces": self.pieces, "bytes": self.bytes, "sha256": self._sum.hexdigest()}


@dataclass(slots=True)
class Wires:
    """What faults may change on the bench's side of the wires."""

    lidar_plugged: bool = True


@dataclass(slots=True)
class Progress:
    """What a progress line shows."""

    now_s: float = 0.0
    distance_to_goal_m: float = 0.0
    way_m: float = 0.0
    sweeping: bool = False
    driving: bool = False
    sweeps: int = 0
    overruns: int = 0
    link: dict[str, int] = field(default_factory=dict)


class Bench:
    """Owns everything that is emulated. `open` the ports, start the processes, `run`."""

    def __init__(self, world: Field, seed: int, rover: Rover, truth: Truth, alive: Callable[[], None]) -> None:
        self.world, self._rover, self.truth, self._alive = world, rover, truth, alive
        self.plant = Plant(world, seed)
        self.nodes: Nodes = build_nodes(seed)
        self.lidar = Lidar(seed, self._cast)
        self.hub, self.lidar_server, self.barrier = CanHub(), LidarServer("127.0.0.1"), Barrier()
        self.wires = Wires()
        self.streams = {name: Stream() for name in STREAMS}
        self.progress = Progress()
        self.laps_ms: list[tuple[float, float]] = []  # wall time of a tick: plant, devices; and onboard
        self.tick = 0
        self.ground_code: int | None = None  # exit code of the operator's script once it has ended
        self.state: PlantState = self.plant.reset(world.start)
        self._frames: list[Frame] = []
        self._lidar_out: list[tuple[int, bytes]] = []
        self._lidar_open, self._lidar_epoch, self._lidar_count = False, 0, 0
        self._link_counts: dict[str, int] = {}
        self._directions = self._beam_directions()

    # -- the world as the scanner sees it --------------------------------------------------------------------------

    @staticmethod
    def _beam_directions() -> NDArray[np.float64]:
        angles = np.deg2rad(np.arange(1081) * 0.25 - 135.0)
        return np.column_stack([np.cos(angles), np.sin(angles)])

    def _cast(self, times_ns: NDArray[np.int64]) -> NDArray[np.float64]:
        """Ranges of one turn: each beam at its own time, tilt and place of the rover."""
        positions, quaternions = self.plant.poses_at(times_ns)
        tilt = self.nodes.tilt.angles_at(times_ns)
        flat = self._directions
        in_base = np.column_stack([flat[:, 0] * np.cos(tilt), flat[:, 1], -flat[:, 0] * np.sin(tilt)])
        mount = np.array([self._rover.lidar_x_m, 0.0, self._rover.lidar_z_m])
        origins = positions + rotate(quaternions, np.broadcast_to(mount, in_base.shape))
        return self.plant.cast(np.ascontiguousarray(origins), rotate(quaternions, in_base), 30.0)

    # -- one tick ----------------------------------------------------------------------------------------------------

    def gather(self, names: Set[str]) -> None:
        """Wait until the processes are there, serving their handshakes meanwhile."""
        def idle() -> None:
            self.hub.poll()
            self.lidar_server.poll()
            self._alive()
        self.barrier.gather(names, idle)
        self._advance(TICK_NS)

    def step(self) -> None:
        """One tick of everything."""
        self.tick += 1
        now_ns = self.tick * TICK_NS
        onboard = self.barrier.participants.get("onboard")
        if onboard:
            onboard.begin(self.tick, now_ns, self._channels(now_ns))
        else:
            self._frames, self._lidar_out = [], []
        begun = time.perf_counter()
        self._advance(now_ns + TICK_NS)
        ready = time.perf_counter()
        if onboard:
            done = onboard.finish(self._alive)
            self.laps_ms.append((1e3 * (ready - begun), 1e3 * (time.perf_counter() - begun)))
            self._drain(done.sent, "lidar" in done.connect, now_ns)
        self._link_and_ground(now_ns)
        self._note(now_ns)

    def _advance(self, until_ns: int) -> None:
        """Plant and devices from the tick before to `until_ns`; what the devices say is kept for the next TICK."""
        self.plant.apply(self.nodes.drives())
        self.state = self.plant.step(TICK_NS)
        self.truth.add(self.state)
        self.nodes.step(until_ns, self.state)
        self.lidar.step(until_ns)
        self._frames += self.nodes.send()
        self._lidar_out += self.lidar.send()

    def _channels(self, now_ns: int) -> tuple[Channel, ...]:
        frames, self._frames = self._frames, []
        self.hub.write(frames)
        self.streams["can_to_onboard"].add(b"".join(pack_frame(f) for f in frames), len(frames))
        can = Channel("can", self.streams["can_to_onboard"].pieces, OPEN, 0, tuple(f.stamp_ns // 1000 for f in frames))
        down = self._link_counts.get("up_out", 0)
        fresh = down - self._link_counts.get("onboard_knows", 0)
        self._link_counts["onboard_knows"] = down
        return (can, self._lidar_channel(now_ns), Channel("link", down, OPEN, 0, (now_ns // 1000,) * fresh))

    def _lidar_channel(self, now_ns: int) -> Channel:
        pieces, self._lidar_out = self._lidar_out, []
        if self._lidar_open and not self.wires.lidar_plugged:
            self._lidar_open = False
            self.lidar_server.disconnect()
            self.lidar.disconnect()
        if not self._lidar_open:
            return Channel("lidar", 0, CLOSED, self._lidar_epoch)
        stamps: list[int] = []
        for stamp_ns, data in pieces:
            self.lidar_server.write(data)
            self.streams["lidar_to_onboard"].add(data)
            self._lidar_count += len(data)
            stamps += [len(data), stamp_ns // 1000]
        return Channel("lidar", self._lidar_count, OPEN, self._lidar_epoch, tuple(stamps))

    def _drain(self, sent: dict[str, int], connect: bool, now_ns: int) -> None:
        stamp_ns = now_ns + TICK_NS  # the plant has gone on by a tick meanwhile
        frames = self.hub.read_upto(0, sent.get("can", 0), WIRE_LIMIT_S, stamp_ns)
        self.streams["can_to_nodes"].add(b"".join(pack_frame(f) for f in frames), len(frames))
        for frame in frames:
            self.nodes.receive(frame, stamp_ns)
        if self._lidar_open:
            data = self.lidar_server.poll_exactly(sent.get("lidar", 0), WIRE_LIMIT_S)
            self.streams["lidar_to_sensor"].add(data, bool(data))
            self.lidar.receive(data, stamp_ns)
        elif connect and self.wires.lidar_plugged:
            self._plug_in()

    def _plug_in(self) -> None:
        if not self.lidar_server.wait_client(WIRE_LIMIT_S):
            raise TimeoutError(f"onboard asked for {self.lidar_server.address} and did not come")
        self._lidar_open, self._lidar_epoch, self._lidar_count = True, self._lidar_epoch + 1, 0
        self.lidar.connect()

    def _link_and_ground(self, now_ns: int) -> None:
        counts, people = self._link_counts, self.barrier.participants
        onboard = people.get("onboard")
        if onboard:
            counts["down_in"] = onboard.sent.get("link", 0)
        self._call_link(now_ns)
        ground = people.get("ground")
        down_out = counts.get("down_out", 0)
        news = down_out != counts.get("ground_knows")
        if ground and self.ground_code is None and (news or self.tick >= ground.wake_tick):
            counts["ground_knows"] = down_out
            ground.begin(self.tick, now_ns, (Channel("down_out", down_out),))
            sent = ground.finish(self._alive).sent
            counts["up_in"] = sent.get("up_in", 0)
            self.ground_code = sent["finished"] - 1 if "finished" in sent else None
            self._call_link(now_ns)

    def _call_link(self, now_ns: int) -> None:
        counts, link = self._link_counts, self.barrier.participants.get("link")
        heard = (counts.get("down_in", 0), counts.get("up_in", 0))
        if link and (heard != (counts.get("link_down"), counts.get("link_up")) or self.tick >= link.wake_tick):
            counts["link_down"], counts["link_up"] = heard
            link.begin(self.tick, now_ns, (Channel("down_in", heard[0]), Channel("up_in", heard[1])))
            counts.update(link.finish(self._alive).sent)

    def _note(self, now_ns: int) -> None:
        goal = self.world.goal_m
        x_m, y_m, _ = self.state.position_m.tolist()
        vx_mps, vy_mps, _ = self.state.velocity_mps.tolist()
        p, speed_mps = self.progress, math.hypot(vx_mps, vy_mps)
        p.now_s = now_ns / NS
        p.distance_to_goal_m = math.hypot(goal[0] - x_m, goal[1] - y_m)
        p.way_m += speed_mps * TICK_NS / NS
        p.driving = speed_mps > DRIVING_MPS
        sweeping = self.nodes.tilt.state in (TiltState.SWEEPING, TiltState.GAP)
        p.sweeps += sweeping and not p.sweeping
        p.sweeping = sweeping
        p.link = {"sent": self._link_counts.get("down_in", 0), "received": self._link_counts.get("down_out", 0)}

    def close(self, reason: str) -> None:
        """End the run for everyone."""
        self.barrier.close(reason)
        self.hub.close()
        self.lidar_server.close()
        self.plant.close()
        self.truth.close()


def pack_frame(frame: Frame) -> bytes:
    """A frame as the certificate hashes it."""
    return struct.pack("<HB", frame.can_id, len(frame.data)) + frame.data


def rotate(quaternions_xyzw: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Each of (n, 3) vectors by its (n, 4) quaternion."""
    x, y, z, w = quaternions_xyzw.T
    a, b, c = vectors.T
    p, q, r = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return np.column_stack((a + w * p + y * r - z * q, b + w * q + z * p - x * r, c + w * r + x * q - y * p))
