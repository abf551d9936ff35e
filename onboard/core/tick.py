"""The rover on one page: each line of `tick` is one arrow of the picture in the README.

    read ports -> parse -> estimate -> monitors -> executive -> guide -> steer -> telemetry -> write ports -> record

The shell (app.py) reads and writes; all steps between are here, a deterministic function of configuration and inputs.
The rate of each step is in the table of core.schedule.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol

from onboard.config import Config
from onboard.core.context import Context
from onboard.core.downlink import Downlink
from onboard.core.faults.computer import ComputerWatch
from onboard.core.faults.devices.watch import DeviceWatch
from onboard.core.faults.monitors import MonitorInputs, active_faults
from onboard.core.faults.power import PowerWatch
from onboard.core.faults.wheels.seen import WheelInputs
from onboard.core.faults.wheels.watch import WheelWatch
from onboard.core.jobs import JobBook
from onboard.core.modes import fence_orders, link_orders
from onboard.core.modes.executive import Executive
from onboard.core.modes.fence_orders import FenceOrders
from onboard.core.modes.link_orders import LinkOrders
from onboard.core.modes.parameter_orders import KEPT, ParameterOrders
from onboard.core.pose_store import KEPT as KEPT_POSE
from onboard.core.pose_store import Keeping
from onboard.core.schedule import Group
from onboard.core.telemetry import SAMPLERS, TelemetryInputs
from onboard.core.tick_timing import Pace
from onboard.devices.lidar.session import LidarSession
from onboard.devices.nodes import Nodes
from onboard.motion.kinematics import stopped, wheel_commands
from onboard.motion.wheel_health import SOUND, Wheels
from onboard.perception.localisation import Localisation
from onboard.planning.fences import entered
from onboard.records import (
    Event,
    Gdem,
    ImuSample,
    Inputs,
    Outputs,
    Scan,
    Twist,
    WheelCommand,
    WheelMode,
    WheelState,
)
from onboard.records.status import HALTS, Save
from protocol.conventions import TICK_NS
from protocol.link.transactions import Order
from protocol.tables.faults import BY_NAME
from protocol.tables.modes import Mode

if TYPE_CHECKING:  # built outside the tick, with modules that the core does not load
    from onboard.perception.stop_map import StopMap


Mark = Callable[[Group], None]


class _Part(Protocol):
    def digest_items(self) -> Sequence[float]: ...


class Rover:
    """All state of the core. Each part has one owner; nothing is shared.

    memory: map saved in an earlier run.
    kept: other data saved in earlier runs, by name.
    """

    def __init__(
        self,
        config: Config,
        gdem: Gdem | None,
        memory: StopMap | None = None,
        kept: Mapping[str, bytes] = MappingProxyType({}),
    ) -> None:
        self.lidar = LidarSession(config.lidar)
        self.nodes = Nodes(config.rover, config.can, config.link.boot_count)
        self.localisation = Localisation(config.rover, config.localisation)
        self.downlink = Downlink(config.link, kept.get(HALTS, b""))
        self.parameters = ParameterOrders(config, kept.get(KEPT, b""), self.downlink)
        self.fences = FenceOrders(bool(config.state.folder), kept.get(fence_orders.KEPT, b""), self.downlink)
        self.keeping = Keeping(config, kept.get(KEPT_POSE, b""), self.localisation)
        self.link = LinkOrders(kept.get(link_orders.KEPT, b""), self.downlink)
        self.executive = Executive((self.parameters, self.fences, self.link), gdem, self.downlink, memory)
        self.jobs = JobBook()
        self.orders: tuple[WheelCommand, ...] = (WheelCommand(WheelMode.HOLD, 0.0, 0.0),) * 4
        self.watch = WheelWatch(config.rover)
        self.power, self.computer = PowerWatch(), ComputerWatch()
        self.devices = DeviceWatch(config)
        self.wheels: Wheels = SOUND
        self.twist = Twist()
        self.steering_held = False
        self.pace = Pace()

    @property
    def config(self) -> Config:
        """The configuration with the operator's parameters as set now."""
        return self.parameters.config


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
    faults = rover.executive.masks.unmasked(active_faults(_watched(rover, inputs, orders)), now_ns)

    mark(Group.EXECUTIVE)
    context = Context(
        inputs.tick,
        now_ns,
        scans,
        rover.lidar,
        rover.nodes,
        rover.localisation,
        rover.jobs,
        taken,
        held=False,
        wheels=rover.wheels,
        found=rover.watch.faults,
        fences=rover.fences.fences,
        item=lambda name: SAMPLERS[name](_view(rover)),
        utc_ns=inputs.health.utc_ns,
        used_up=rover.power.used_up | rover.computer.used_up,
        seen=_found(rover),
    )
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
        rover.downlink.sample(_view(rover), now_ns)
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
        saves=_saves(rover),
        cancelled=rover.jobs.cancelled(),
        events=events,
        pose=(pose.x_m, pose.y_m, pose.z_m, pose.roll_rad, pose.pitch_rad, pose.yaw_rad),
        reboot=rover.executive.services.reboot_due(now_ns),
        state=(state := state_items(rover)),  # after all that has been sent
        state_digest=_digest(state),
    )


