"""Rows of a scenario in one process: hil-rtf-memory, hil-rtf-scan. One mission on the demo's first field serves both.

The process never waits, so its CPU time is its run time alone on a core; other processes have no influence.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from time import process_time

from hil.run.in_process import CAMPAIGN_STEP_NS, InMemory
from hil.scenarios.model import Scenario
from protocol.conventions import TICK_NS
from tests.bench.goals import Measured


@dataclass(frozen=True, slots=True)
class Flown:
    """CPU time of each tick, with and without a sweep in progress; and whether the rover reached its goal."""

    sweeping_s: tuple[float, ...]
    other_s: tuple[float, ...]
    way_m: float
    sweeps: int
    arrived: bool


@cache
def flown() -> Flown:
    """Fly with plant, devices, CAN, SCIP, link frames and the flight program with all its jobs; measure every tick."""
    bench = InMemory(Scenario(name="bench", terrain="fbm", link="lan"), step_ns=CAMPAIGN_STEP_NS)
    taken: dict[bool, list[float]] = {True: [], False: []}
    while not bench.ended:
        sweeping, began = bench.progress.sweeping, process_time()
        bench.step()
        taken[sweeping].append(process_time() - began)
    p = bench.progress
    bench.free()
    near = p.distance_to_goal_m < 0.3
    return Flown(tuple(taken[True]), tuple(taken[False]), p.way_m, p.sweeps, near)


def hil_rtf_memory(repeats: int) -> Measured:
    """Measure bench time over CPU time of the whole mission, without its start-up."""
    run = flown()
    return _ratio((*run.sweeping_s, *run.other_s), run, f"{run.way_m:.1f} m, {run.sweeps} sweeps")


def hil_rtf_scan(repeats: int) -> Measured:
    """Measure the same over the ticks of a 3D scan: 40 turns of 1081 rays a second."""
    run = flown()
    return _ratio(run.sweeping_s, run, f"{len(run.sweeping_s)} ticks of {run.sweeps} sweeps")


def _ratio(ticks_s: tuple[float, ...], run: Flown, what: str) -> Measured:
    cpu_s, bench_s = sum(ticks_s), len(ticks_s) * TICK_NS / 1e9
    note = f"rough field, {what}, physics at {CAMPAIGN_STEP_NS / 1e6:g} ms; CPU time of one process, once"
    return Measured(bench_s / cpu_s, cpu_s, bench_s, "real time", note, run.arrived)


ROWS = {"hil-rtf-memory": hil_rtf_memory, "hil-rtf-scan": hil_rtf_scan}
