"""Each wheel fault of the bench: the right row names the right wheel in time, and no other row before it.

A case is a seed: 10 * field + row of CASES, on the nominal campaign's kind of field. The fault begins 8 s into the
first drive without a named row; the flight ends 15 s after detection, or 60 s later without one. Soft ground waits for
a path that rises (RISES_DEG): down a slope the rover rolls over powder and dust, and off dust on sloping ground, where
it stands for less than the row's time. A pot's offset is watched for 300 s: after the first looks around, which turn
the rover on the spot, this allows the 5 m of driving in which it must be detected. Only driving along counts; wheels
that turn the rover on the spot add no way. Time counts from the first tick at which the truth shows the fault
(`_violates`): a weak wheel is sound while the ground needs less than it has left, a jumping encoder until it jumps.
The thresholds were set on fields 1 to 5; these are others.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hil.faults.wheel_faults import PATCH_AHEAD_M, WHEEL_FAULTS
from hil.plant.plant import PlantAbortError
from hil.records import PlantState
from hil.run.in_process import CAMPAIGN_STEP_NS, InMemory
from hil.scenarios.model import Scenario
from hil.terrain.field import Field, height_at
from onboard.core.faults.wheels.blocks import SLEW_RADPS2
from onboard.core.faults.wheels.seen import LEAST_MPS, approach
from onboard.core.faults.wheels.slip import ASTRAY_RAD, CALM
from onboard.core.faults.wheels.watch import WHEEL_ROWS
from onboard.core.rover import Rover
from onboard.records import Event, Inputs, Outputs
from protocol.tables.faults import BY_NAME, ResponseStep
from tests.scenarios.true_slip import WINDOW_TICKS, TrueSlip

CASES = (
    ("wheel_stuck", "WHEEL_STUCK", 2), ("wheel_free", "WHEEL_FREE", 4), ("wheel_weak", "WHEEL_WEAK", 1),
    ("steer_stuck", "STEER_STUCK", 3), ("encoder_dead", "ENCODER_BAD", 3), ("encoder_frozen", "ENCODER_BAD", 2),
    ("encoder_jumping", "ENCODER_BAD", 1), ("pot_offset", "STEER_OFFSET", 4), ("soft_patch", "SLIP_HIGH", 0),
    ("no_grip", "NOT_MOVING", 0),
)  # fmt: skip
FIELDS = (21, 22, 23)
SEEDS = tuple(10 * field + case for field in FIELDS for case in range(len(CASES)))
SHORT = SEEDS[:9:3]
DETECTS = {  # rows whose time and response are judged here, with the flights on one field that judge them
    name: tuple(10 * FIELDS[0] + case for case, (_, row, _) in enumerate(CASES) if row == name) for _, name, _ in CASES
}
TICKS_PER_S, NS, NEVER = 100, 1_000_000_000, 1 << 60
WAYS_KEPT = 6 * WINDOW_TICKS
AFTER_TICKS, WATCH_TICKS, ANSWER_TICKS = 800, 6000, 1500
LONG_TICKS = {"pot_offset": 30_000}  # replaces WATCH_TICKS
WAYS_M = {"STEER_OFFSET": 5.0, "SLIP_HIGH": 1.0}  # rows whose limit is a distance
TURNS_RADPS, OFF_RADPS, WORKS_NM, STEER_RAD = 0.15, 0.012, 0.2, math.radians(3.0)
JUMP_RAD = 0.05  # of the reported count against the true one; the bus delay alone is 0.02
COME_AND_GO = ("wheel_free", "wheel_weak", "no_grip")  # shown for the whole of the row's time, or until detected
BLOCK_TICKS, LAG_S = 20, 0.03  # of the means; from an order to the wheel, by the bench's bus
LACKS = {"soft_patch": 0.5, "no_grip": 0.8}  # share of the wheels' way in a second that the body lacks
RISES_DEG = {"soft_patch": (2.5, 8.0), "no_grip": (-1.0, 3.0)}  # of the true ground, along the path through the patch
LEANS_DEG = {"soft_patch": 90.0, "no_grip": 3.0}  # largest slope across the path
AHEAD_M, HALF_M = {"soft_patch": PATCH_AHEAD_M, "no_grip": 0.0}, 1.0  # place of that slope


@dataclass(frozen=True, slots=True)
class Row:
    """One flight.

    took_s: time from the first tick that shows the fault to the event; negative: event before it; -1 without both.
    way_m: of the wheels in that time.
    shown: True if the truth shows the fault at all.
    lacks: largest share of the wheels' way that the body lacked in a second, until then.
    strays_deg: largest excess turn within 1 m.
    found: row and wheels of the event.
    others: rows named before it; of those before the fault began only the rows that the truth did not show.
    answer: first response of the rover.
    """

    seed: int
    fault: str
    wheel: int
    took_s: float
    way_m: float
    shown: bool
    lacks: float
    strays_deg: float
    found: str
    others: tuple[str, ...]
    answer: str


class _Truth:
    """True state of the fault: first tick at which it shows, and the wheels' way from there until detection."""

    def __init__(self, fault: str, row: str, wheel: int) -> None:
        self.violated_tick, self.lacks, self.strays_rad, self.begun = -1, 0.0, 0.0, False
        self._fault, self._row, self._wheel = fault, row, wheel
        self._slip, self._found = TrueSlip(), False
        self._run_ticks = self._gap_ticks = 0
        # from the first tick of a slip to the tick that shows it
        self._late_ticks = WINDOW_TICKS - 1 if wheel == 0 else 0
        lasts_ticks = round(BY_NAME[row].detect_s * TICKS_PER_S) if fault in COME_AND_GO else 1
        self._lasts_ticks = max(1, lasts_ticks - self._late_ticks)
        self._owed: deque[float] = deque([0.0], maxlen=BLOCK_TICKS + 1)
        self._offs: deque[float] = deque(maxlen=BLOCK_TICKS)
        self._ways_m: deque[float] = deque([0.0], maxlen=WAYS_KEPT)  # of the wheels, since the start
        self._from_m = self._to_m = 0.0
        self._ahead_rad: float | None = None  # reported minus true position of the wheel, as the fault began
        self.false: list[str] = []  # rows named before the fault began that the ground does not explain

    @property
    def way_m(self) -> float:
        """Way from the first tick that shows the fault to its detection, m."""
        return max(0.0, self._to_m - self._from_m) if self.violated_tick >= 0 else 0.0

    def observe(self, tick: int, _inputs: Inputs, outputs: Outputs, rover: Rover, state: PlantState) -> None:
        """Observe one tick of the flight."""
        self._slip.update(state)
        step = rover.localisation.step
        self._ways_m.append(self._ways_m[-1] + math.hypot(step.dx_m, step.dy_m))
        if self._wheel:
            self._owe(rover.orders[self._wheel - 1].rate_radps, state.wheels[self._wheel - 1].rate_radps)
        if not self.begun:
            for event in _named(outputs.events):
                if not (event.text.startswith("SLIP_HIGH") and _slips(self._slip.lacks_ratio, self._slip.strays_rad)):
                    self.false.append(_row_of(event))
            return
        self._found = self._found or self._row in rover.watch.faults
        if not self._found:
            self._to_m = self._ways_m[-1]
            self.lacks = max(self.lacks, self._slip.lacks_ratio)
            self.strays_rad = max(self.strays_rad, self._slip.strays_rad)
        self._count(self._violates(rover, state))
        if self.violated_tick < 0 and self._run_ticks and (self._found or self._run_ticks >= self._lasts_ticks):
            ago = self._run_ticks - 1 + self._late_ticks
            self.violated_tick, self._from_m = tick - ago, self._ways_m[max(-1 - ago, -len(self._ways_m))]

    def _count(self, violates: bool) -> None:
        """Count the ticks for which the truth has shown the fault, with gaps of less than a block."""
        self._gap_ticks = 0 if violates else self._gap_ticks + 1
        going_on = self._run_ticks > 0 and self._gap_ticks < BLOCK_TICKS
        self._run_ticks = self._run_ticks + 1 if violates or going_on else 0

    def _violates(self, rover: Rover, state: PlantState) -> bool:
        if self._wheel == 0:
            return self._slip.lacks_ratio > LACKS[self._fault]
        order, wheel = rover.orders[self._wheel - 1], state.wheels[self._wheel - 1]
        turns = abs(order.rate_radps) > TURNS_RADPS
        if self._fault == "steer_stuck":
            return abs(order.steer_rad - wheel.steer_rad) > STEER_RAD
        if self._fault in COME_AND_GO:
            return turns and self._works(state) and self._off()
        if self._fault == "encoder_jumping":
            return turns and self._jumped(rover, wheel.position_rad)
        return turns

    def _works(self, state: PlantState) -> bool:
        """Return whether the other drives have a load."""
        return sum(abs(w.torque_nm) for k, w in enumerate(state.wheels, 1) if k != self._wheel) > WORKS_NM

    def _jumped(self, rover: Rover, true_rad: float) -> bool:
        """Return whether the encoder's error has changed since the fault began, by more than the bus delay explains."""
        told = rover.nodes.wheels[self._wheel - 1]
        assert told
        ahead_rad = told.position_rad - true_rad
        if self._ahead_rad is None:
            self._ahead_rad = ahead_rad
        return abs(ahead_rad - self._ahead_rad) > JUMP_RAD

    def _owe(self, ordered_radps: float, turned_radps: float) -> None:
        """Add the rate of a sound drive in this tick, and this drive's deviation from it."""
        self._owed.append(approach(self._owed[-1], ordered_radps, SLEW_RADPS2 / TICKS_PER_S))
        self._offs.append(turned_radps - self._owed[-1])

    def _off(self) -> bool:
        """Return whether the wheel's rate deviates from that of a sound drive, on the mean of a block."""
        ramp_radps2 = abs(self._owed[-1] - self._owed[0]) * TICKS_PER_S / BLOCK_TICKS
        return abs(sum(self._offs)) / BLOCK_TICKS > OFF_RADPS + LAG_S * ramp_radps2


