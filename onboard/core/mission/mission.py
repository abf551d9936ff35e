"""Mission of one `goto`: scan -> map -> plan -> drive -> turn -> scan ... until arrived or failed.

Section 9 of the chapter. If the map does not cover the ground under the rover, it scans ahead, turns round and scans
behind (R1). A fault may end a leg (`back_off`). Each phase is one method; a phase ends by entering the next. Both maps
outlive the mission. `core.mission.survey_and_tour` has the missions of other orders. Over 300 lines: the phases share
one state.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from onboard.config import Config
from onboard.core.context import Context
from onboard.core.mission.beam_loss import Seeing
from onboard.core.mission.drive_guard import GUARD_JOBS, Guarding
from onboard.core.mission.driven_trail import DrivenTrail
from onboard.core.mission.plan_request import plan_request, stands_on
from onboard.core.mission.sweep import Sensing, Sweep
from onboard.motion.follower import Follower
from onboard.native.elementary import dist
from onboard.planning.mission_rule import MissionState, interrupted
from onboard.planning.plan_records import PlanResult
from onboard.records import Decision, Entry, Gdem, Path, Pose, Twist
from protocol.conventions import wrap_rad
from protocol.tables.modes import Phase

if TYPE_CHECKING:  # built by the jobs, which run outside the tick
    from onboard.perception.map.stop_map import Look, StopMap
    from onboard.planning.guard.drive_guard import Bad
    from onboard.planning.prediction import Prediction

MISSION_JOBS = frozenset({"look", "remember", "plan", "predict"}) | GUARD_JOBS
BACK_OFF_M = 0.3
SLIPS_APART_M = 0.2
_STANDING_MPS = 0.01
MOVING = frozenset({Phase.DRIVING, Phase.TURNING, Phase.BACKING_OFF})
_TRUST_ODOMETRY_M = 2.0  # farther than this since the last registration, it scans again before it reports arrival
_TRIES = 3
_BLIND_NS = 30_000_000_000  # includes a reconnect of the scanner


@dataclass(frozen=True, slots=True)
class Outcome:
    """Outcome of a mission."""

    completed: bool
    reason: str
    broken: bool = False  # the failure is in the rover, not on the ground: the rover goes to SAFE


@dataclass(frozen=True, slots=True)
class SweepInMap:
    """Sweep that is in the map, with the pose at which it was entered and the number of its stop."""

    sweep: Sweep
    pose: Pose
    stop: int


FirstLook = tuple[Entry, tuple[float, float]]  # entry, and the accelerometer's bias estimate at that time


class Mission:
    """State of one goto; call `step` each tick.

    outcome: None until the mission has ended.
    notes: events (name, text) to report; the caller takes them.
    done: event of a successful end.
    progress: progress texts for the station that gave the order; the caller takes them.
    phase_told: last phase that was reported to the ground.
    seeing: share of beams lost by the scanner, and the measures against it.
    """

    done = "arrived"
    plans = True  # uses the planner: the mission ends if the scanner sees too little of the ground

    def __init__(self, config: Config, gdem: Gdem | None, goal: tuple[float, float], memory: StopMap | None) -> None:
        self._config, self.gdem, self.goal, self.memory = config, gdem, goal, memory
        self.phase = self.phase_told = Phase.NONE
        self.outcome: Outcome | None = None
        self.stop = 0
        self.scans_taken = 0
        self.result: PlanResult | None = None
        self.swept: SweepInMap | None = None
        self._sweep: Sweep | None = None
        self.notes: list[tuple[str, str]] = []
        self.progress: list[str] = []
        self._rule = self._rule_before = MissionState()
        self.predicted: Prediction | None = None  # to send to the station that gave the order
        self._foreseen = False
        self._behind_wanted = True
        self.seeing = Seeing(config)
        self._sensing: Sensing | None = None
        self._follower = Follower(config.rover, config.motion)
        self._turn_to_rad = 0.0
        self._first: tuple[StopMap | None, tuple[FirstLook, ...]] | None = None  # map before, looks until the turn
        self._way = DrivenTrail(
            0.0 if memory is None else math.inf
        )  # a saved map gives no distance since the last scan
        self._retreat: Path | None = None  # None until the rover stands
        self._retreat_m = 0.0
        self._guard: Guarding | None = None  # from the start of a leg until its findings are in the map
        self._driven = False
        self._backed: Counter[str] = Counter()
        self._phases = {
            Phase.SCANNING: self._scanning,
            Phase.MAPPING: self._mapping,
            Phase.PLANNING: self._planning,
            Phase.DRIVING: self._driving,
            Phase.TURNING: self._turning,
            Phase.BACKING_OFF: self._backing_off,
        }

    @property
    def decision(self) -> Decision | None:
        """The newest decision of the mission rule."""
        return self.result.decision if self.result else None

    @property
    def hazards(self) -> tuple[Bad, ...]:
        """Findings of the drive guard that are not in the map yet."""
        return self._guard.bad if self._guard else ()

    @property
    def progress_ratio(self) -> float:
        """Progress within the present phase, 0 to 1."""
        if self.phase is Phase.SCANNING and self._sensing:
            return self._sensing.progress_ratio
        if self.phase is Phase.DRIVING:
            return self._follower.progress_ratio
        return 0.0

    def step(self, ctx: Context) -> Twist:
        """Process one tick; return the body twist wanted now."""
        if self.phase is Phase.NONE:
            self._begin(ctx)
        if "predict" in ctx.taken:
            self.predicted = ctx.taken["predict"]
        self._way.note(ctx.localisation.pose)
        if "SLIP_HIGH" in ctx.found and self.phase in MOVING:
            self._slips(ctx.localisation.pose)
        phase = self._phases.get(self.phase)
        return phase(ctx) if phase else Twist()

    def _begin(self, ctx: Context) -> None:
        if self.memory is not None and stands_on(self.memory, ctx.localisation.pose, self._config):
            self._rule, self._behind_wanted = MissionState(number=1), False
            self._foresee(ctx, True)
        self._scan()

    def _foresee(self, ctx: Context, known: bool) -> None:
        """Submit the prediction of the path to this goal on the present map, once a goal; nothing of it is driven."""
        assert self.memory
        self._foreseen = True
        if "predict" in ctx.jobs.running:  # a late job of the previous goal
            return
        request = plan_request(
            self.memory,
            ctx.localisation.pose,
            self.goal,
            self.gdem,
            self._config,
            ctx.fences,
            sigma_m=ctx.localisation.sigma[0],
        )
        ctx.jobs.submit("predict", (request, known, self._config), ctx.tick + self._config.jobs.plan_ticks)

    def _slips(self, pose: Pose) -> None:
        """Record slip here: later plans, also of later missions, pay extra for this place."""
        here = (pose.x_m, pose.y_m)
        if self.memory and all(dist(here, known) > SLIPS_APART_M for known in self.memory.slippery_m):
            self.memory = replace(self.memory, slippery_m=(*self.memory.slippery_m, here))

    def back_off(self, why: str, way_m: float = BACK_OFF_M) -> int:
        """End the leg under way: drive back 0.3 m along it, scan, plan again. Return the count for this reason.

        While no leg is driven, do nothing and return 0. During a retreat, drop the rest of it and scan there.
        """
        if self.phase not in MOVING:
            return 0
        self._backed[why] += 1
        self._break_off(0.0 if self.phase is Phase.BACKING_OFF else way_m)
        return self._backed[why]

    def discard_sweep(self, why: str) -> None:
        """Restart a running sweep and delay one that has not begun; too many restarts end the mission."""
        if self.phase is Phase.SCANNING and self._sensing:
            self._sensing.discard(why)

    def look_again(self) -> bool:
        """End the leg under way: scan here, register, plan again. False if the rover has just done that."""
        if self.phase in (Phase.DRIVING, Phase.TURNING):
            self._break_off(0.0)
        return self.phase is not Phase.PLANNING

    def _break_off(self, back_m: float) -> None:
        self._retreat_m, self._retreat = back_m, None
        self._rule = interrupted(self._rule, self._rule_before)
        self.phase = Phase.BACKING_OFF

    def _scan(self) -> None:
        self._way.begin()
        self._sensing, self.phase = Sensing(self._config, self.seeing.nod), Phase.SCANNING

    def _end(self, phase: Phase, completed: bool, reason: str, broken: bool = False) -> None:
        self.phase, self.outcome = phase, Outcome(completed, reason, broken)

    def _arrive(self, reason: str) -> None:
        self._end(Phase.ARRIVED, True, reason)

    def _scanning(self, ctx: Context) -> Twist:
        assert self._sensing
        sweep = self._sensing.step(ctx.lidar, ctx.nodes, ctx.scans, ctx.now_ns)
        if self._sensing.tries > _TRIES:
            why = self._sensing.why or "the scanner or its axis does not get ready"
            self._end(Phase.FAILED, False, f"no whole sweep, scanned again {_TRIES} times: {why}", broken=True)
        elif sweep:
            self._look(ctx, sweep)
        return Twist()

    def _look(self, ctx: Context, sweep: Sweep) -> None:
        self.scans_taken += 1
        self._sweep = sweep
        guess = ctx.localisation.pose.matrix()
        arguments = (sweep.scans, sweep.tilt, guess, self.memory, self._config)
        ctx.jobs.submit("look", arguments, ctx.tick + self._config.jobs.map_ticks)
        self.phase = Phase.MAPPING

    def _mapping(self, ctx: Context) -> Twist:
        if "look" in ctx.taken:
            self._remember(ctx, ctx.taken["look"])
        elif "remember" in ctx.taken:
            self.memory = ctx.taken["remember"]
            if self.seeing.sweep_again():
                self._scan()
            elif self._behind_wanted:
                self._behind_wanted = False
                self._turn_to(wrap_rad(ctx.localisation.pose.yaw_rad + math.pi))
            elif self.plans and (why := self.seeing.ended()):
                self._end(Phase.FAILED, False, why, broken=True)
            else:
                self._plan(ctx)
        return Twist()

    def _remember(self, ctx: Context, seen: Look) -> None:
        localisation, found = ctx.localisation, seen.registration
        taken = found if found is not None and localisation.register(found) else None
        if taken is not None:
            self._way.correct(localisation.pose)
            self.notes.append(("REGISTERED", f"moved {taken.moved_m:.3f} m, {taken.moved_rad:.4f} rad"))
        elif found is not None:
            why = found.reason or "the filter finds it incredible"
            self.notes.append(("REGISTRATION_REFUSED", f"{why} ({found.moved_m:.3f} m, {found.moved_rad:.4f} rad)"))
        entry = Entry(seen.cloud_base, localisation.anchor(taken), self.stop, seen.dark_base_m)
        if told := self.seeing.note(seen.lost, localisation.pose):
            self.notes.append(("SIGHT", told))
        self._enter(ctx, entry)

    def _enter(self, ctx: Context, entry: Entry) -> None:
        """Submit an entry for the map; at the second look of the first stop, enter the earlier looks again.

        By then the turn has given the accelerometer's bias, so the level of the first look is known to a milliradian.
        Without the second entry the map would have a fold between its halves, and later scans would not fit.
        """
        if self._sweep is not None:
            self.swept, self._sweep = SweepInMap(self._sweep, entry.pose, entry.stop), None
        localisation = ctx.localisation
        memory, looks = self._first or (self.memory, ())
        before = [replace(look, pose=localisation.known_now(look.pose, bias)) for look, bias in looks]
        looks = (*looks, (entry, localisation.force_bias_mps2))
        self._first = (memory, looks) if self._behind_wanted else None
        arguments = (memory, [*before, entry], self.seeing.config)
        ctx.jobs.submit("remember", arguments, ctx.tick + self._config.jobs.map_ticks)

    def _plan(self, ctx: Context) -> None:
        assert self.memory
        request = plan_request(
            self.memory,
            ctx.localisation.pose,
            self.goal,
            self.gdem,
            self.seeing.config,
            ctx.fences,
            state=self._rule,
            trail=self._way.trail,
            sigma_m=ctx.localisation.sigma[0],
        )
        ctx.jobs.submit("plan", (request,), ctx.tick + self._config.jobs.plan_ticks)
        if not self._foreseen:
            self._foresee(ctx, True)
        self.phase = Phase.PLANNING

    def _planning(self, ctx: Context) -> Twist:
        if "plan" not in ctx.taken:
            return Twist()
        self.result = self.seeing.judged(ctx.taken["plan"], ctx.localisation.pose)
        self._rule_before, self._rule, decision = self._rule, self.result.state, self.result.decision
        self.gdem = self.result.gdem
        self.notes.append(("DECISION", f"{decision.rule} {decision.kind}: {decision.reason}"))
        self.stop += 1
        if decision.kind == "arrived":
            self._arrive(decision.reason)
        elif decision.kind == "unreachable":
            self._end(Phase.FAILED, False, decision.reason)
        else:
            self._set_out(ctx, decision.path)
        return Twist()

    def _set_out(self, ctx: Context, path: Path) -> None:
        assert self.memory
        self.phase, self._driven = Phase.DRIVING, False
        if self._config.drive_guard.on and path.length_m > 0.0:
            self._guard = Guarding(self._config)
            self._guard.begin(ctx, self.memory, (path.stations, self._way.trail))

    def _driving(self, ctx: Context) -> Twist:
        assert self.decision
        if not self._driven:
            if not self._watched(ctx) or ctx.held:
                return Twist()
            twist = self._follower.twist(self.decision.path, ctx.localisation.pose, ctx.now_ns, ctx.wheels)
            self._driven = self._follower.done
            return twist
        if not self._credited(ctx):
            return Twist()
        pose = ctx.localisation.pose
        if self.decision.kind == "drive":
            self._turn_to(self.decision.heading_rad)
        elif self._at_goal(pose) and self._way.since_look_m <= _TRUST_ODOMETRY_M:
            self._arrive(f"{dist(self.goal, (pose.x_m, pose.y_m)):.2f} m from the goal")
        else:
            self._scan()
        return Twist()

    def _watched(self, ctx: Context) -> bool:
        """Return whether the leg may be driven: it is watched, or needs no watch, and the guard has found nothing."""
        if self._guard is None:
            return True
        known = self.hazards
        watching = self._guard.step(ctx)
        if self.hazards and not known:
            first = self.hazards[0]
            self.notes.append(("HAZARD", f"{first.why} at {first.x_m:.2f} {first.y_m:.2f}"))
        if self._guard.blind_ns > _BLIND_NS:
            self._end(Phase.FAILED, False, f"blind for {_BLIND_NS // 10**9} s: no lines, or the scanner is not held")
        return watching and not self.hazards

    def _credited(self, ctx: Context) -> bool:
        """Return whether the guard's findings on the leg are in the map; they are entered while the rover stands."""
        assert self.memory
        if self._guard is not None and (kept := self._guard.close(ctx, self.memory)):
            self.memory, self._guard = kept, None
        return self._guard is None

    def _at_goal(self, pose: Pose) -> bool:
        return dist(self.goal, (pose.x_m, pose.y_m)) <= self._config.mission.goal_tolerance_m

    def _turn_to(self, yaw_rad: float) -> None:
        self._turn_to_rad, self.phase = yaw_rad, Phase.TURNING

    def _turning(self, ctx: Context) -> Twist:
        if ctx.held:
            return Twist()
        twist = self._follower.turn(self._turn_to_rad, ctx.localisation.pose, ctx.wheels)
        if self._follower.done:
            self._scan()
        return twist

    def _backing_off(self, ctx: Context) -> Twist:
        if self._retreat is None and abs(ctx.localisation.estimate.speed_mps) > _STANDING_MPS:
            self._watched(ctx)
            return Twist()
        if not self._credited(ctx) or ctx.held:
            return Twist()
        self._retreat = self._retreat or self._way.back(self._retreat_m)
        twist = self._follower.twist(self._retreat, ctx.localisation.pose, ctx.now_ns, ctx.wheels)
        if self._follower.done:
            self._scan()
        return twist
