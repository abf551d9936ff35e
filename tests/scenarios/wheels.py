"""Each wheel fault of the bench: its own row is named, of the right wheel, within its time, and no other before it.

A case is a seed: 10 * field + row of CASES, on the nominal campaign's kind of field. The fault begins 8 s into the
first drive; the flight ends 15 s after it was found, or 60 s later. Time counts from the first tick at which the truth
shows it (`_violates`): a weak wheel is sound while the ground asks for less than it has left. The thresholds were set
on fields 1 to 5; these are others.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from hil.in_memory import CAMPAIGN_STEP_NS, InMemory
from hil.plant import PlantAbortError
from hil.records import PlantState
from hil.scenario import Scenario
from hil.wheel_faults import WHEEL_FAULTS
from onboard.core.tick import Rover
from onboard.core.wheel_watch.watch import WHEEL_ROWS
from onboard.records import Event, Inputs, Outputs
from protocol.faults import BY_NAME

CASES = (
    ("wheel_stuck", "WHEEL_STUCK", 2), ("wheel_free", "WHEEL_FREE", 4), ("wheel_weak", "WHEEL_WEAK", 1),
    ("steer_stuck", "STEER_STUCK", 3), ("encoder_dead", "ENCODER_BAD", 3), ("encoder_frozen", "ENCODER_BAD", 2),
    ("encoder_jumping", "ENCODER_BAD", 1), ("pot_offset", "STEER_OFFSET", 4), ("soft_patch", "SLIP_HIGH", 0),
    ("no_grip", "NOT_MOVING", 0),
)  # fmt: skip
FIELDS = (21, 22, 23)
SEEDS = tuple(10 * field + case for field in FIELDS for case in range(len(CASES)))
SHORT = SEEDS[:9:3]
TICKS_PER_S, NS, NEVER = 100, 1_000_000_000, 1 << 60
AFTER_TICKS, WATCH_TICKS, ANSWER_TICKS = 800, 6000, 1500
WAYS_M = {"STEER_OFFSET": 5.0, "SLIP_HIGH": 1.0}  # rows whose time is a way
RADIUS_M, LEAST_MPS, TURNS_RADPS, OFF_RADPS, WORKS_NM = 0.1, 0.06, 0.15, 0.012, 0.2
STEER_RAD, ON_THE_SPOT_RAD = math.radians(3.0), 0.5
SLIPS, STANDS, SLIP_TICKS = 0.5, 0.8, 100  # shares of the wheels' speed that the body lacks, for a second


@dataclass(frozen=True, slots=True)
class Row:
    """One flight. took_s: from the first tick that shows the fault to the event, -1 without both.

    way_m: of the wheels in that time. shown: whether the truth shows the fault at all. others: rows named before it.
    answer: what the rover did first.
    """

    seed: int
    fault: str
    wheel: int
    took_s: float
    way_m: float
    shown: bool
    found: str
    others: tuple[str, ...]
    answer: str


class _Truth:
    """When the fault shows in truth, and the wheels' way from there until it is found."""

    def __init__(self, fault: str, row: str, wheel: int) -> None:
        self.violated_tick, self.way_m, self.begun = -1, 0.0, False
        self._fault, self._row, self._wheel = fault, row, wheel
        self._ticks = 0

    def observe(self, tick: int, _inputs: Inputs, _outputs: Outputs, rover: Rover, state: PlantState) -> None:
        """One tick of the flight."""
        if not self.begun:
            return
        if self.violated_tick < 0:
            self._ticks = self._ticks + 1 if self._violates(rover, state) else 0
            needed = SLIP_TICKS if self._wheel == 0 else 1
            if self._ticks >= needed:
                self.violated_tick = tick - needed + 1
        elif self._row not in rover.watch.faults:
            self.way_m += rover.localisation.step.rolled_m

    def _violates(self, rover: Rover, state: PlantState) -> bool:
        if self._wheel == 0:
            return self._slips(state)
        order, wheel = rover.orders[self._wheel - 1], state.wheels[self._wheel - 1]
        turns = abs(order.rate_radps) > TURNS_RADPS
        if self._fault == "steer_stuck":
            return abs(order.steer_rad - wheel.steer_rad) > STEER_RAD
        if self._fault in ("wheel_free", "wheel_weak"):
            works = sum(abs(w.torque_nm) for w in state.wheels) > WORKS_NM
            return turns and works and abs(wheel.rate_radps - order.rate_radps) > OFF_RADPS
        return turns

    def _slips(self, state: PlantState) -> bool:
        rim_mps = RADIUS_M * sum(abs(w.rate_radps) for w in state.wheels) / 4
        angles = [w.steer_rad for w in state.wheels]
        along = max(angles) - min(angles) < ON_THE_SPOT_RAD
        slips = STANDS if self._fault == "no_grip" else SLIPS
        return along and rim_mps > LEAST_MPS and math.hypot(*state.velocity_mps[:2]) < (1.0 - slips) * rim_mps