def fly(seed: int) -> Row:
    """Fly one case on one field."""
    fault, row, wheel = CASES[seed % len(CASES)]
    bench = InMemory(Scenario(name=fault, terrain="fbm", seed=seed // len(CASES)), step_ns=CAMPAIGN_STEP_NS)
    truth = _Truth(fault, row, wheel)
    begin_tick = end_tick = NEVER
    before = 0  # events when the fault began
    try:
        while not bench.ended and bench.tick < end_tick:
            bench.step(truth.observe)
            if bench.progress.driving and begin_tick == NEVER:
                begin_tick = bench.tick + AFTER_TICKS
            if not truth.begun and bench.tick >= begin_tick and _fits(bench, fault):
                WHEEL_FAULTS[fault].begin(bench, wheel)
                truth.begun, before = True, len(bench.events)
                end_tick = bench.tick + LONG_TICKS.get(fault, WATCH_TICKS)
            if truth.begun and row in map(_row_of, _named(bench.events[before:])):
                end_tick = min(end_tick, bench.tick + ANSWER_TICKS)
    except PlantAbortError:
        pass  # the row has what was found until then
    finally:
        bench.free()
    return _row(seed, truth, bench.events[before:] if truth.begun else [])


def _fits(bench: InMemory, fault: str) -> bool:
    """Return whether no row is named and the ground is one on which the fault shows."""
    assert bench.rover
    if bench.rover.watch.faults:
        return False
    if fault not in RISES_DEG:
        return True
    (x, y, _), (vx, vy, _) = bench.state.position_m, bench.state.velocity_mps
    speed = math.hypot(vx, vy)
    if not bench.progress.driving or speed < LEAST_MPS:
        return False
    along, across = (vx / speed, vy / speed), (-vy / speed, vx / speed)
    middle = (x + AHEAD_M[fault] * along[0], y + AHEAD_M[fault] * along[1])
    least, most = RISES_DEG[fault]
    rises = least <= _rise_deg(bench.field, middle, along) <= most
    return rises and abs(_rise_deg(bench.field, middle, across)) <= LEANS_DEG[fault]


def _rise_deg(field: Field, middle: tuple[float, float], towards: tuple[float, float]) -> float:
    """Return the true slope about a place (m), towards a unit vector, over 2 * HALF_M, degrees."""
    along_m = np.array([-HALF_M, HALF_M])
    behind_m, before_m = height_at(field, middle[0] + along_m * towards[0], middle[1] + along_m * towards[1])
    return math.degrees(math.atan2(before_m - behind_m, 2.0 * HALF_M))


def _named(events: Sequence[Event]) -> list[Event]:
    """Return the events that name a row of this subject."""
    return [e for e in events if e.name == "FAULT" and e.text.startswith(WHEEL_ROWS)]


def _row_of(event: Event) -> str:
    return event.text.partition(":")[0]


def _row(seed: int, truth: _Truth, events: Sequence[Event]) -> Row:
    """events: since the fault began."""
    fault, row, wheel = CASES[seed % len(CASES)]
    named = _named(events)
    at = next((k for k, event in enumerate(named) if _row_of(event) == row), len(named))
    found = named[at] if at < len(named) else None
    after = [e.text for e in events if found and e.now_ns >= found.now_ns and e.name in ("MODE", "PHASE")]
    shown = truth.violated_tick >= 0
    return Row(
        seed=seed,
        fault=fault,
        wheel=wheel,
        took_s=round(found.now_ns / NS - truth.violated_tick / TICKS_PER_S, 2) if found and shown else -1.0,
        way_m=round(truth.way_m, 2),
        shown=shown,
        lacks=round(truth.lacks, 2),
        strays_deg=round(math.degrees(truth.strays_rad), 1),
        found=_short(found.text) if found else "",
        others=(*truth.false, *map(_row_of, named[:at])),
        answer=after[0] if after else "",
    )


def _short(text: str) -> str:
    """Return the row's name and the wheels from an event's text."""
    name, wheels = text.partition(":")[0], text.rpartition(" (wheel ")
    return f"{name} (wheel {wheels[2]}" if wheels[1] else name


def judge(rows: Sequence[Row]) -> list[str]:
    """Check each flight: detected if it showed, right wheel, in time, right response, no other or false row before it.

    NOT_MOVING follows SLIP_HIGH by its nature. SLIP_HIGH may come before the truth is as bad as LACKS; it is false if
    the body lacked less than the monitor calls calm, and turned as its wheels did.
    """
    return [f"{row.seed} {row.fault}: {text}" for row in rows for text in _faults_of(row)] + [
        f"{fault} never showed in {len(flown)} flights: {name} is not judged"
        for fault, name, _ in CASES
        if (flown := [row for row in rows if row.fault == fault]) and not any(row.shown for row in flown)
    ]


def _faults_of(row: Row) -> Iterator[str]:
    name = CASES[row.seed % len(CASES)][1]
    wanted = name + (f" (wheel {row.wheel})" if row.wheel else "")
    if row.shown and row.found != wanted:
        yield f"{row.found or 'nothing'} found in place of {wanted}"
    elif row.shown and (row.way_m > WAYS_M[name] if name in WAYS_M else row.took_s > BY_NAME[name].detect_s):
        yield f"found after {row.took_s} s, {row.way_m} m"
    slips = _slips(row.lacks, math.radians(row.strays_deg))
    if row.found and not (slips if row.wheel == 0 else row.shown):
        yield f"{row.found} is false"
    if row.found and not _answered(BY_NAME[name].response, row.answer):
        yield f"answered by {row.answer or 'nothing'}"
    wrong = [other for other in row.others if not (name == "NOT_MOVING" and other == "SLIP_HIGH")]
    if wrong:
        yield f"first {', '.join(wrong)}"


def _slips(lacks_ratio: float, strays_rad: float) -> bool:
    """Return whether the true slip exceeds the level that the monitor calls calm."""
    return lacks_ratio > CALM or strays_rad > ASTRAY_RAD


def _answered(response: Sequence[ResponseStep], answer: str) -> bool:
    """Return whether the rover's first response is that of the row: a new look if the row has one, else not SAFE."""
    looks = ResponseStep.RESCAN in response or ResponseStep.BACK_OFF in response
    return answer.startswith(("BACKING_OFF", "SCANNING")) if looks else "SAFE" not in answer
