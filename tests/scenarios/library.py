"""Every scenario of hil/scenarios, in one process beside a twin without the fault: each keeps its promise.

A flight's seed is the scenario's place in the list (`hil list`), from 1. What needs processes of its own is flown over
sockets, in tests/hil/test_missions.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from hil.faults.injection import INJECTIONS
from hil.scenario.in_process import Twins
from hil.scenario.in_process import fly as fly_scenario
from hil.scenario.library import scenarios


@dataclass(frozen=True, slots=True)
class Row:
    """One scenario. broken: the promises it did not keep."""

    seed: int
    name: str
    bench_s: float
    to_goal_m: float
    way_m: float
    scans: int
    raised: tuple[str, ...]
    seen: tuple[str, ...]
    broken: tuple[str, ...]


ALWAYS = (
    "flat", "button_pressed", "can_unplugged", "imu_silent", "lidar_unplugged", "onboard_killed", "tilt_silent",
    "wheel_silent", "wheel_stuck", "dead_end", "ground_step", "operator_stop",
)  # fmt: skip
NEEDS_PROCESSES = frozenset(name for name, cause in INJECTIONS.items() if cause.never_quick)
SEEDS = tuple(
    k for k, scenario in enumerate(scenarios(), 1)
    if NEEDS_PROCESSES.isdisjoint(fault.fault for fault in scenario.faults)
)  # fmt: skip
SHORT = tuple(k for k, scenario in enumerate(scenarios(), 1) if scenario.name in ALWAYS)


@cache
def _twins() -> Twins:
    """Of this worker."""
    return Twins()


def fly(seed: int) -> Row:
    """The scenario at this place."""
    scenario = scenarios()[seed - 1]
    flown = fly_scenario(scenario, _twins())
    facts = flown.facts
    return Row(
        seed=seed, name=scenario.name, bench_s=flown.bench_s, to_goal_m=round(facts.to_goal_m, 3),
        way_m=round(flown.way_m, 2), scans=flown.sweeps, raised=facts.raised,
        seen=tuple(f"{s.t_s - s.begun_s:.2f} s {s.channel}" for s in facts.seen or ()),
        broken=tuple(f"{v.promise}: {v.found}" for v in flown.verdicts if not v.holds),
    )  # fmt: skip


def judge(rows: Sequence[Row]) -> list[str]:
    """Every promise of every scenario."""
    return [f"{row.name}: {text}" for row in rows for text in row.broken]
