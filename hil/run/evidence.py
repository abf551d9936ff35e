"""TABLES of evidence: the bench's test that a step of a response was taken, and the time of a fault's first bad sample.

The tests use the outputs of the flight program, its mode and phase, and the true state; never the state of the
monitors.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType

from hil.records import PlantState
from hil.run.in_process import Rover
from onboard.motion.wheel_health import SOUND
from onboard.native import elementary, linear
from onboard.planning.fences import entered
from onboard.planning.mission_rule import RECORD_STOPS
from onboard.planning.plan_records import PlanResult
from onboard.records import Inputs, Outputs, Pose, RecordedParts
from protocol.generated import eldorado_dialect
from protocol.generated.can_codec import TABLE, TiltMode
from protocol.link.datagrams import DatagramKind
from protocol.tables.commands import decode
from protocol.tables.faults import ResponseStep
from protocol.tables.modes import Mode, Phase

WHEEL_COMMANDS, TILT_COMMAND = (0x101, 0x102, 0x103, 0x104), 0x120
ROVER_STATE = eldorado_dialect.MAVLINK_MSG_ID_ROVER_STATE
QUIET_NS = 1_000_000_000  # twice the period of housekeeping
HALTING = ("stop", "safe", "emergency_stop")
SLOW_RATIO = 0.7  # of the cruising speed, at the outer wheels of a curve
TOLD_NS, KNOWN_NS, STILL_RADPS = 150_000_000, 5e6, 1e-3
REST_RADPS, REST_MPS = 0.01, 0.005


class Sight:
    """State that the bench knows at a tick; call `update` each tick.

    now_ns: time of the tick
    contact_ns: time of the newest accepted datagram
    told_ns: time of the newest housekeeping message
    plan: plan result of this tick, or None
    rule: rule of the newest plan
    halted: True if the operator sent stop, safe or emergency_stop in this tick
    rates_radps: newest commanded rate of each wheel, by CAN id
    tilt_mode: newest commanded mode of the tilt axis
    hazard_ns: start of the scan line on which the drive guard raised its verdict
    job_late: True if a job's result is later than its tick
    dropped: frames and scans that the flight program discarded in this tick
    keeps: recording level of this tick
    """

    def __init__(self) -> None:
        self.now_ns = self.contact_ns = self.told_ns = 0
        self.plan: PlanResult | None = None
        self.halted, self.rule = False, ""
        self.rates_radps: dict[int, float] = {}
        self.tilt_mode = TiltMode.PARK
        self.hazard_ns: int | None = None
        self.job_late = False
        self.dropped = 0
        self._turns_radps: deque[float] = deque(maxlen=50)
        self._due: dict[int, int] = {}  # running jobs: tick of their result
        self._lines_ns: dict[int, int] = {}  # running jobs of the drive guard: start of their last line
        self._dropped = 0

    def update(self, inputs: Inputs, outputs: Outputs, rover: Rover, state: PlantState) -> None:
        """Update from the tick's inputs and outputs, the flight program's core and the true state after the tick."""
        self.now_ns, self.outputs, self.rover, self.state = inputs.now_ns, outputs, rover, state
        self.keeps = inputs.record.keeps
        self.contact_ns = max([self.contact_ns, *(m.rx_ns for m in inputs.link_messages if m.accepted)])
        for can_id, data, _ in outputs.can_frames:
            if can_id in WHEEL_COMMANDS:
                self.rates_radps[can_id] = TABLE[can_id].decode(data).rate_radps
            elif can_id == TILT_COMMAND:
                self.tilt_mode = TiltMode(TABLE[can_id].decode(data).mode)
        self._follow_jobs(inputs, outputs)
        self.halted = any(
            m.accepted and m.kind == DatagramKind.TELECOMMAND and decode(m.payload).name in HALTING
            for m in inputs.link_messages
        )
        if any(kind == DatagramKind.MAVLINK and ROVER_STATE in _messages(data) for kind, data in outputs.link_payloads):
            self.told_ns = self.now_ns
        self._turns_radps.append(rover.localisation.yaw_rate_radps)
        dropped = rover.nodes.bad_frames + rover.lidar.bad
        self.dropped, self._dropped = dropped - self._dropped + len(rover.nodes.watch.babbling), dropped

    def _follow_jobs(self, inputs: Inputs, outputs: Outputs) -> None:
        self.plan = next((value for _, value in inputs.jobs if isinstance(value, PlanResult)), None)
        self.rule = self.plan.decision.rule if self.plan else self.rule
        for job_id, value in inputs.jobs:
            self._due.pop(job_id, None)
            line_ns = self._lines_ns.pop(job_id, None)
            if line_ns is not None and value[1]:
                self.hazard_ns = line_ns
        for job_id in outputs.cancelled:
            self._due.pop(job_id, None)
        self.job_late = any(inputs.tick > due for due in self._due.values())
        for job in outputs.jobs:
            self._due[job.job_id] = job.due_tick
            if job.name == "guard_listen":
                self._lines_ns[job.job_id] = job.arguments[1][-1].scan.start_ns

    @property
    def turns_radps(self) -> float:
        """Rover's own estimate of its yaw rate: mean of half a second."""
        return elementary.total(self._turns_radps) / len(self._turns_radps)

    @property
    def mode(self) -> Mode:
        """Mode of the rover."""
        return self.rover.executive.mode

    @property
    def phase(self) -> Phase:
        """Phase of the mission."""
        return self.rover.executive.phase

    @property
    def pose(self) -> Pose:
        """True pose."""
        return self.state.pose