def fly(seed: int) -> Row:
    """The flight of one case on one field."""
    fault, row, wheel = CASES[seed % len(CASES)]
    bench = InMemory(Scenario(name=fault, terrain="fbm", seed=seed // len(CASES)), step_ns=CAMPAIGN_STEP_NS)
    truth = _Truth(fault, row, wheel)
    begin_tick = end_tick = NEVER
    try:
        while not bench.ended and bench.tick < end_tick:
            bench.step(truth.observe)
            if bench.progress.driving and begin_tick == NEVER:
                begin_tick = bench.tick + AFTER_TICKS
            if bench.tick == begin_tick:
                WHEEL_FAULTS[fault].begin(bench, wheel)
                truth.begun, end_tick = True, bench.tick + WATCH_TICKS
            if any(event.text.startswith(row) for event in _named(bench)):
                end_tick = min(end_tick, bench.tick + ANSWER_TICKS)
    except PlantAbortError:
        pass  # the row says what was found until then
    finally:
        bench.free()
    return _row(seed, bench, truth)


def _named(bench: InMemory) -> list[Event]:
    """The rows of this subject that were named so far."""
    return [e for e in bench.events if e.name == "FAULT" and e.text.startswith(WHEEL_ROWS)]


def _row(seed: int, bench: InMemory, truth: _Truth) -> Row:
    fault, row, wheel = CASES[seed % len(CASES)]
    named = _named(bench)
    at = next((k for k, event in enumerate(named) if event.text.startswith(row)), len(named))
    found = named[at] if at < len(named) else None
    after = [e.text for e in bench.events if found and e.now_ns >= found.now_ns and e.name in ("MODE", "PHASE")]
    shown = truth.violated_tick >= 0
    return Row(
        seed=seed, fault=fault, wheel=wheel,
        took_s=round(found.now_ns / NS - truth.violated_tick / TICKS_PER_S, 2) if found and shown else -1.0,
        way_m=round(truth.way_m, 2), shown=shown,
        found=_short(found.text) if found else "",
        others=tuple(event.text.partition(":")[0] for event in named[:at]),
        answer=after[0] if after else "",
    )  # fmt: skip


def _short(text: str) -> str:
    """The row's name and the wheels, of an event's text."""
    name, wheels = text.partition(":")[0], text.rpartition(" (wheel ")
    return f"{name} (wheel {wheels[2]}" if wheels[1] else name


def judge(rows: Sequence[Row]) -> list[str]:
    """Found where it showed, of the right wheel, in time, and nothing else named before it; nothing where it did not.

    NOT_MOVING follows SLIP_HIGH by its nature.
    """
    short = []
    for row in rows:
        name = CASES[row.seed % len(CASES)][1]
        wanted = name + (f" (wheel {row.wheel})" if row.wheel else "")
        allowed = ("SLIP_HIGH",) if name == "NOT_MOVING" else ()
        late = row.way_m > WAYS_M[name] if name in WAYS_M else row.took_s > BY_NAME[name].detect_s
        if row.shown and row.found != wanted:
            short.append(f"{row.seed} {row.fault}: {row.found or 'nothing'} found in place of {wanted}")
        elif row.shown and late:
            short.append(f"{row.seed} {row.fault}: found after {row.took_s} s, {row.way_m} m")
        wrong = [other for other in row.others if other not in allowed]
        if wrong:
            short.append(f"{row.seed} {row.fault}: first {', '.join(wrong)}")
    for fault, _, _ in CASES:
        flown = [row for row in rows if row.fault == fault]
        if flown and not any(row.shown for row in flown):
            short.append(f"{fault} never showed in {len(flown)} flights")
    return short