def _estimate(rover: Rover, inputs: Inputs, scans: Sequence[Scan]) -> None:
    """Update the pose estimate, and the watches of wheels and devices."""
    now_ns = inputs.now_ns
    imu = rover.nodes.imu[-1] if rover.nodes.imu else None
    wheels = rover.watch.readings(rover.nodes.wheels)
    rover.localisation.update(wheels, imu, now_ns, rover.wheels, rover.watch.slip.high)
    rover.watch.update(_seen(rover, imu, now_ns))
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


def _saves(rover: Rover) -> tuple[Save, ...]:
    owners = (rover.parameters, rover.fences, rover.keeping, rover.link)
    saves = tuple(save for owner in owners for save in owner.saves)
    for owner in owners:
        owner.saves.clear()
    return saves


def _found(rover: Rover) -> dict[str, str]:
    """Rows found by the watches of devices, power and computer and by the last mission, with their findings."""
    mission = rover.executive.mission
    dirty = {"LIDAR_DIRTY": mission.seeing.dirty} if mission and mission.seeing.dirty else {}
    return {**dirty, **rover.devices.faults, **rover.power.found, **rover.computer.found}


def _watched(rover: Rover, inputs: Inputs, orders: Sequence[Order]) -> MonitorInputs:
    mission = rover.executive.mission
    return MonitorInputs(
        inputs.now_ns,
        rover.config,
        rover.lidar,
        rover.nodes,
        rover.localisation.pose,
        rover.localisation.sigma,
        rover.downlink.last_contact_ns,
        rover.jobs.overdue_ticks(inputs.tick),
        rover.executive.in_mission,
        rover.executive.hazard,
        entered(rover.fences.fences, rover.localisation.pose, rover.config.rover),
        {*rover.watch.faults, *_found(rover)},
        mission.result if mission else None,
        orders,
        inputs.record,
    )


def _seen(rover: Rover, imu: ImuSample | None, now_ns: int) -> WheelInputs:
    currents_a = tuple(
        told.drive_current_a if told and told.stamp_ns > now_ns - TICK_NS else None for told in rover.nodes.wheel_status
    )
    localisation = rover.localisation
    return WheelInputs(
        now_ns,
        rover.watch.orders(rover.orders),
        rover.nodes.wheels,
        currents_a,
        imu,
        localisation.step,
        localisation.yaw_rate_radps,
        localisation.slip_ratio,
    )


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


def _view(rover: Rover) -> TelemetryInputs:
    executive, mission = rover.executive, rover.executive.mission
    return TelemetryInputs(
        mode=executive.mode,
        phase=executive.phase,
        estimate=rover.localisation.estimate,
        goal_m=mission.goal if mission else None,
        stop=mission.stop if mission else 0,
        wheels=tuple(wheel for wheel in rover.nodes.wheels if wheel is not None),
        power=rover.nodes.power,
        fault_ids=tuple(BY_NAME[name].number for name in executive.active),
        lidar_good=rover.lidar.counts["scans"],
        lidar_bad=rover.lidar.bad,
        lidar_clock=rover.lidar.clock.quality,
        tick_worst_ms=rover.pace.recent_tick_ns / 1e6,
        tick_late_ms=rover.pace.recent_late_ns / 1e6,
        ticks_slipped=rover.pace.slipped_ticks,
        groups_over=sum(rover.pace.over_budget),
        jobs_late=rover.jobs.late_count,
        link_received=rover.downlink.received,
        link_refused=rover.downlink.refused_count,
        events_waiting=rover.downlink.events_waiting,
        machine=rover.computer.machine,
        job=" ".join(rover.jobs.running),
        job_ratio=mission.progress_ratio if mission else 0.0,
        lease_station=executive.lease.holder,
        key_epoch=rover.link.epoch,
    )


def state_items(rover: Rover) -> dict[str, tuple[float, ...]]:
    """State that a replay compares each tick, by part."""
    executive = rover.executive
    parts: dict[str, _Part] = {
        "localisation": rover.localisation,
        "watch": rover.watch,
        "devices": rover.devices,
        "lidar": rover.lidar,
        "nodes": rover.nodes,
        "downlink": rover.downlink,
        "pace": rover.pace,
        "power": rover.power,
        "computer": rover.computer,
        "masks": executive.masks,
        "parameters": rover.parameters,
        "fences": rover.fences,
        "sequencer": executive.sequencer,
        "keeping": rover.keeping,
        "lease": executive.lease,
        "link": rover.link,
        "tasks": executive.tasks,
    }
    head = (executive.mode, executive.phase, *rover.twist, rover.steering_held, len(executive.tasks.track))
    return {"executive": head, **{name: tuple(part.digest_items()) for name, part in parts.items()}}


def _digest(state: Mapping[str, tuple[float, ...]]) -> bytes:
    """8 bytes: BLAKE2b of the state items as float64."""
    items = tuple(chain.from_iterable(state.values()))
    return hashlib.blake2b(struct.pack(f"{len(items)}d", *items), digest_size=8).digest()
