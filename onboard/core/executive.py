"""The modes: who may do what, which faults stop the rover, and the one mission that runs.

Orders come checked from the downlink; faults from the monitors; both only ever change the mode by `protocol.modes`.
A little over 300 lines: one short method for each order, and the answer to faults, which share the mission they end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from onboard.config import Config
from onboard.core.context import Context
from onboard.core.downlink import Downlink
from onboard.core.jobs import GIVE_UP_TICKS
from onboard.core.mission import MISSION_JOBS, MOVING, Mission
from onboard.core.monitors import over_limit, words
from onboard.motion.wheel_health import Drive, Wheels
from onboard.planning.plan_records import PlanResult
from onboard.records import Event, Gdem, Twist
from protocol.can_codec import StopReason
from protocol.commands import check_mode
from protocol.faults import BY_NAME, Fault, Step
from protocol.modes import EVENTS, Mode, Phase, next_mode
from protocol.products import LDEM_CODEC, LdemProduct, MapGrid
from protocol.transactions import Order, State

if TYPE_CHECKING:
    from onboard.perception.stop_map import StopMap

PRODUCT_TICKS = 50
SLOW_RATIO = 0.5
SEVERITY = {row.name: row.severity for row in EVENTS}


class Executive:
    """Owns mode, mission and the maps that outlive it; `memory` is None until the first stop unless one was kept."""

    def __init__(
        self, config: Config, gdem: Gdem | None, downlink: Downlink, memory: StopMap | None = None
    ) -> None:
        self._config, self._gdem, self._downlink = config, gdem, downlink
        self.mode = next_mode(Mode.BOOT, "booted") or Mode.BOOT
        self.mission: Mission | None = None
        self.events: list[Event] = []
        self.active: tuple[str, ...] = ()
        self._of: Mapping[str, tuple[int, ...]] = {}
        self.memory = memory
        self._goto_id: int | None = None
        self._latest: PlanResult | None = None
        self._get_id = 0
        self._reset_id: int | None = None
        self._standby_after_leg = False
        self._orders: Mapping[str, Callable[[Order, Context], None]] = {
            "goto": self._goto,
            "stop": self._stop,
            "safe": self._safe,
            "resume": self._resume,
            "status": self._status,
            "get": self._get,
            "emergency_stop": self._emergency_stop,
            "reset": self._reset,
        }

    @property
    def phase(self) -> Phase:
        """Phase of the mission, the ended one included."""
        return self.mission.phase if self.mission else Phase.NONE

    @property
    def in_mission(self) -> bool:
        """Whether a mission runs."""
        return self.mission is not None and self.mission.outcome is None

    @property
    def hazard(self) -> bool:
        """Whether the drive guard has stopped the rover and what it saw is not in the map yet."""
        return self.mission is not None and bool(self.mission.hazards)

    def step(self, orders: Sequence[Order], faults: tuple[str, ...], ctx: Context) -> Twist:
        """One tick: obeys orders, answers faults, advances the mission. Returns the twist that is wanted."""
        for order in orders:
            self._obey(order, ctx)
        was = self.phase
        self._answer(faults, ctx)
        self._give_up(ctx)
        self._follow_reset(ctx)
        if "product" in ctx.taken:
            self._offer(ctx.taken["product"])
        if self.mode is not Mode.AUTONOMOUS or self.mission is None:
            return Twist()
        ctx.held = any(Step.STOP in BY_NAME[name].response for name in self.active)
        slow = SLOW_RATIO if any(Step.SLOW in BY_NAME[name].response for name in self.active) else 1.0
        twist = self.mission.step(ctx)
        self._follow_up(was, ctx)
        return Twist() if ctx.held else Twist(*(slow * v for v in twist))

    def _follow_up(self, was: Phase, ctx: Context) -> None:
        mission = self.mission
        assert mission
        if mission.phase is not was:
            self._tell(ctx, "PHASE", f"{mission.phase.name} at stop {mission.stop}")
        for name, text in mission.notes:
            self._tell(ctx, name, text)
        mission.notes.clear()
        self.memory, self._gdem, self._latest = mission.memory, mission.gdem, mission.result or self._latest
        if mission.outcome:
            ctx.lidar.stream(False)
            state = State.COMPLETED if mission.outcome.completed else State.FAILED
            self._finish(state, mission.outcome.reason)
            event = "arrived" if mission.outcome.completed else "failed"
            self._tell(ctx, event.upper(), mission.outcome.reason)
            self._change(event, ctx, mission.outcome.reason)
        elif self._standby_after_leg and mission.phase not in MOVING:
            self._standby_after_leg = False
            self._cancel(ctx, State.FAILED, "no authenticated contact: leg finished, standing by")
            self._change("link_lost", ctx, "no authenticated contact")

    def _answer(self, faults: tuple[str, ...], ctx: Context) -> None:
        over = over_limit(ctx.nodes, faults)
        if ctx.nodes.bus.news:
            self._tell(ctx, "CAN", ctx.nodes.bus.news)
        for name in faults:
            row, of = BY_NAME[name], ctx.found.get(name, ())
            new = name not in self.active or of != self._of.get(name, of)
            text = words(ctx.nodes, name) + _whose(of)
            if new and Step.REPORT in row.response:
                self._tell(ctx, "FAULT", text)
            if Step.ESTOP in row.response and self.mode is not Mode.ESTOP:
                self._cancel(ctx, State.FAILED, text)
                self._change("emergency_stop", ctx, name)
            elif (self._latches(row, ctx) or name in over) and self.mode not in (Mode.SAFE, Mode.ESTOP):
                self._cancel(ctx, State.FAILED, text)
                self._change("fault", ctx, name)
            elif Step.LOOK in row.response or new:
                self._break_off(row, ctx)
        for name in self.active:
            if name not in faults and Step.REPORT in BY_NAME[name].response:
                self._tell(ctx, "FAULT_CLEARED", name)
            if name not in faults and Step.STANDBY in BY_NAME[name].response:
                self._standby_after_leg = False
        self.active, self._of = faults, dict(ctx.found)

    def _give_up(self, ctx: Context) -> None:
        """The end of waiting for long work: a hung job holds the only thread, so nothing after it would come either."""
        for name in ctx.jobs.give_up(ctx.tick):
            reason = f"{name}: no result {GIVE_UP_TICKS // 100} s after its tick"
            if name == "product":
                self._downlink.report(self._get_id, State.FAILED, reason)
            self._cancel(ctx, State.FAILED, reason)
            self._change("fault", ctx, reason)

    def _latches(self, row: Fault, ctx: Context) -> bool:
        if Step.DEGRADE in row.response:
            return not (self._config.safety.degraded_drive and _can_go_on(ctx.wheels))
        return Step.SAFE in row.response

    def _break_off(self, row: Fault, ctx: Context) -> None:
        """What a fault's response does to the way being driven, each kind at most so often."""
        if Step.STANDBY in row.response:
            self._standby_after_leg = True
        if self.mission is None or not self.in_mission:
            return
        reason = ""
        if Step.LOOK in row.response and not self.mission.look_again():
            reason = f"{row.name}: {row.condition}, and a look did not help"
        elif Step.BACK_OFF in row.response and self.mission.back_off(row.name) > row.tries:
            reason = f"{row.name}: backed off {row.tries} times in this mission already"
        elif Step.RESCAN in row.response:
            self.mission.back_off(row.name, 0.0)
        if reason:
            self._cancel(ctx, State.FAILED, reason)
            self._change("fault", ctx, reason)

    # -- orders ------------------------------------------------------------------------------------------------

    def _obey(self, order: Order, ctx: Context) -> None:
        try:
            check_mode(order.name, self.mode)  # an order of the same tick may have changed it
        except ValueError as error:
            self._downlink.report(order.request_id, State.FAILED, str(error))
            return
        self._orders[order.name](order, ctx)

    def _goto(self, order: Order, ctx: Context) -> None:
        goal = (float(order.arguments["x_m"]), float(order.arguments["y_m"]))
        beyond = _beyond(self._gdem, goal)
        if beyond:
            self._downlink.report(order.request_id, State.FAILED, beyond)
            return
        self._cancel(ctx, State.CANCELLED, "another goto came")
        self.mission, self._goto_id = Mission(self._config, self._gdem, goal, self.memory), order.request_id
        self._standby_after_leg = False
        self._change("goto", ctx, f"goal {goal[0]:.2f} {goal[1]:.2f}")
        self._downlink.report(order.request_id, State.STARTED, f"to {goal[0]:.2f}, {goal[1]:.2f}")

    def _stop(self, order: Order, ctx: Context) -> None:
        self._cancel(ctx, State.CANCELLED, "stopped by the operator")
        self._change("stop", ctx, "operator")
        self._downlink.report(order.request_id, State.COMPLETED, "stopped")

    def _safe(self, order: Order, ctx: Context) -> None:
        self._cancel(ctx, State.CANCELLED, "SAFE by the operator")
        self._change("safe", ctx, "operator")
        self._downlink.report(order.request_id, State.COMPLETED, self.mode.name)

    def _resume(self, order: Order, ctx: Context) -> None:
        over = over_limit(ctx.nodes, self.active)
        latched = [name for name in self.active if self._latches(BY_NAME[name], ctx) or name in over]
        if latched:
            self._downlink.report(order.request_id, State.FAILED, f"still active: {', '.join(latched)}")
            return
        self._change("resume", ctx, "operator")
        self._downlink.report(order.request_id, State.COMPLETED, self.mode.name)

    def _status(self, order: Order, ctx: Context) -> None:
        pose = ctx.localisation.pose
        text = f"{self.mode.name} {self.phase.name} at {pose.x_m:.2f} {pose.y_m:.2f}"
        if self.active:
            text += " faults " + " ".join(self.active)
        self._downlink.report(order.request_id, State.COMPLETED, text)

    def _get(self, order: Order, ctx: Context) -> None:
        result = self._latest
        if result is None:
            self._downlink.report(order.request_id, State.FAILED, "no map yet: it comes after the first scan of a goto")
        elif "product" in ctx.jobs.running:
            self._downlink.report(order.request_id, State.FAILED, "one is being packed already: ask again")
        else:
            report, at = result.report, result.report.grid
            grid = MapGrid(at.x0_m, at.y0_m, at.cell_m, at.rows, at.columns)
            arguments = (LdemProduct(grid, report.z_mean, report.node_sets),)
            ctx.jobs.submit("product", arguments, ctx.tick + PRODUCT_TICKS)
            self._get_id = order.request_id
            self._downlink.report(order.request_id, State.STARTED, "packing the LDEM")

    def _offer(self, product: bytes) -> None:
        self._downlink.offer("ldem", product, LDEM_CODEC)
        self._downlink.report(self._get_id, State.COMPLETED, f"ldem of {len(product)} bytes on its way")

    def _emergency_stop(self, order: Order, ctx: Context) -> None:
        ctx.nodes.emergency_stop(StopReason.OPERATOR)
        self._cancel(ctx, State.CANCELLED, "emergency stop by the operator")
        self._change("emergency_stop", ctx, "operator")
        self._downlink.report(order.request_id, State.COMPLETED, "ESTOP")

    def _reset(self, order: Order, ctx: Context) -> None:
        ctx.nodes.reset(order.request_id & 0xFFFF)
        self._reset_id = order.request_id
        self._downlink.report(order.request_id, State.STARTED, "every node is asked twice")

    def _follow_reset(self, ctx: Context) -> None:
        if self._reset_id is None or ctx.nodes.resetting:
            return
        if ctx.nodes.emergency is None:
            self._change("reset", ctx, "operator")
            self._downlink.report(self._reset_id, State.COMPLETED, self.mode.name)
        else:
            sender, reason, _ = ctx.nodes.emergency
            text = f"not every node answered; stopped by {sender}, {StopReason(reason).name}"
            self._downlink.report(self._reset_id, State.FAILED, text)
        self._reset_id = None

    # -- small things ------------------------------------------------------------------------------------------

    def _cancel(self, ctx: Context, state: State, reason: str) -> None:
        if self.in_mission:
            self._finish(state, reason)
            self.mission = None
            ctx.jobs.forget(MISSION_JOBS)
            ctx.lidar.stream(False)
            if ctx.nodes.tilt_angle_rad is not None:
                ctx.nodes.park_tilt(ctx.nodes.tilt_angle_rad)

    def _finish(self, state: State, reason: str) -> None:
        if self._goto_id is not None:
            self._downlink.report(self._goto_id, state, reason)
            self._goto_id = None

    def _change(self, event: str, ctx: Context, why: str) -> None:
        new = next_mode(self.mode, event)
        if new is not None and new is not self.mode:
            self._tell(ctx, "MODE", f"{self.mode.name} -> {new.name}: {why}")
            self.mode = new

    def _tell(self, ctx: Context, name: str, text: str) -> None:
        self.events.append(Event(ctx.now_ns, SEVERITY[name], name, text))


def _can_go_on(wheels: Wheels) -> bool:
    """Whether at most one wheel is broken, and two or more still tell the way."""
    broken = sum(h.drive is not Drive.GOOD or h.steer_fixed_rad is not None for h in wheels)
    return broken <= 1 and sum(h.tells_way for h in wheels) >= 2


def _whose(wheels: tuple[int, ...]) -> str:
    """Words for the wheels that a fault is of; '' where it is the rover's."""
    return f" (wheel {', '.join(map(str, wheels))})" if wheels else ""


def _beyond(gdem: Gdem | None, goal_m: tuple[float, float]) -> str:
    """Why a goal cannot be gone to for want of a map, or ''."""
    if gdem is None or gdem.grid.contains(*gdem.grid.cell(*goal_m)):
        return ""
    grid = gdem.grid
    (west, south), half = grid.centre(0, 0), grid.cell_m / 2
    east, north = grid.centre(grid.rows - 1, grid.columns - 1)
    return (
        f"({goal_m[0]:.1f}, {goal_m[1]:.1f}) is outside the orbiter's map: "
        f"x {west - half:.0f} to {east + half:.0f}, y {south - half:.0f} to {north + half:.0f} m"
    )
