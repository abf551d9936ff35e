"""The rover in one page: each line of `tick` is one arrow of the picture in the README.

    read ports -> parse -> estimate -> monitors -> executive -> guide -> steer -> telemetry -> write ports -> record

The shell (app.py) reads and writes; everything between is here, a deterministic function of configuration and inputs.
"""

from __future__ import annotations

import hashlib

from onboard.config import Config
from onboard.core.downlink import Downlink
from onboard.core.executive import Executive
from onboard.core.jobs import JobBook
from onboard.core.mission import Context
from onboard.core.monitors import Watched, active_faults
from onboard.core.telemetry import View
from onboard.devices.lidar import LidarSession
from onboard.devices.nodes import Nodes
from onboard.motion.kinematics import stopped, wheel_commands
from onboard.perception.localisation import Localisation
from onboard.records import Gdem, Inputs, Outputs, Twist, WheelCommand, WheelMode

WHEEL_TICKS = 2  # 50 Hz wheel commands
VIEW_TICKS = 50  # 2 Hz housekeeping


class Rover:
    """Everything the core owns. One owner each; nothing is shared."""

    def __init__(self, config: Config, gdem: Gdem | None) -> None:
        self.config = config
        self.lidar = LidarSession(config.lidar)
        self.nodes = Nodes(config.rover, config.can)
        self.localisation = Localisation(config.rover, config.localisation)
        self.downlink = Downlink(config.link)
        self.executive = Executive(config, gdem, self.downlink)
        self.jobs = JobBook()
        self.wheels: tuple[WheelCommand, ...] = (WheelCommand(WheelMode.HOLD, 0.0, 0.0),) * 4
        self.twist = Twist()
        self.steering_held = False
        self.worst_tick_ns = 0


def tick(rover: Rover, inputs: Inputs) -> Outputs:
    """One tick of 10 ms: what the outside said in, what the rover does out."""
    now_ns = inputs.now_ns
    scans = rover.lidar.receive(inputs.lidar_chunks, inputs.lidar_state, now_ns)
    rover.nodes.receive(inputs.can_frames, now_ns)
    orders = rover.downlink.receive(inputs.link_messages, now_ns)
    taken = rover.jobs.take(inputs.jobs, inputs.tick)

    rover.localisation.update(rover.nodes.wheels, rover.nodes.imu, now_ns)
    faults = active_faults(_watched(rover, inputs))

    context = Context(
        inputs.tick, now_ns, scans, rover.lidar, rover.nodes, rover.localisation, rover.jobs, taken, held=False
    )
    rover.twist = rover.executive.step(orders, faults, context)
    if inputs.tick % WHEEL_TICKS == 0:
        rover.nodes.set_wheels(_steer(rover))

    events = _tell(rover, inputs)
    return Outputs(
        can_frames=rover.nodes.send(now_ns, int(rover.executive.mode)),
        lidar_bytes=rover.lidar.send(now_ns),
        lidar_connect=rover.lidar.wants_connect(now_ns),
        link_payloads=rover.downlink.send(now_ns),
        jobs=rover.jobs.outgoing(),
        events=events,
        state_digest=_digest(rover),
    )


def _watched(rover: Rover, inputs: Inputs) -> Watched:
    return Watched(
        inputs.now_ns, rover.config, inputs.can_state, rover.lidar, rover.nodes, rover.localisation.estimate,
        rover.downlink.last_contact_ns, rover.jobs.late_ticks, rover.executive.in_mission,
    )


def _steer(rover: Rover) -> tuple[WheelCommand, ...]:
    if rover.twist == Twist():
        rover.wheels, rover.steering_held = stopped(rover.wheels), False
    else:
        rover.wheels, rover.steering_held = wheel_commands(
            rover.twist, rover.nodes.wheels, rover.wheels, rover.config.rover, rover.config.motion, rover.steering_held
        )
    return rover.wheels


def _tell(rover: Rover, inputs: Inputs) -> tuple[object, ...]:
    events, rover.executive.events = tuple(rover.executive.events), []
    for event in events:
        rover.downlink.event(event)
    rover.worst_tick_ns = max(rover.worst_tick_ns, inputs.health.last_tick_ns)
    if inputs.tick % VIEW_TICKS == 0:
        rover.downlink.sample(view(rover), inputs.now_ns)
    return events


def view(rover: Rover) -> View:
    """What telemetry may show."""
    raise NotImplementedError


def _digest(rover: Rover) -> bytes:
    """8 bytes over the state of every part: what a replay compares each tick."""
    estimate = rover.localisation.estimate.pose
    items = (
        rover.executive.mode, rover.executive.phase, rover.twist, rover.wheels, rover.steering_held,
        estimate.x_m, estimate.y_m, estimate.z_m, estimate.roll_rad, estimate.pitch_rad, estimate.yaw_rad,
        rover.localisation.digest_items(), rover.lidar.digest_items(), rover.nodes.digest_items(),
        rover.downlink.digest_items(),
    )
    return hashlib.blake2b(repr(items).encode(), digest_size=8).digest()
