"""The rover on one page: each line of `tick` is one arrow of the picture in the README.

    read ports -> parse -> estimate -> monitors -> executive -> guide -> steer -> telemetry -> write ports -> record

The shell (app.py) reads and writes; all steps between are here, a deterministic function of configuration and inputs.
The rate of each step is in the table of core.schedule. What takes longer than a tick runs in jobs beside it: the
executive submits them at a stop, and takes their results in a later tick (core.jobs):

    sweep -> look (cloud, registration) -> remember (map) -> plan (poses, visibility, next sensing position, path)

The executive's guide step then follows the path that the plan returned.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from onboard.core import snapshots
from onboard.core.faults.monitors import active_faults
from onboard.core.rover import Rover
from onboard.core.schedule import Group
from onboard.motion.kinematics import stopped, wheel_commands
from onboard.records import Event, Inputs, Outputs, Scan, Twist, WheelCommand, WheelState
from protocol.tables.modes import Mode

Mark = Callable[[Group], None]


def tick(rover: Rover, inputs: Inputs, mark: Mark = lambda _: None) -> Outputs:
    """One tick of 10 ms: inputs of the ports in, outputs of the rover out.

    mark: called when a rate group begins, for the shell's stopwatch; the measured times come back by Inputs.
    """
    now_ns, due = inputs.now_ns, rover.pace.schedule.due
    mark(Group.RECEIVE)
    scans = rover.lidar.receive(inputs.lidar_chunks, inputs.lidar_state, now_ns)
    rover.nodes.receive(inputs.can_frames, now_ns, inputs.can)
    for family in (rover.parameters, rover.fences):
        family.receive(inputs.saved)
    rover.keeping.receive(inputs.saved, now_ns)
    rover.link.receive(inputs.saved, now_ns)
    orders = rover.downlink.receive(inputs.link_messages, now_ns)
    rover.pace.update(inputs.timing, inputs.health, rover.jobs.running)
    taken = rover.jobs.take(inputs.jobs, inputs.tick, inputs.timing.job_ns)

    mark(Group.ESTIMATE)
    _estimate(rover, inputs, scans)

    mark(Group.MONITORS)
    rover.power.update(rover.nodes.power, now_ns, rover.config.safety)
    rover.computer.update(inputs, rover.config.computer)
    faults = rover.executive.masks.unmasked(active_faults(snapshots.watched(rover, inputs, orders)), now_ns)

    mark(Group.EXECUTIVE)
    context = snapshots.context(rover, inputs, scans, taken)
    rover.twist = rover.executive.step(orders, faults, context)
    for name in context.judge_anew:
        for watch in (rover.watch, rover.power, rover.computer):
            watch.forget(name)
    mark(Group.WHEELS)
    if due(Group.WHEELS, inputs.tick) or rover.twist == Twist():  # a stop is sent at once
        rover.nodes.set_wheels(rover.watch.orders(_steer(rover, rover.watch.steerings(rover.nodes.wheels))))

    mark(Group.HOUSEKEEPING)
    events = _tell(rover)
    if due(Group.HOUSEKEEPING, inputs.tick):
        rover.downlink.sample(snapshots.view(rover), now_ns)
        rover.pace.rest()

    mark(Group.SEND)
    pose = rover.localisation.pose
    return Outputs(
        can_frames=rover.nodes.send(now_ns, int(rover.executive.mode)),
        can_connect=rover.nodes.bus.wants_connect,
        lidar_bytes=rover.lidar.send(now_ns),
        lidar_connect=rover.lidar.wants_connect(now_ns),
        link_payloads=rover.downlink.send(now_ns),
        jobs=rover.jobs.outgoing(),
        saves=rover.take_saves(),
        cancelled=rover.jobs.cancelled(),
        events=events,
        pose=(pose.x_m, pose.y_m, pose.z_m, pose.roll_rad, pose.pitch_rad, pose.yaw_rad),
        reboot=rover.executive.services.reboot_due(now_ns),
        state=(state := snapshots.state_items(rover)),  # after all that has been sent
        state_digest=snapshots.digest(state),
    )


def _estimate(rover: Rover, inputs: Inputs, scans: Sequence[Scan]) -> None:
    """Update the pose estimate, and the watches of wheels and devices."""
    now_ns = inputs.now_ns
    imu = rover.nodes.imu[-1] if rover.nodes.imu else None
    wheels = rover.watch.readings(rover.nodes.wheels)
    rover.localisation.update(wheels, imu, now_ns, rover.wheels, rover.watch.slip.high)
    rover.watch.update(snapshots.seen(rover, imu, now_ns))
    rover.wheels = rover.watch.health
    rover.devices.update(rover.lidar, rover.nodes, scans, now_ns)
    rover.devices.clocks(rover.nodes, inputs.health.utc_ns, now_ns)
    bias_step_radps = rover.devices.rest(imu, rover.localisation.step.standing, rover.watch.slip.high, now_ns)
    if bias_step_radps:
        rover.localisation.doubt_bias(bias_step_radps)
    rover.keeping.note(rover.localisation)


def farewell(rover: Rover, now_ns: int) -> Outputs:
    """Return the last outputs of a run: the wheels stop and the LIDAR is ordered to stop."""
    rover.nodes.set_wheels(stopped(rover.orders))
    can_frames = rover.nodes.farewell(now_ns, int(Mode.STANDBY))
    return Outputs(can_frames=can_frames, lidar_bytes=rover.lidar.farewell(now_ns))


def darken(rover: Rover, inputs: Inputs) -> Outputs | None:
    """Return the outputs of a tick after the farewell, until the laser is known to be off; None when it is."""
    rover.lidar.receive(inputs.lidar_chunks, inputs.lidar_state, inputs.now_ns)
    if rover.lidar.dark:
        return None
    return Outputs(lidar_bytes=rover.lidar.send(inputs.now_ns))


def _steer(rover: Rover, wheels: Sequence[WheelState | None]) -> tuple[WheelCommand, ...]:
    if rover.twist == Twist():
        rover.orders, rover.steering_held = stopped(rover.orders), False
    else:
        rover.orders, rover.steering_held = wheel_commands(
            rover.twist,
            wheels,
            rover.orders,
            rover.config.rover,
            rover.config.motion,
            rover.steering_held,
            rover.wheels,
        )
    return rover.orders


def _tell(rover: Rover) -> tuple[Event, ...]:
    events = (*rover.downlink.notices, *rover.keeping.events, *rover.executive.events)
    rover.downlink.notices, rover.keeping.events, rover.executive.events = [], [], []
    for event in events:
        rover.downlink.event(event)
    rover.downlink.mode, rover.downlink.shedding = rover.executive.mode, rover.executive.shedding
    return events
