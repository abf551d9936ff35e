"""The flight core in one process: emulated CAN nodes and scanner, wheels that roll ideally on flat ground, no plant.

A tick goes as on the bench: what the devices said until n -> tick n -> the world goes on to n + 1 -> its orders arrive.
The ground is the plane z = 0 with posts on it, so that a registration has something to hold on to.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import replace
from functools import cache

import numpy as np

from hil.devices.can.nodes import build_nodes
from hil.devices.can.wire import CanWire
from hil.devices.lidar.profile import IDEAL, stamp_to_first_byte_ns
from hil.devices.lidar.sensor import Lidar
from hil.records import PlantState, WheelTruth
from onboard import config
from onboard.core.rover import Rover
from onboard.core.tick import tick
from onboard.drivers.platform.workers import perform
from onboard.motion.kinematics import wheel_places
from onboard.motion.odometry import body_twist
from onboard.records import Chunk, Health, Inputs, JobDone, LinkMessage, PortState, Timing, Twist
from protocol.can.guard import Guard
from protocol.conventions import TICK_NS
from protocol.link.datagrams import DatagramKind
from protocol.link.transactions import RequestState, decode_report
from protocol.tables import commands
from protocol.tables.modes import Phase

DT_S = TICK_NS / 1e9
GRAVITY_MPS2 = 1.62
LOAD_NM = 0.1
STEER_RATE_RADPS = 0.5
RANGE_M = 30.0
POST_RADIUS_M, POST_TOP_M = 0.2, 1.5
POSTS = ((5.0, 2.0), (4.0, -2.5), (-3.0, 2.5), (-4.0, -2.0), (1.0, 4.5), (0.5, -4.0), (8.0, 0.5), (-6.5, 0.5))
STATION = 3

QUICK = config.Config(
    scanning=config.Scanning(start_rad=1.05, end_rad=-0.1, spacing_m=0.15, floor_rad=0.006, cap_rad=0.03, range_m=6.0),
    mapping=config.Mapping_(size_m=14.0, near_m=3.0),
    lidar=config.Lidar(latency_ns=stamp_to_first_byte_ns(IDEAL)),
    jobs=config.Jobs(map_ticks=5, plan_ticks=5),
)


def plane_and_posts(origin_m, directions, posts=POSTS):
    """Ranges (n,) of rays along unit `directions` (n, 3) from one origin to the plane z = 0 and upright posts."""
    dx, dy, dz = directions.T
    with np.errstate(divide="ignore", invalid="ignore"):
        ranges = np.where(dz < 0.0, -origin_m[2] / dz, np.inf)
        flat2 = dx * dx + dy * dy
        for x_m, y_m in posts:
            ox, oy = x_m - origin_m[0], y_m - origin_m[1]
            along = (ox * dx + oy * dy) / flat2
            off2 = ox * ox + oy * oy - along * along * flat2
            hit = along - np.sqrt(POST_RADIUS_M**2 - off2) / np.sqrt(flat2)
            z_m = origin_m[2] + hit * dz
            ranges = np.where((hit > 0.0) & (z_m > 0.0) & (z_m < POST_TOP_M), np.minimum(ranges, hit), ranges)
    return np.where(ranges <= RANGE_M, ranges, np.inf)


class CoreBench:
    """One rover and its world. `step` is one tick; what it said is in reports, events, phases and ordered.

    reports: (tick, Report) as the ground would hear them. phases: (tick, Phase), each entry into one.
    ordered: newest WHEEL_n_COMMAND values, wheels 1 to 4. memory: a map kept from before. lidar_plugged,
    job_late_ticks, tilt_rad, noise (frames of the next tick), grip (share of the wheels' motion that the body makes):
    faults. saved: what its disk says in the next tick. digests: of each tick's outputs.
    health, timing, machine: of the next ticks. inputs, outputs: of the tick last run.
    """

    def __init__(self, seed=1, settings=QUICK, posts=POSTS, memory=None, gdem=None):
        self.rover = Rover(settings, gdem, memory)
        self.nodes = build_nodes(seed)
        self.lidar = Lidar(seed, self._cast)
        self.tick = 0
        self.pose = [0.0, 0.0, 0.0]
        self.reports, self.events, self.phases = [], [], []
        self.ordered, self.digests, self.inputs, self.outputs = {}, [], None, None
        self.wire, self.lidar_plugged = CanWire(seed), True
        self.job_late_ticks, self.tilt_rad, self.noise, self.saved = 0, 0.0, (), ()
        self.health, self.timing, self.machine = Health(), Timing(), None
        self.grip, self._speed = 1.0, (0.0, 0.0)
        self._posts, self._guard = posts, Guard()
        self._places = wheel_places(settings.rover)
        self._radius_m = settings.rover.wheel_radius_m
        self._wheels = [WheelTruth(0.0, 0.0, 0.0, 0.0) for _ in range(4)]
        self._frames, self._bytes, self._messages, self._jobs = [], [], [], []
        self._lidar_open, self._next_id = False, 1
        angles = np.deg2rad(np.arange(1081) * 0.25 - 135.0)
        self._beams = np.column_stack([np.cos(angles), np.sin(angles)])
        self._advance(TICK_NS)

    # -- the operator ------------------------------------------------------------------------------------------

    def order(self, name, **arguments):
        """A command that arrives with the next tick; its request id."""
        request_id, self._next_id = self._next_id, self._next_id + 1
        payload = commands.encode(commands.Telecommand(request_id, self.now_ns, 0, name, arguments))
        self.hear(LinkMessage(self.now_ns, True, "ok", STATION, DatagramKind.TELECOMMAND, payload))
        return request_id

    def goto(self, x_m, y_m):
        """The command goto."""
        return self.order("goto", x_m=x_m, y_m=y_m)

    def put_post(self, x_m, y_m):
        """A post more, from now on."""
        self._posts = (*self._posts, (x_m, y_m))

    def hear(self, message):
        """A datagram that arrives with the next tick."""
        self._messages.append(message)

    def states(self, request_id):
        """Reported states of a request, in order, copies left out."""
        heard = {r.serial: r.state for _, r in self.reports if r.request_id == request_id}
        return [heard[serial] for serial in sorted(heard)]

    def text(self, request_id):
        """Text of the newest report of a request."""
        return max((r for _, r in self.reports if r.request_id == request_id), key=lambda r: r.serial).text

    def told(self, name):
        """(time s, text) of each event of a name."""
        return [(event.now_ns / 1e9, event.text) for event in self.events if event.name == name]

    # -- time --------------------------------------------------------------------------------------------------

    @property
    def now_ns(self):
        """Time of the tick last run."""
        return self.tick * TICK_NS

    @property
    def mode(self):
        """The rover's mode."""
        return self.rover.executive.mode

    @property
    def phase(self):
        """The mission's phase."""
        return self.rover.executive.phase

    @property
    def rates(self):
        """Ordered rates of the four wheels."""
        return [self.ordered[n].rate_radps for n in (1, 2, 3, 4)]

    @property
    def turning_rates(self):
        """True rates of the four wheels."""
        return [wheel.rate_radps for wheel in self._wheels]

    def step(self):
        """One tick of everything."""
        self.tick += 1
        now_ns, was = self.now_ns, self.phase
        inputs = self.inputs = Inputs(
            self.tick,
            now_ns,
            can_frames=(*self.wire.to_computer(self._frames, now_ns), *self.noise),
            can=self._can_status(),
            lidar_chunks=tuple(self._bytes),
            lidar_state=PortState.OPEN if self._lidar_open else PortState.CLOSED,
            link_messages=tuple(self._messages),
            jobs=self._done(),
            saved=self.saved,
            health=self.health,
            timing=self.timing,
            machine=self.machine,
        )
        self.saved, self.noise, self._frames, self._bytes, self._messages = (), (), [], [], []
        outputs = self.outputs = tick(self.rover, inputs)
        self.digests.append(digest(outputs))
        self._jobs += outputs.jobs
        self.events += outputs.events
        if self.phase is not was:
            self.phases.append((self.tick, self.phase))
        heard = [data for kind, data in outputs.link_payloads if kind == DatagramKind.REPORT]
        self.reports += [(self.tick, decode_report(data)) for data in heard]
        self._advance(now_ns + TICK_NS)
        self._deliver(outputs, now_ns + TICK_NS)
        return outputs

    def leave_out(self, ticks):
        """So many ticks that the core does not get to; what comes meanwhile waits for it."""
        for _ in range(ticks):
            self.tick += 1
            self._advance(self.now_ns + TICK_NS)

    def run(self, seconds):
        """So much more time."""
        for _ in range(round(seconds / DT_S)):
            self.step()

    def until(self, condition, limit_s):
        """Runs until `condition()` holds; the time it took in s. AssertionError where it does not come in time."""
        for k in range(round(limit_s / DT_S) + 1):
            if condition():
                return k * DT_S
            self.step()
        raise AssertionError(f"not within {limit_s} s: {self.mode.name} {self.phase.name} {self.events[-5:]}")

    def until_phase(self, phase, limit_s=60.0):
        """Runs until this phase."""
        return self.until(lambda: self.phase is phase, limit_s)

    def until_driving(self):
        """Runs until the rover has driven for half a second."""
        self.until_phase(Phase.DRIVING)
        self.until(lambda: min(map(abs, self.turning_rates)) > 0.3, 15.0)

    def until_final(self, request_id, limit_s=120.0):
        """Runs until this request has ended; its last state."""

        def final():
            states = self.states(request_id)
            return bool(states) and RequestState(states[-1]).final

        self.until(final, limit_s)
        return self.states(request_id)[-1]

    def settle(self):
        """The two seconds in which the devices come up."""
        self.run(2.0)

    # -- the world ---------------------------------------------------------------------------------------------

    def _done(self):
        due = [job for job in self._jobs if self.tick >= job.due_tick + self.job_late_ticks]
        self._jobs = [job for job in self._jobs if job not in due]
        return tuple(JobDone(job.job_id, perform(job)) for job in due)

    def _can_status(self):
        self.wire.errors()
        return self.wire.status

    def _advance(self, until_ns):
        hubs = []
        for n, (wheel, drive) in enumerate(zip(self._wheels, self.nodes.drives())):
            way_rad = STEER_RATE_RADPS * DT_S
            steer_rad = wheel.steer_rad + max(-way_rad, min(way_rad, drive.steer_rad - wheel.steer_rad))
            position_rad = wheel.position_rad + drive.rate_radps * DT_S
            self._wheels[n] = WheelTruth(steer_rad, position_rad, drive.rate_radps, LOAD_NM * np.sign(drive.rate_radps))
            speed_mps = drive.rate_radps * self._radius_m
            hubs.append((speed_mps * math.cos(steer_rad), speed_mps * math.sin(steer_rad)))
        twist, _ = body_twist(hubs, self._places)
        twist = Twist(*(self.grip * v for v in twist))
        self._move(twist)
        state = self._state(until_ns, twist)
        self.nodes.step(until_ns, state)
        self.lidar.step(until_ns)
        self._frames += self.nodes.send()
        self._bytes += [Chunk(stamp_ns, data) for stamp_ns, data in self.lidar.send()]
        if self._lidar_open and not self.lidar_plugged:
            self._lidar_open = False
            self.lidar.disconnect()
            self._bytes = []

    def _move(self, twist):
        yaw = self.pose[2] + 0.5 * twist.yaw_radps * DT_S
        self.pose[0] += (twist.vx_mps * math.cos(yaw) - twist.vy_mps * math.sin(yaw)) * DT_S
        self.pose[1] += (twist.vx_mps * math.sin(yaw) + twist.vy_mps * math.cos(yaw)) * DT_S
        self.pose[2] += twist.yaw_radps * DT_S

    def _state(self, now_ns, twist):
        """The truth; `tilt_rad` rolls what gravity looks like, not the ground."""
        half = 0.5 * self.pose[2]
        (vx, vy, yaw), (ux, uy) = twist, self._speed
        self._speed = (vx, vy)
        force = np.array(
            [
                (vx - ux) / DT_S - yaw * vy,
                (vy - uy) / DT_S + yaw * vx + GRAVITY_MPS2 * math.sin(self.tilt_rad),
                GRAVITY_MPS2 * math.cos(self.tilt_rad),
            ]
        )
        return PlantState(
            now_ns,
            np.array([self.pose[0], self.pose[1], 0.0]),
            np.array([0.0, 0.0, math.sin(half), math.cos(half)]),
            np.zeros(3),
            np.array([0.0, 0.0, twist.yaw_radps]),
            force,
            tuple(self._wheels),
        )

    def _deliver(self, outputs, now_ns):
        if outputs.can_connect:
            self.wire.connect()
        for frame in self.wire.to_nodes(outputs.can_frames):
            self.nodes.receive(frame, now_ns)
            values = self._guard.receive(frame)
            if 0x101 <= frame.can_id <= 0x104:
                self.ordered[frame.can_id - 0x100] = values
        if self._lidar_open and outputs.lidar_bytes:
            self.lidar.receive(outputs.lidar_bytes, now_ns)
        if outputs.lidar_connect and self.lidar_plugged:
            self._lidar_open = True
            self.lidar.connect()

    def _cast(self, times_ns):
        rover = self.rover.config.rover
        tilt = self.nodes.tilt.angles_at(times_ns)
        ahead, left = self._beams.T
        x_m, y_m, yaw = self.pose
        out, up = ahead * np.cos(tilt), -ahead * np.sin(tilt)
        c, s = math.cos(yaw), math.sin(yaw)
        directions = np.column_stack([c * out - s * left, s * out + c * left, up])
        origin = (x_m + c * rover.lidar_x_m, y_m + s * rover.lidar_x_m, rover.lidar_z_m)
        return plane_and_posts(origin, directions, self._posts)


def digest(outputs):
    """Of everything that a tick gave: bytes, orders for the shell, events, state."""
    jobs = [(job.job_id, job.name, job.due_tick) for job in outputs.jobs]
    said = (
        outputs.can_frames,
        outputs.lidar_bytes,
        outputs.lidar_connect,
        outputs.link_payloads,
        jobs,
        outputs.events,
        outputs.pose,
        outputs.state_digest,
    )
    return hashlib.blake2b(repr(said).encode(), digest_size=8).digest()


@cache
def first_map():
    """The map after the two scans of a first stop at the origin; made once a process."""
    rover = CoreBench()
    rover.settle()
    rover.goto(3.0, 0.5)
    rover.until_phase(Phase.PLANNING)
    return rover.rover.executive.mission.memory


def quick(**sections):
    """QUICK with some sections replaced."""
    return replace(QUICK, **sections)
