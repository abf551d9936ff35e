"""Response time to a fault, and the steps taken of those that its row of the fault table promises.

    first bad sample        row is active          outputs hold STOP, REPORT ...        phase SCANNING ...
    ------|---------------------|--------------------------|-----------------------------------|----------->
      since_s               raised_s                   answered_s                       the steps that take time
          |<------------- at most detect_s of the row ---->|

The time of the first bad sample comes from evidence.VIOLATES, else it is the first difference that the injection makes
against the run without it. For a row in COUNTS_WHEN it is the first tick after that in a state that shows the fault.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest

from hil.records import PlantState
from hil.run.evidence import AT_ONCE, COUNTS_WHEN, SHOWS, VIOLATES, Sight
from hil.run.in_process import Rover
from hil.scenarios.verdicts import FaultResponse, row_of
from onboard.records import Inputs, Outputs
from protocol.conventions import TICK_NS
from protocol.tables.faults import BY_NAME, ResponseStep


class Spans:
    """Intervals of ticks during which a condition was true."""

    def __init__(self) -> None:
        self._changes: list[int] = []  # it began, ended, began, ...

    def note(self, tick: int, holds: bool) -> None:
        """Record the condition at this tick; call for each tick in turn."""
        if holds != bool(len(self._changes) % 2):
            self._changes.append(tick)

    def began(self, since: int) -> int | None:
        """First tick, from `since` on, at which the condition became true; None if it did not."""
        return next((begin for begin in self._changes[::2] if begin >= since), None)

    def held(self, since: int) -> int | None:
        """First tick, from `since` on, at which the condition was true; None if it was not."""
        for begin, end in zip_longest(self._changes[::2], self._changes[1::2]):
            if end is None or end > since:
                return max(begin, since)
        return None


class Watcher:
    """Monitor of rows of the fault table through a run: call `observe` each tick, then `answers`."""

    def __init__(self, rows: Sequence[str]) -> None:
        self._rows = tuple(rows)
        self._sight = Sight()
        self._since: dict[str, int] = {}
        self._active = {row: Spans() for row in rows}
        self._told = {row: Spans() for row in rows}
        self._states = {row: Spans() for row in rows if row in COUNTS_WHEN}
        self._steps = {step: Spans() for row in rows for step in BY_NAME[row].response if step in SHOWS}

    def observe(self, tick: int, inputs: Inputs, outputs: Outputs, rover: Rover, state: PlantState) -> None:
        """Evaluate one tick: inputs and outputs of the flight program, and the true state."""
        if not self._rows:
            return
        sight = self._sight
        sight.update(inputs, outputs, rover, state)
        told = {row_of(event) for event in outputs.events if event.name == "FAULT"}
        for row in self._rows:
            self._active[row].note(tick, row in rover.executive.active)
            self._told[row].note(tick, row in told)
            if row in VIOLATES and row not in self._since:
                violated_ns = VIOLATES[row](sight)
                if violated_ns is not None:
                    self._since[row] = -(-violated_ns // TICK_NS)
        for row, spans in self._states.items():
            spans.note(tick, COUNTS_WHEN[row](sight))
        for step, spans in self._steps.items():
            spans.note(tick, SHOWS[step](sight))

    def answers(self, traced_s: float) -> tuple[FaultResponse, ...]:
        """Answer for each row.

        traced_s: time of the first difference that the injection makes; below 0 if there is none.
        """
        traced = round(traced_s * 1e9 / TICK_NS) if traced_s >= 0.0 else None
        return tuple(self._answer(row, self._began(row, traced)) for row in self._rows)

    def _began(self, row: str, traced: int | None) -> int | None:
        """Tick of the first bad sample; None if there was none."""
        if row in VIOLATES:
            return self._since.get(row)
        return self._states[row].held(traced) if traced is not None and row in self._states else traced

    def _answer(self, row: str, since: int | None) -> FaultResponse:
        response = tuple(step for step in BY_NAME[row].response if step is not ResponseStep.SAFE_OVER_LIMIT)
        raised = None if since is None else self._active[row].began(since)
        if since is None or raised is None:
            return FaultResponse(row, _seconds(since), -1.0, -1.0, response)
        taken = {
            step: (self._told[row] if step is ResponseStep.REPORT else self._steps[step]).held(raised)
            for step in response
        }
        missing = tuple(step for step, tick in taken.items() if tick is None)
        at_once = [tick for step, tick in taken.items() if tick is not None and step in AT_ONCE]
        return FaultResponse(row, _seconds(since), _seconds(raised), _seconds(max([raised, *at_once])), missing)


def _seconds(tick: int | None) -> float:
    return -1.0 if tick is None else tick * TICK_NS / 1e9