def _messages(payload: bytes) -> Iterator[int]:
    """Message ids of the MAVLink 2 messages in a datagram, unsigned: 10 bytes of header, the payload, 2 of checksum."""
    at = 0
    while at < len(payload):
        yield int.from_bytes(payload[at + 7 : at + 10], "little")
        at += 12 + payload[at + 1]


def _slow(sight: Sight) -> bool:
    config = sight.rover.config
    fastest_mps = max(map(abs, sight.rates_radps.values()), default=0.0) * config.rover.wheel_radius_m
    return fastest_mps <= SLOW_RATIO * config.motion.cruise_mps


def _knows_anew(sight: Sight) -> bool:
    """True if the re-estimated values are good: yaw rate about 0 at rest, scanner and axis data with current times."""
    heard_ns = sight.rover.nodes.tilt_track(sight.now_ns - TOLD_NS).times_ns
    in_time = len(heard_ns) > 0 and int(heard_ns[-1]) <= sight.now_ns
    clock = sight.rover.lidar.clock.quality
    known = clock.samples == 0 or clock.sigma_ns < KNOWN_NS
    return in_time and known and abs(sight.turns_radps) < STILL_RADPS


SHOWS: Mapping[ResponseStep, Callable[[Sight], bool]] = MappingProxyType({
    ResponseStep.STOP: lambda s: len(s.rates_radps) == 4 and not any(s.rates_radps.values()),
    ResponseStep.DISCARD_SWEEP: lambda s: s.phase is Phase.SCANNING and s.tilt_mode is TiltMode.PARK,
    ResponseStep.BACK_OFF: lambda s: s.phase is Phase.BACKING_OFF,
    ResponseStep.LOOK: lambda s: s.phase in (Phase.BACKING_OFF, Phase.SCANNING),
    ResponseStep.RESCAN: lambda s: s.phase in (Phase.BACKING_OFF, Phase.SCANNING),
    ResponseStep.SLOW: _slow,
    ResponseStep.DEGRADE: lambda s: s.rover.wheels != SOUND or s.mode is Mode.SAFE,
    ResponseStep.SAFE: lambda s: s.mode is Mode.SAFE,
    ResponseStep.STANDBY: lambda s: s.mode is Mode.STANDBY,
    ResponseStep.ESTOP: lambda s: s.mode is Mode.ESTOP,
    ResponseStep.RESTART_BUS: lambda s: s.outputs.can_connect,
    ResponseStep.IGNORE: lambda s: s.dropped > 0,
    ResponseStep.KEEP_LESS: lambda s: s.keeps is not RecordedParts.ALL,
    ResponseStep.SHED: lambda s: s.now_ns - s.told_ns > QUIET_NS,
    ResponseStep.OBEY: lambda s: s.mode in (Mode.STANDBY, Mode.SAFE, Mode.ESTOP) and not any(s.rates_radps.values()),
    ResponseStep.COMMIT: lambda s: s.rule not in ("", "R10"),
    ResponseStep.GIVE_UP: lambda s: s.phase is Phase.FAILED,
    ResponseStep.ESTIMATE_ANEW: _knows_anew,
})  # fmt: skip
"""REPORT is seen by its event. SAFE_OVER_LIMIT is not here: it follows only where the tries are used up, and then the
scenario says so: `mode = "SAFE"`."""

