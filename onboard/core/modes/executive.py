"""Executive: the modes, the orders allowed in each, and the responses to faults.

Orders arrive checked from the downlink, faults from the monitors; both change the mode only through
`protocol.tables.modes`. `tasks` moves the rover. Orders that change no mode are handled by families, in files of this
folder: `masks`, `service_orders`, `product_orders`, `parameter_orders`, `fence_orders`, `link_orders`. `lease` decides
which station may command. `sequencer` gives orders of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from onboard.core.context import Context
from onboard.core.downlink import Downlink
from onboard.core.faults.monitors import over_limit, words
from onboard.core.jobs import GIVE_UP_TICKS
from onboard.core.mission.mission import Mission
from onboard.core.modes.fence_orders import FenceOrders
from onboard.core.modes.lease import Lease
from onboard.core.modes.link_orders import LinkOrders
from onboard.core.modes.masks import Masks
from onboard.core.modes.parameter_orders import ParameterOrders
from onboard.core.modes.product_orders import PRODUCT_JOBS, Products
from onboard.core.modes.sequencer import Sequencer
from onboard.core.modes.service_orders import Services
from onboard.core.modes.tasks import Tasks
from onboard.devices.emergency import reason_name
from onboard.motion.wheel_health import DriveHealth, Wheels
from onboard.records import Event, Gdem, Twist
from protocol.generated.can_codec import StopReason
from protocol.link.transactions import Order, RequestState
from protocol.tables.commands import RefusedError, check_mode
from protocol.tables.faults import BY_NAME, Fault, ResponseStep
from protocol.tables.modes import EVENTS, Mode, Phase, next_mode

if TYPE_CHECKING:
    from onboard.perception.map.stop_map import StopMap

SLOW_RATIO = 0.5
ENDS_MOVE = frozenset(
    {ResponseStep.STOP, ResponseStep.BACK_OFF, ResponseStep.LOOK, ResponseStep.RESCAN, ResponseStep.STANDBY}
)
ENDS_WAITING = frozenset({"stop", "safe", "fault", "emergency_stop"})
SEVERITY = {row.name: row.severity for row in EVENTS}


class Executive:
    """Owner of the mode and the tasks; carries out the operator's orders."""

    def __init__(
        self,
        kept: tuple[ParameterOrders, FenceOrders, LinkOrders],
        gdem: Gdem | None,
        downlink: Downlink,
        memory: StopMap | None = None,
    ) -> None:
        parameters, fences, link = kept
        self._parameters, self._downlink = parameters, downlink
        self.mode = next_mode(Mode.BOOT, "booted") or Mode.BOOT
        self.events: list[Event] = []
        self.active: tuple[str, ...] = ()
        self._of: Mapping[str, tuple[int, ...]] = {}
        self._reset_id: int | None = None
        self.tasks = Tasks(parameters, (gdem, memory), downlink)
        self.tasks.change, self.tasks.tell = self._change, self._tell
        self.lease = Lease(parameters.config.link.lease_s, downlink)
        self.masks, self.services = Masks(downlink), Services(downlink)
        self.products = Products(downlink, self.tasks, parameters, lambda: self.active)
        self.sequencer = Sequencer(downlink, self._end_sequence)
        self._orders: Mapping[str, Callable[[Order, Context], None]] = {
            "stop": self._stop,
            "safe": self._safe,
            "resume": self._resume,
            "status": self._status,
            "emergency_stop": self._emergency_stop,
            "reset": self._reset,
            **self.tasks.orders,
            **self.masks.orders,
            **self.services.orders,
            **self.products.orders,
            **parameters.orders,
            **fences.orders,
            **self.sequencer.orders,
            **link.orders,
            **self.lease.orders,
        }
        self._families = (self.masks, self.services, parameters, fences, link, self.lease)

    @property
    def mission(self) -> Mission | None:
        """The mission that runs, or the last one that ended by itself."""
        return self.tasks.mission

    @property
    def memory(self) -> StopMap | None:
        """The rover's own map; None before the first."""
        return self.tasks.memory

    @property
    def phase(self) -> Phase:
        """Phase of the mission, also of one that has ended."""
        return self.mission.phase if self.mission else Phase.NONE

    @property
    def in_mission(self) -> bool:
        """True while a mission runs."""
        return self.tasks.in_mission

    @property
    def shedding(self) -> bool:
        """True while work that can wait is shed."""
        return self._any_active(ResponseStep.SHED)

    @property
    def hazard(self) -> bool:
        """True if the drive guard has stopped the rover and its findings are not in the map yet."""
        return self.mission is not None and bool(self.mission.hazards)

    def step(self, orders: Sequence[Order], faults: tuple[str, ...], ctx: Context) -> Twist:
        """Process one tick: obey orders, respond to faults, advance the task. Returns the body twist wanted."""
        ctx.held = self._any_active(ResponseStep.STOP)
        for order in orders:
            self._obey(order, ctx)
        self._answer(faults, ctx)
        self._give_up(ctx)
        self._follow_reset(ctx)
        own = self.sequencer.step(ctx, self.mode)
        if own is not None:
            self._orders[own.name](own, ctx)
        self.products.step(ctx)
        self.lease.step(ctx)
        for family in self._families:
            self.events += family.events
            family.events.clear()
        ctx.held = self._any_active(ResponseStep.STOP)
        slow = SLOW_RATIO if self._any_active(ResponseStep.SLOW) else 1.0
        twist = self.tasks.step(ctx)
        if ctx.held:
            return Twist()
        return twist if slow == 1.0 else Twist(*(slow * v for v in twist))

    def _any_active(self, step: ResponseStep) -> bool:
        return any(step in BY_NAME[name].response for name in self.active)

    # -- faults ------------------------------------------------------------------------------------------------

    def _answer(self, faults: tuple[str, ...], ctx: Context) -> None:
        """Raise each fault that is new, and execute its row's response; report the faults that have ended."""
        over = over_limit(ctx.nodes, ctx.used_up, faults)
        if ctx.nodes.bus.news:
            self._tell("CAN", ctx, ctx.nodes.bus.news)
        for name in faults:
            row, of = BY_NAME[name], ctx.found.get(name, ())
            new = name not in self.active or of != self._of.get(name, of)
            text = words(ctx.nodes, ctx.seen.get(name, ""), name) + _whose(of)
            if new and ResponseStep.REPORT in row.response:
                self._tell("FAULT", ctx, text)
            if ResponseStep.ESTOP in row.response and self.mode is not Mode.ESTOP:
                self.tasks.cancel(ctx, RequestState.FAILED, text)
                self._change("emergency_stop", ctx, name)
            elif (self._latches(row, ctx) or name in over) and self.mode not in (Mode.SAFE, Mode.ESTOP):
                self.tasks.cancel(ctx, RequestState.FAILED, text)
                self._change("fault", ctx, name)
            elif not {ResponseStep.LOOK, ResponseStep.DISCARD_SWEEP}.isdisjoint(row.response) or new:
                self._break_off(row, ctx)
        for name in self.active:
            if name not in faults and ResponseStep.REPORT in BY_NAME[name].response:
                self._tell("FAULT_CLEARED", ctx, name)
            if name not in faults and ResponseStep.STANDBY in BY_NAME[name].response:
                self.tasks.standby_after_leg = False
        self.active, self._of = faults, dict(ctx.found)

    def _give_up(self, ctx: Context) -> None:
        """End the wait for overdue jobs: a hung job holds the only worker thread, so no later job would run either."""
        for name in ctx.jobs.give_up(ctx.tick):
            reason = f"{name}: no result {GIVE_UP_TICKS // 100} s after its tick"
            if name in PRODUCT_JOBS:
                self.products.give_up(name, reason)
            self.tasks.cancel(ctx, RequestState.FAILED, reason)
            self._change("fault", ctx, reason)

    def _latches(self, row: Fault, ctx: Context) -> bool:
        if ResponseStep.DEGRADE in row.response:
            return not (self._parameters.config.safety.degraded_drive and _can_go_on(ctx.wheels))
        return ResponseStep.SAFE in row.response

    def _break_off(self, row: Fault, ctx: Context) -> None:
        """Apply a fault's response to the move or leg under way, within the response's limit of tries."""
        if ResponseStep.STANDBY in row.response:
            self.tasks.standby_after_leg = True
        if self.tasks.move is not None and ENDS_MOVE.intersection(row.response):
            self.tasks.cancel(ctx, RequestState.FAILED, f"{row.name}: {row.condition}")
            self._change("failed", ctx, row.name)
        if self.mission is None or not self.in_mission:
            return
        reason = ""
        if ResponseStep.DISCARD_SWEEP in row.response:
            self.mission.discard_sweep(f"{row.name}: {row.condition}")
        elif ResponseStep.LOOK in row.response and not self.mission.look_again():
            reason = f"{row.name}: {row.condition}, and a look did not help"
        elif ResponseStep.BACK_OFF in row.response and self.mission.back_off(row.name) > row.tries:
            reason = f"{row.name}: backed off {row.tries} times in this mission already"
        elif ResponseStep.RESCAN in row.response:
            self.mission.back_off(row.name, 0.0)
        if reason:
            self.tasks.cancel(ctx, RequestState.FAILED, reason)
            self._change("fault", ctx, reason)

    # -- orders ------------------------------------------------------------------------------------------------

    def _obey(self, order: Order, ctx: Context) -> None:
        try:
            check_mode(order.name, self.mode)  # an order of the same tick may have changed it
            self.lease.check(order, ctx)
            self._orders[order.name](order, ctx)
        except RefusedError as error:
            self._downlink.report(order.request_id, RequestState.FAILED, str(error))

    def _stop(self, order: Order, ctx: Context) -> None:
        self.tasks.cancel(ctx, RequestState.CANCELLED, "stopped by the operator")
        self._change("stop", ctx, "operator")
        self._downlink.report(order.request_id, RequestState.COMPLETED, "stopped")

    def _safe(self, order: Order, ctx: Context) -> None:
        self.tasks.cancel(ctx, RequestState.CANCELLED, "SAFE by the operator")
        self._change("safe", ctx, "operator")
        self._downlink.report(order.request_id, RequestState.COMPLETED, self.mode.name)

    def _resume(self, order: Order, ctx: Context) -> None:
        over = over_limit(ctx.nodes, ctx.used_up, self.active)
        latched = [name for name in self.active if self._latches(BY_NAME[name], ctx) or name in over]
        if latched:
            self._downlink.report(order.request_id, RequestState.FAILED, f"still active: {', '.join(latched)}")
            return
        self._change("resume", ctx, "operator")
        self._downlink.report(order.request_id, RequestState.COMPLETED, self.mode.name)

    def _status(self, order: Order, ctx: Context) -> None:
        pose = ctx.localisation.pose
        text = f"{self.mode.name} {self.phase.name} at {pose.x_m:.2f} {pose.y_m:.2f}"
        if self.active:
            text += " faults " + " ".join(self.active)
        waits = self._downlink.waits
        if waits:
            text += f"; {len(waits)} wait: {', '.join(waits)}"
        self._downlink.report(order.request_id, RequestState.COMPLETED, text)

    def _emergency_stop(self, order: Order, ctx: Context) -> None:
        ctx.nodes.emergency_stop(StopReason.OPERATOR)
        self.tasks.cancel(ctx, RequestState.CANCELLED, "emergency stop by the operator")
        self._change("emergency_stop", ctx, "operator")
        self._downlink.report(order.request_id, RequestState.COMPLETED, "ESTOP")

    def _reset(self, order: Order, ctx: Context) -> None:
        ctx.nodes.reset(order.request_id & 0xFFFF)
        self._reset_id = order.request_id
        self._downlink.report(order.request_id, RequestState.STARTED, "every node is asked twice")

    def _follow_reset(self, ctx: Context) -> None:
        if self._reset_id is None or ctx.nodes.resetting:
            return
        if ctx.nodes.emergency is None:
            self._change("reset", ctx, "operator")
            self._downlink.report(self._reset_id, RequestState.COMPLETED, self.mode.name)
        else:
            sender, reason, _ = ctx.nodes.emergency
            text = f"not every node answered; stopped by {sender}, {reason_name(reason)}"
            self._downlink.report(self._reset_id, RequestState.FAILED, text)
        self._reset_id = None

    # -- small things ------------------------------------------------------------------------------------------

    def _end_sequence(self, event: str, ctx: Context, why: str) -> None:
        self.tasks.cancel(ctx, RequestState.CANCELLED, why)
        self._change(event, ctx, why)

    def _change(self, event: str, ctx: Context, why: str) -> None:
        if event in ENDS_WAITING:
            self._downlink.cancel_waiting(f"{event}: {why}")
        new = next_mode(self.mode, event)
        if new is not None and new is not self.mode:
            self._tell("MODE", ctx, f"{self.mode.name} -> {new.name}: {why}")
            self.mode = new

    def _tell(self, name: str, ctx: Context, text: str) -> None:
        self.events.append(Event(ctx.now_ns, SEVERITY[name], name, text))


def _can_go_on(wheels: Wheels) -> bool:
    """Return whether at most one wheel has failed and two or more still give odometry."""
    broken = sum(h.drive is not DriveHealth.GOOD or h.steer_fixed_rad is not None for h in wheels)
    return broken <= 1 and sum(h.tells_way for h in wheels) >= 2


def _whose(wheels: tuple[int, ...]) -> str:
    """Words for the wheels that a fault concerns; '' if it concerns the rover."""
    return f" (wheel {', '.join(map(str, wheels))})" if wheels else ""
