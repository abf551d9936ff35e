"""A scenario run in one process and judged, with a twin run without each of its faults: verdicts on `[expect]`.

    fly(load_scenario(path), Twins()).verdicts

The twin shows when an injection first made a difference: until then both runs are equal byte by byte. Twins are cached:
ten faults on the same ground share one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hil.run.answers import Watcher
from hil.run.in_process import CAMPAIGN_STEP_NS, InMemory
from hil.scenarios.model import Scenario
from hil.scenarios.verdicts import Expect, Facts, FirstDifference, Verdict, judge
from hil.world.trace import Trace, first_difference
from onboard.native import linear
from protocol.conventions import TICK_NS

KEPT = 2
SETTLE_S = 2.0  # the rover reports its arrival while its wheels still slow down


@dataclass(frozen=True, slots=True)
class FlightResult:
    """Result of a run.

    facts: facts for the verdicts
    verdicts: one for each promise
    bench_s: bench time
    way_m: distance driven
    sweeps: number of sweeps
    """

    facts: Facts
    verdicts: tuple[Verdict, ...]
    bench_s: float
    way_m: float
    sweeps: int


class Twins:
    """Cache of runs without a fault, each run as far as requested; the last KEPT are stored."""

    def __init__(self, step_ns: int = CAMPAIGN_STEP_NS) -> None:
        self._step_ns = step_ns
        self._kept: dict[str, InMemory] = {}

    def until(self, scenario: Scenario, at_s: float) -> Trace:
        """Trace of a scenario until `at_s`, or until its end."""
        plain = replace(scenario, name="", about="", expect=Expect())
        twin = self._kept.pop(repr(plain), None) or InMemory(plain, step_ns=self._step_ns)
        self._kept[repr(plain)] = twin
        while len(self._kept) > KEPT:
            self._kept.pop(next(iter(self._kept))).free()
        while twin.tick * TICK_NS < at_s * 1e9 and not twin.ended:
            twin.step()
        return twin.trace

    def free(self) -> None:
        """Free the engines of all twins."""
        for twin in self._kept.values():
            twin.free()
        self._kept.clear()


def fly(scenario: Scenario, twins: Twins, step_ns: int = CAMPAIGN_STEP_NS, record: Path | None = None) -> FlightResult:
    """Run a scenario to its end and judge it. record: path of the flight program's record, None for no record."""
    bench = InMemory(scenario, step_ns=step_ns, record=record)
    watcher = Watcher(scenario.expect.detects)
    flight = bench.run(watcher.observe, settle_s=SETTLE_S)
    speed_mps = linear.norm(bench.state.velocity_mps)
    seen = tuple(_seen(k, scenario, bench.trace, flight.faults, twins) for k in range(len(scenario.faults)))
    answers = watcher.answers(seen[0].t_s if seen else -1.0)
    facts = Facts(flight.distance_to_goal_m, speed_mps, flight.events, flight.contacts, flight.error, seen, answers)
    return FlightResult(facts, judge(scenario.expect, facts), flight.bench_s, flight.way_m, flight.sweeps)


def _seen(
    k: int, scenario: Scenario, trace: Trace, log: Sequence[Mapping[str, object]], twins: Twins
) -> FirstDifference:
    """Time at which fault k showed, against a twin without it."""
    fault = scenario.faults[k]
    begun = next((row for row in log if (row["fault"], row["target"]) == (fault.fault, fault.target)), None)
    if begun is None:
        return FirstDifference(fault.fault, -1.0, -1.0, "")
    begun_s = float(str(begun["t_s"]))
    others = replace(scenario, faults=scenario.faults[:k] + scenario.faults[k + 1 :])
    found = first_difference(trace, twins.until(others, begun_s + scenario.expect.seen_within_s))
    return FirstDifference(fault.fault, begun_s, *(found or (-1.0, "")))