AT_ONCE = frozenset(
    {
        ResponseStep.STOP,
        ResponseStep.SLOW,
        ResponseStep.SAFE,
        ResponseStep.ESTOP,
        ResponseStep.RESTART_BUS,
        ResponseStep.IGNORE,
        ResponseStep.REPORT,
        ResponseStep.OBEY,
        ResponseStep.GIVE_UP,
    }
)
"""Steps that the tick's outputs hold; the others take their time, and must come before the run ends."""


def _over_tilt(sight: Sight) -> int | None:
    limit_rad = sight.rover.config.safety.tilt_limit_rad
    return sight.now_ns if max(abs(sight.pose.roll_rad), abs(sight.pose.pitch_rad)) > limit_rad else None


def _lost(sight: Sight) -> int | None:
    due_ns = sight.contact_ns + sight.rover.config.safety.command_lost_ns
    return due_ns if sight.now_ns > due_ns and sight.rover.executive.in_mission else None


def _unsure(sight: Sight) -> int | None:
    safety, (place_m, heading_rad) = sight.rover.config.safety, sight.rover.localisation.sigma
    over = place_m > safety.pose_sigma_m or heading_rad > safety.heading_sigma_rad
    return sight.now_ns if over and sight.rover.executive.in_mission else None


def _fenced(sight: Sight) -> int | None:
    rover = sight.rover
    return sight.now_ns if entered(rover.fences.fences, sight.pose, rover.config.rover) else None


def _rests(sight: Sight) -> bool:
    slow = all(abs(wheel.rate_radps) < REST_RADPS for wheel in sight.state.wheels)
    return slow and linear.norm(sight.state.velocity_mps) < REST_MPS


VIOLATES: Mapping[str, Callable[[Sight], int | None]] = MappingProxyType({
    "TILT_ANGLE": _over_tilt,
    "COMMAND_LOST": _lost,
    "JOB_LATE": lambda sight: sight.now_ns if sight.job_late else None,
    "POSE_UNSURE": _unsure,
    "HAZARD_AHEAD": lambda sight: sight.hazard_ns,
    "KEEP_OUT": _fenced,
    "NO_PATH": lambda sight: sight.now_ns if sight.plan and sight.plan.decision.kind == "unreachable" else None,
    "LOOP": lambda sight: sight.now_ns if sight.plan and sight.plan.state.since_record >= RECORD_STOPS else None,
    "OPERATOR": lambda sight: sight.now_ns if sight.halted else None,
})  # fmt: skip
"""Time of a row's first violating sample as soon as the bench knows it, where that is not the injection's first trace:
the fault grows out of the ground, the way driven or an order."""

COUNTS_WHEN: Mapping[str, Callable[[Sight], bool]] = MappingProxyType({"IMU_BIAS": _rests})
"""A row that can be found in a state alone: its time counts from the first tick of that state after the injection."""
