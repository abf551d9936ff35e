"""Missions under three hostilities each, at random times: at the goal, or stopped with the true reason, and no contact.

The demo's fields 1 to 30. Kinds and times are drawn from the seed among all rows of hostilities.py, between 5 s and
200 s; they may overlap. The flight program must detect each of them, and the replay of the record must equal the
flight.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from hil.campaign.mission import Watch, outcome_of
from hil.plant.plant import PlantAbortError
from hil.scenarios.model import Scenario
from onboard.records import Event
from protocol.tables.faults import BY_NAME
from tests.scenarios.goals.flown import GOAL_M, contact_words
from tests.scenarios.hostile.hostilities import HOSTILITIES
from tests.scenarios.hostile.siege import Attack, Siege
from tests.scenarios.library import replayed_elsewhere

SEEDS, SHORT = tuple(range(1, 31)), (23, 24)
COUNT, EARLIEST_S, LATEST_S = 3, 5.0, 200.0
ECHO_S = 10.0  # a fault may be raised this long after a hostility's end
HEADS = ("hostility", "what it does", "faults it may raise", "it may end a mission by", "flown", "arrived",
         "stopped by it", "felt, least", "faults told")  # fmt: skip
FAULT = re.compile(r"\b[A-Z]+(?:_[A-Z0-9]+)+\b")


@dataclass(frozen=True, slots=True)
class Row:
    """One flight.

    kinds, begun_s, ended_s, felt: of the hostilities.
    outcome: 'arrived', or the reason that the rover reported.
    reasons: faults that this reason names.
    over_s: time of the mission's outcome.
    faults, told_s: names and times of the raised faults.
    replayed: compared ticks.
    different: where the replay differed from the flight.
    """

    seed: int
    kinds: tuple[str, ...]
    begun_s: tuple[float, ...]
    ended_s: tuple[float, ...]
    felt: tuple[int, ...]
    outcome: str
    reasons: tuple[str, ...]
    over_s: float
    to_goal_m: float
    max_error_m: float
    contacts: tuple[str, ...]
    faults: tuple[str, ...]
    told_s: tuple[float, ...]
    replayed: int
    different: tuple[str, ...]
    way_m: float
    scans: int

    @property
    def arrived(self) -> bool:
        """True if the rover reported its arrival."""
        return self.outcome == "arrived"

    def truth(self, at_s: float) -> frozenset[str]:
        """Return the faults that a hostility caused at this time."""
        rows = (
            HOSTILITIES[kind].raises
            for kind, begin_s, end_s in zip(self.kinds, self.begun_s, self.ended_s)
            if begin_s <= at_s <= end_s + ECHO_S
        )
        return frozenset().union(*rows)


def drawn(seed: int) -> list[Attack]:
    """Return the hostilities of a seed, by their begin."""
    rng = np.random.default_rng([seed, 0xC4A05])
    kinds = rng.choice(np.array(sorted(HOSTILITIES)), COUNT, replace=False).tolist()
    begins_s = np.sort(rng.uniform(EARLIEST_S, LATEST_S, COUNT)).round(2).tolist()
    return [
        Attack(
            kind,
            begin_s,
            round(float(rng.uniform(*HOSTILITIES[kind].lasts_s)), 2),
            np.random.default_rng([seed, n, 0xC4A05]),
        )
        for n, (kind, begin_s) in enumerate(zip(kinds, begins_s))
    ]


def fly(seed: int) -> Row:
    """Fly the mission of a seed."""
    return flown(Scenario(name="chaos", terrain="fbm", seed=seed), drawn(seed))


def flown(scenario: Scenario, attacks: Sequence[Attack]) -> Row:
    """Fly a scenario under these attacks, and replay it."""
    with TemporaryDirectory() as folder:
        record = Path(folder) / "chaos.mcap"
        siege, watch, error = Siege(scenario, attacks, record), Watch(), ""
        over_s = math.nan
        try:
            while not siege.ended:
                siege.step(watch)
                if over_s != over_s and siege.operator.done:
                    over_s = siege.tick / 100
        except PlantAbortError as abort:
            error = str(abort)
        finally:
            siege.free()
        replayed, different = replayed_elsewhere(record)
    return _row(siege, watch, outcome_of(siege, error), over_s, (replayed, different))


def _row(siege: Siege, watch: Watch, outcome: str, over_s: float, replay: tuple[int, tuple[str, ...]]) -> Row:
    told = [event for event in siege.events if event.name == "FAULT"]
    x_m, y_m, _ = siege.state.position_m.tolist()
    begun = siege.attacks
    return Row(
        siege.scenario.seed,
        tuple(a.name for a in begun),
        tuple(a.begin_s for a in begun),
        tuple(a.ended_s for a in begun),
        tuple(a.felt for a in begun),
        outcome,
        named(outcome),
        over_s,
        round(math.dist((x_m, y_m), siege.field.goal_m), 3),
        round(watch.max_error_m, 3),
        tuple(contact_words(contact) for contact in siege.truth.contacts),
        tuple(event.text.partition(":")[0] for event in told),
        tuple(_seconds(event) for event in told),
        *replay,
        round(siege.progress.way_m, 2),
        siege.progress.sweeps,
    )


def _seconds(event: Event) -> float:
    return event.now_ns / 1e9


def named(outcome: str) -> tuple[str, ...]:
    """Return the faults that a reason names."""
    return tuple(name for name in FAULT.findall(outcome) if name in BY_NAME)


def true_reason(row: Row) -> bool:
    """Return whether a mission that did not arrive names faults, and only those that hostilities caused then."""
    return not row.arrived and bool(row.reasons) and set(row.reasons) <= _may_end(row)


def _may_end(row: Row) -> frozenset[str]:
    """Return the faults that could end the mission when it ended: `ends` of the hostilities around that time."""
    rows = (
        HOSTILITIES[kind].ends
        for kind, begin_s, end_s in zip(row.kinds, row.begun_s, row.ended_s)
        if begin_s <= row.over_s <= end_s + ECHO_S
    )
    return frozenset().union(*rows)


def broken(row: Row) -> list[str]:
    """Return the promises that one flight broke."""
    short, who = [], f"seed {row.seed}"
    if row.arrived and row.to_goal_m > GOAL_M:
        short.append(f"{who}: arrived {row.to_goal_m} m from the goal by truth")
    if not row.arrived and not true_reason(row):
        short.append(f"{who}: ended {row.to_goal_m} m from the goal, and not for the reason told: {row.outcome}")
    if row.contacts:
        short.append(f"{who} touched {len(row.contacts)} times, first {row.contacts[0]}")
    short += [
        f"{who}: {name} at {at_s:.1f} s, which no hostility raises"
        for name, at_s in zip(row.faults, row.told_s)
        if name not in row.truth(at_s)
    ]
    short += [
        f"{who}: {kind} was not felt"
        for kind, felt, end_s in zip(row.kinds, row.felt, row.ended_s)
        if not felt and not (HOSTILITIES[kind].in_sweep and end_s > row.over_s)
    ]  # after a mission no sweep runs
    short += [f"{who}: {text}" for text in row.different]
    if not row.replayed and not row.different:
        short.append(f"{who}: its replay compared no tick")
    return short


def judge(rows: Sequence[Row]) -> list[str]:
    """Judge each flight by itself."""
    return [text for row in rows for text in broken(row)]


def summary(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """Return a line for each hostility, in the order of HEADS, and one for all flights."""
    lines = [_line(name, [row for row in rows if name in row.kinds]) for name in HOSTILITIES]
    arrived = sum(row.arrived and row.to_goal_m <= GOAL_M for row in rows)
    stopped, contacts = sum(map(true_reason, rows)), sum(len(row.contacts) for row in rows)
    same = sum(row.replayed > 0 and not row.different for row in rows)
    rest = len(rows) - arrived - stopped
    means = f"contacts: {contacts}, replays identical: {same} of {len(rows)}, ended otherwise: {rest}"
    faults = str(sum(len(row.faults) for row in rows))
    return [*lines, ("all", means, "", "", str(len(rows)), str(arrived), str(stopped), "", faults)]


def _line(name: str, rows: Sequence[Row]) -> tuple[str, ...]:
    hostility = HOSTILITIES[name]
    felt = [row.felt[row.kinds.index(name)] for row in rows]
    told = sorted({fault for row in rows for fault in row.faults if fault in hostility.raises})
    by_it = sum(true_reason(row) and bool({*row.reasons} & hostility.ends) for row in rows)
    return (
        f"`{name}`",
        hostility.means,
        _names(sorted(hostility.raises)),
        _names(sorted(hostility.ends)),
        str(len(rows)),
        str(sum(row.arrived for row in rows)),
        str(by_it),
        str(min(felt)) if felt else "-",
        _names(told),
    )


def _names(names: Sequence[str]) -> str:
    return ", ".join(f"`{name}`" for name in names) or "none"
