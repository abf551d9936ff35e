"""A scanner nodding in a known room: emulated sensor and axis, the flight session and nodes, an exact ray caster.

The room: a floor, a wall ahead, one on each side, and two boxes on the floor; all flat, so a ray's first hit is exact.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from hil.devices.can.tilt import TiltNode
from hil.devices.lidar import profile as profiles
from hil.devices.lidar import sensor
from onboard import config
from onboard.devices.lidar.session import LidarSession
from onboard.devices.nodes import Nodes
from onboard.perception.scan.scan3d import gather
from onboard.perception.scan.sweep import TiltSegment
from onboard.records import Chunk, Inputs, Outputs, PortState, Pose

TICK_NS = 10_000_000
ROVER = config.Rover()
PHI = np.radians(np.arange(1081) * 0.25 - 135.0)
SLABS = np.array([  # lowest and highest corner in the map
    [[-30, -30, -1.0], [30, 30, 0.0]],  # the floor
    [[6.5, -30, -1], [7.0, 30, 5]], [[-30, 3.5, -1], [30, 4.0, 5]], [[-30, -4.0, -1], [30, -3.5, 5]],  # walls
    [[2.0, 0.4, 0.0], [2.6, 1.2, 0.5]], [[4.0, -1.6, 0.0], [5.0, -0.6, 1.1]],  # boxes
])  # fmt: skip
EXACT = profiles.Profile(noise_near_m=0.0, noise_far_m=0.0)
HARD = dataclasses.replace(
    profiles.UTM30LX, rate_error=60e-6, turn_ns=25.05e6, start_ms=777.7, spike_ratio=0.02, spike_ns=5e6,
    noise_near_m=0.0, noise_far_m=0.0,
)  # fmt: skip


def latency_ns(profile):
    """From the stamp to the first byte: the sweep of 1080 steps of 1440, then the link."""
    return round(0.75 * profile.turn_ns) + profile.latency_ns


def still(_times_ns):
    """The pose at each time: base_link at the map's origin."""
    return np.zeros((len(_times_ns), 6))


class Nodding:
    """All of it, tick by tick. pose_at(times_ns): (n, 6) x, y, z, roll, pitch, yaw. late_ns: of the scans' times."""

    def __init__(self, profile=EXACT, pose_at=still, late_ns=0, seed=3):
        self.pose_at = pose_at
        self.axis = TiltNode(np.random.default_rng(seed))
        self.nodes = Nodes(ROVER, config.Can())
        self.twin = sensor.Lidar(seed, self.cast, profile)
        self.session = LidarSession(config.Lidar(latency_ns=latency_ns(profile) - late_ns))
        self.twin.connect()
        self.session.stream(True)
        self.tick, self.scans, self.truth, self.recorder = 0, [], {}, None

    @property
    def now_ns(self):
        return self.tick * TICK_NS

    def cast(self, times_ns):
        """Ranges of the 1081 beams, each at its own time, tilt and pose; what they hit is kept as the truth."""
        tilt = self.axis.angles_at(times_ns)
        rays = np.stack([np.cos(PHI) * np.cos(tilt), np.sin(PHI), -np.cos(PHI) * np.sin(tilt)], axis=1)
        poses = self.pose_at(times_ns)
        if poses.any():
            T = np.stack([Pose(*pose).matrix() for pose in poses])
            rays = np.einsum("nij,nj->ni", T[:, :3, :3], rays)
            origins = T[:, :3, 3] + T[:, :3, :3] @ [ROVER.lidar_x_m, 0, ROVER.lidar_z_m]
        else:
            origins = np.broadcast_to([ROVER.lidar_x_m, 0.0, ROVER.lidar_z_m], rays.shape)
        ranges_m, axes = first_hit(origins, rays, SLABS)
        self.truth[len(self.truth)] = (times_ns[0], origins + ranges_m[:, None] * rays, axes)
        return ranges_m

    def run(self, until):
        while not until():
            self.tick += 1
            for frame in self.nodes.send(self.now_ns, 0):
                self.axis.receive(frame, self.now_ns)
            self.axis.step(self.now_ns, None)  # the plant does not act on it
            frames = self.axis.send()
            self.nodes.receive(frames, self.now_ns)
            self.twin.step(self.now_ns)
            pieces = [Chunk(*piece) for piece in self.twin.send()]
            self.scans += self.session.receive(pieces, PortState.OPEN, self.now_ns)
            if self.recorder is not None:
                inputs = Inputs(self.tick, self.now_ns, tuple(frames), lidar_chunks=tuple(pieces))
                self.recorder.write(inputs, Outputs(state_digest=bytes(8)))
            self.twin.receive(self.session.send(self.now_ns), self.now_ns)
            assert self.tick < 100_000

    def settle(self, seconds):
        end = self.tick + int(seconds * 100)
        self.run(lambda: self.tick >= end)

    def sweep(self, start_deg, end_deg, rate_dps):
        """One constant-rate sweep from a parked axis, as a 3D scan of all beams from before it to after it."""
        self.nodes.park_tilt(math.radians(start_deg))
        self.settle(0.3)
        self.run(lambda: not self.nodes.tilt_moving)
        self.settle(0.3)
        begin_ns = self.now_ns
        self.nodes.sweep([segment(start_deg, end_deg, rate_dps)], self.now_ns + 400_000_000)
        self.run(lambda: self.nodes.sweep_done(self.now_ns))
        self.settle(0.2)
        taken = [scan for scan in self.scans if scan.start_ns >= begin_ns]
        return gather(taken, self.nodes.tilt_track(begin_ns - 200_000_000))

    def hits(self, scan3d, line, beam):
        """(points, axis 0 to 2 of the surface's normal) that these pixels truly hit."""
        starts_ns = np.array([row[0] for row in self.truth.values()])
        nearest = np.abs(starts_ns[:, None] - scan3d.pixels["time_ns"][:, 0]).argmin(axis=0)
        rows = list(self.truth.values())
        hit_m = np.stack([rows[k][1] for k in nearest])
        axes = np.stack([rows[k][2] for k in nearest])
        return hit_m[line, beam], axes[line, beam]


def segment(start_deg, end_deg, rate_dps):
    """One constant-rate part of a sweep."""
    length_ns = round(abs(end_deg - start_deg) / rate_dps * 1e9)
    return TiltSegment(math.radians(start_deg), math.radians(end_deg), math.radians(rate_dps), length_ns)


def first_hit(origins, rays, slabs):
    """Range along each ray (n,) to the first box it enters, and the axis of that face (n,)."""
    best, axis = np.full(len(rays), np.inf), np.zeros(len(rays), int)
    with np.errstate(divide="ignore", invalid="ignore"):
        for low, high in slabs:
            ends = np.stack([(low - origins) / rays, (high - origins) / rays])
            enter, leave = np.fmin(*ends), np.fmax(*ends)
            near, far = enter.max(axis=1), leave.min(axis=1)
            better = (near <= far) & (near > 0) & (near < best)
            best[better], axis[better] = near[better], enter.argmax(axis=1)[better]
    return best, axis
