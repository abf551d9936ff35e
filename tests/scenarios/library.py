"""Every scenario of hil/scenarios, in one process next to a twin without the fault: each keeps its promise.

Its record is then replayed by the narrowest build of the kernels, to the same bytes as the widest one flew. Records of
scenarios with a failing disk have gaps and cannot be replayed (tests/onboard/record/test_record_file.py). A seed is
the scenario's place in the list (`hil list`), from 1. Scenarios that need several processes are flown over sockets, in
tests/hil/run/test_missions.py.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from hil.faults.disk_faults import DISK_FAULTS
from hil.faults.injection import INJECTIONS
from hil.processes import environment
from hil.run.judged import Twins
from hil.run.judged import fly as fly_scenario
from hil.scenarios.library import scenarios
from onboard.native.variant import FORCED_BY, VARIANTS


@dataclass(frozen=True, slots=True)
class Row:
    """One scenario. replayed: compared ticks; broken: promises that it broke."""

    seed: int
    name: str
    bench_s: float
    to_goal_m: float
    way_m: float
    scans: int
    raised: tuple[str, ...]
    seen: tuple[str, ...]
    replayed: int
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
    """Return the twins of this worker."""
    return Twins()


def fly(seed: int) -> Row:
    """Fly the scenario at this place."""
    scenario = scenarios()[seed - 1]
    with TemporaryDirectory() as folder:
        record = Path(folder) / f"{scenario.name}.mcap"
        flown = fly_scenario(scenario, _twins(), record=record)
        gaps = any(fault.fault in DISK_FAULTS for fault in scenario.faults)
        replayed, different = (0, ()) if gaps else replayed_elsewhere(record)
    facts = flown.facts
    return Row(
        seed=seed,
        name=scenario.name,
        bench_s=flown.bench_s,
        to_goal_m=round(facts.to_goal_m, 3),
        way_m=round(flown.way_m, 2),
        scans=flown.sweeps,
        raised=facts.raised,
        seen=tuple(f"{s.t_s - s.begun_s:.2f} s {s.channel}" for s in facts.seen or ()),
        replayed=replayed,
        broken=(*(f"{v.promise}: {v.found}" for v in flown.verdicts if not v.holds), *different),
    )


def replayed_elsewhere(record: Path) -> tuple[int, tuple[str, ...]]:
    """Return the ticks compared by `onboard replay` on the other build of the kernels, and the differences."""
    command = [sys.executable, "-m", "onboard", "replay", "--json", str(record)]
    variables = {**environment(), FORCED_BY: VARIANTS[0]}
    done = subprocess.run(command, capture_output=True, text=True, env=variables, check=False)
    if not done.stdout:
        return 0, (f"its record cannot be replayed: {done.stderr.strip()}",)
    told = json.loads(done.stdout)
    same = () if told["verdict"] == "identical" else (f"its replay is {told['verdict']}: {told['first_difference']}",)
    return int(told["ticks"]), same


def judge(rows: Sequence[Row]) -> list[str]:
    """Return every broken promise of every scenario."""
    return [f"{row.name}: {text}" for row in rows for text in row.broken]
