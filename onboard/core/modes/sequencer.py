"""Sequences: uploaded steps that run one after the other in the mode SEQUENCE; they can be checked without running.

A step waits its time from the completion of the one before, then for its condition. Then its command is carried out as
an order of the rover's own (station 0). A failure has the effect that the step names. Sequences end with the program.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from onboard.core.context import Context
from onboard.core.downlink import Downlink
from onboard.planning.fences import Point, goal_refused
from protocol.link.transactions import Order, RequestState
from protocol.tables.commands import RefusedError, named
from protocol.tables.modes import Mode
from protocol.tables.sequences import MOST_STEPS, SequenceStep, parse

_MOST = 8
Change = Callable[[str, Context, str], None]


@dataclass(slots=True)
class _Run:
    """A sequence that runs.

    request_id: request of `sequence_run`.
    steps: in order.
    at: index of the present step.
    since_ns: start of the present step's wait.
    order_id: order under way; 0: none.
    """

    request_id: int
    steps: tuple[SequenceStep, ...]
    at: int = 0
    since_ns: int = 0
    order_id: int = 0

    @property
    def step(self) -> SequenceStep:
        return self.steps[self.at]


class Sequencer:
    """Runs sequences; `step` returns each tick's order, if any. change: called with each event of the mode table."""

    def __init__(self, downlink: Downlink, change: Change) -> None:
        self._downlink, self._change = downlink, change
        self._kept: dict[str, dict[int, SequenceStep]] = {}
        self._run: _Run | None = None
        self._orders_given = 0
        self.orders = {
            "sequence_upload": self._upload,
            "sequence_clear": self._clear,
            "sequence_check": self._check,
            "sequence_run": self._start,
            "sequence_abort": self._abort,
        }

    def step(self, ctx: Context, mode: Mode) -> Order | None:
        """Process one tick. A change of the mode ends the sequence."""
        run = self._run
        if run is None:
            return None
        if mode is not Mode.SEQUENCE:
            self._end(RequestState.CANCELLED, f"ended at step {run.at + 1}: the mode is {mode.name}")
            return None
        if run.order_id:
            self._follow(run, ctx)
        elif self._ready(run, ctx):
            if run.step.name:
                self._orders_given += 1
                run.order_id = self._orders_given
                return Order(run.order_id, run.step.name, run.step.arguments, 0)
            self._settle(run, ctx, True, "waited")
        return None

    def _ready(self, run: _Run, ctx: Context) -> bool:
        """Return whether the step's time and condition have come; a condition that comes too late fails the step."""
        waited_ns = ctx.now_ns - run.since_ns - round(run.step.after_s * 1e9)
        condition = run.step.condition
        if waited_ns < 0 or condition is None or condition.holds(ctx.item(condition.item)):
            return waited_ns >= 0
        if waited_ns >= condition.within_s * 1e9:
            text = f"{condition.item} is {ctx.item(condition.item):g}, not {condition.compare} {condition.value:g}"
            self._settle(run, ctx, False, text)
        return False

    def _follow(self, run: _Run, ctx: Context) -> None:
        state, text = self._downlink.own.get(run.order_id, (RequestState.ACCEPTED, ""))
        if state.final:
            del self._downlink.own[run.order_id]
            run.order_id = 0
            self._settle(run, ctx, state is RequestState.COMPLETED, text)

    def _settle(self, run: _Run, ctx: Context, completed: bool, text: str) -> None:
        """Finish a step: go to the next one, or end the sequence."""
        told = f"step {run.at + 1} of {len(run.steps)} {'completed' if completed else 'failed'}: {text}"
        run.since_ns = ctx.now_ns
        if not completed and run.step.policy != "continue":
            safe = run.step.policy == "safe"
            self._end(RequestState.FAILED, told)
            self._change("fault" if safe else "ended", ctx, told)
        elif run.at + 1 == len(run.steps):
            self._end(RequestState.COMPLETED, told)
            self._change("ended", ctx, told)
        else:
            run.at += 1
            self._downlink.report(run.request_id, RequestState.PROGRESS, told)

    def _end(self, state: RequestState, text: str) -> None:
        assert self._run
        self._downlink.report(self._run.request_id, state, text)
        self._run = None
        self._downlink.own.clear()

    # -- orders ------------------------------------------------------------------------------------------------

    def _upload(self, order: Order, ctx: Context) -> None:
        name, number = str(order.arguments["sequence"]), order.number("number")
        try:
            step = parse(str(order.arguments["line"]))
            if number != int(number):
                raise ValueError(f"`number` = {number:g} should be whole")
            if name not in self._kept and len(self._kept) == _MOST:
                raise ValueError(f"{_MOST} sequences are there already: clear one first")
        except ValueError as error:
            raise RefusedError(str(error)) from error
        self._kept.setdefault(name, {})[int(number)] = step
        self._downlink.report(order.request_id, RequestState.COMPLETED, f"{name}: {len(self._kept[name])} steps")

    def _clear(self, order: Order, ctx: Context) -> None:
        self._steps(order)
        del self._kept[str(order.arguments["sequence"])]
        self._downlink.report(order.request_id, RequestState.COMPLETED)

    def _check(self, order: Order, ctx: Context) -> None:
        """Dry run: report the effect of each step, or the reason why it would be refused."""
        steps = self._steps(order)
        lines = [f"{n}: {_would(steps[n], ctx) if n in steps else 'is missing'}" for n in _span(steps)]
        object_id = self._downlink.offer("sequence", "\n".join(lines).encode(), "text")
        state, text = RequestState.COMPLETED, f"{len(steps)} steps"
        if _missing(steps):
            state, text = RequestState.FAILED, f"steps are missing: {_missing(steps)}"
        self._downlink.report(order.request_id, state, text, (object_id,))

    def _start(self, order: Order, ctx: Context) -> None:
        steps = self._steps(order)
        if _missing(steps):
            raise RefusedError(f"steps are missing: {_missing(steps)}")
        self._run = _Run(order.request_id, tuple(steps[n] for n in sorted(steps)), since_ns=ctx.now_ns)
        self._change("sequence_run", ctx, str(order.arguments["sequence"]))
        self._downlink.report(order.request_id, RequestState.STARTED, f"{len(steps)} steps")

    def _abort(self, order: Order, ctx: Context) -> None:
        self._change("sequence_abort", ctx, f"station {order.station}")
        self._downlink.report(order.request_id, RequestState.COMPLETED, "what it did is stopped")

    def _steps(self, order: Order) -> dict[int, SequenceStep]:
        return self._kept[named(str(order.arguments["sequence"]), self._kept, "sequence")]

    def digest_items(self) -> tuple[int, ...]:
        """Values of this state that go into the state digest."""
        run = self._run
        return (len(self._kept), self._orders_given, *((run.at, run.order_id) if run else ()))


def _span(steps: dict[int, SequenceStep]) -> range:
    assert max(steps) <= MOST_STEPS
    return range(1, max(steps) + 1)


def _missing(steps: dict[int, SequenceStep]) -> str:
    return ", ".join(str(n) for n in _span(steps) if n not in steps)


def _would(step: SequenceStep, ctx: Context) -> str:
    """Return the step as it is understood, and the reason why it would be refused now."""
    wait = [f"after {step.after_s:g} s"] if step.after_s else []
    if step.condition is not None:
        wait.append("once {} {} {:g}, within {:g} s".format(*step.condition))
    does = [step.name, *(f"{name} {value}" for name, value in step.arguments.items())] if step.name else ["only waits"]
    order = Order(0, step.name, step.arguments, 0)
    goals: tuple[Point, ...] = order.points("goals_m") if step.name == "mission" else ()
    if step.name == "goto":
        goals = ((order.number("x_m"), order.number("y_m")),)
    refused = [f"refused now: {why}" for why in (goal_refused(ctx.fences, goal) for goal in goals) if why]
    return "; ".join([*wait, " ".join(does), f"if it fails: {step.policy}", *refused])
