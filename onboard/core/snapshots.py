"""Snapshots of the rover's state: what fault monitors, executive and telemetry read, and what a replay compares."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any, Protocol

from onboard.core.context import Context
from onboard.core.faults.monitors import MonitorInputs
from onboard.core.faults.wheels.seen import WheelInputs
from onboard.core.rover import Rover
from onboard.core.telemetry import SAMPLERS, TelemetryInputs
from onboard.planning.fences import entered
from onboard.records import ImuSample, Inputs, Scan
from protocol.conventions import TICK_NS
from protocol.link.transactions import Order
from protocol.tables.faults import BY_NAME


class _Part(Protocol):
    def digest_items(self) -> Sequence[float]: ...


def context(rover: Rover, inputs: Inputs, scans: Sequence[Scan], taken: Mapping[str, Any]) -> Context:
    """Return what the phases of modes and mission see of the rover in this tick."""
    return Context(
        inputs.tick,
        inputs.now_ns,
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
        item=lambda name: SAMPLERS[name](view(rover)),
        utc_ns=inputs.health.utc_ns,
        used_up=rover.power.used_up | rover.computer.used_up,
        seen=found(rover),
    )


def watched(rover: Rover, inputs: Inputs, orders: Sequence[Order]) -> MonitorInputs:
    """Return what the fault monitors read."""
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
        {*rover.watch.faults, *found(rover)},
        mission.result if mission else None,
        orders,
        inputs.record,
    )


def found(rover: Rover) -> dict[str, str]:
    """Rows found by the watches of devices, power and computer and by the last mission, with their findings."""
    mission = rover.executive.mission
    dirty = {"LIDAR_DIRTY": mission.seeing.dirty} if mission and mission.seeing.dirty else {}
    return {**dirty, **rover.devices.faults, **rover.power.found, **rover.computer.found}


def seen(rover: Rover, imu: ImuSample | None, now_ns: int) -> WheelInputs:
    """Return what the wheel watch reads."""
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


def view(rover: Rover) -> TelemetryInputs:
    """Return what telemetry samples."""
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
        wheel_orders=rover.nodes.wheel_orders,
        slip_ratio=rover.watch.slip.shortfall,
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


def digest(state: Mapping[str, tuple[float, ...]]) -> bytes:
    """8 bytes: BLAKE2b of the state items as float64."""
    items = tuple(chain.from_iterable(state.values()))
    return hashlib.blake2b(struct.pack(f"{len(items)}d", *items), digest_size=8).digest()
