"""Rows of whole programs: hil-rtf, memory, tick-cost, replay-rtf. One mission serves all."""

from __future__ import annotations

import gc
from dataclasses import replace as changed
from pathlib import Path
from pkgutil import resolve_name
from statistics import mean, median
from time import perf_counter

import numpy as np
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from hil.run.run import RunResult, run
from hil.scenarios.model import Scenario
from onboard.app import LATER, load_gdem
from onboard.config import load
from onboard.core.rover import Rover
from onboard.core.tick import tick
from onboard.drivers.platform.workers import Inline
from onboard.record.reader import ticks_of
from onboard.record.replay import replay
from onboard.record.schema import decode_inputs
from onboard.records import Inputs
from protocol.conventions import TICK_NS
from protocol.tables.modes import Phase
from tests.bench.goals import Measured

FLAT = Scenario(name="bench", terrain="flat", link="lan", limit_s=600.0)
LIMIT_BYTES = 200e6
MEAN_LIMIT, TAIL_LIMIT = 0.05, 0.20


class Mission:
    """Flat mission in lock-step, four processes, real sockets; flown at its first use."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._result: RunResult | None = None

    @property
    def result(self) -> RunResult:
        """Result of the mission. Raises RuntimeError if it failed."""
        if self._result is None:
            self._result = run(FLAT, self._folder / "mission", lambda *_: None)
            if self._result.error:
                raise RuntimeError(self._result.error)
        return self._result

    @property
    def record(self) -> Path:
        """Its onboard record."""
        return self.result.folder / "onboard.mcap"


def hil_rtf(mission: Mission, repeats: int) -> Measured:
    """Measure bench time over wall time."""
    r = mission.result
    return Measured(
        r.bench_s / r.wall_s,
        r.wall_s,
        r.bench_s,
        "real time",
        f"flat ground, {r.way_m:.1f} m, {r.sweeps} sweeps, once",
        r.ground_exit == 0,
    )


def memory(mission: Mission, repeats: int) -> Measured:
    """Measure the largest resident memory of the onboard process."""
    rss = mission.result.onboard_rss_bytes
    return Measured(
        rss / LIMIT_BYTES, 0.0, 0.0, "the limit", f"{rss / 1e6:.0f} MB in one mission; ten are not flown", rss > 0
    )


def tick_cost(mission: Mission, repeats: int) -> Measured:
    """Measure the core's ticks while driving, on the inputs of the record, without the jobs that run in parallel."""
    with mission.record.open("rb") as file:
        recorded = [decode_inputs(messages) for _, messages in ticks_of(StreamReader(file).records)]
    for name in LATER:
        resolve_name(name)
    gc.collect()
    gc.freeze()  # as onboard does after its start; also, a tick does not collect the record's objects
    passes = [_driving_ticks_s(mission, recorded) for _ in range(repeats)]
    gc.unfreeze()
    period_s = TICK_NS / 1e9
    mean_s = median(mean(taken) for taken in passes)
    tail_s = median(float(np.percentile(taken, 99.9)) for taken in passes)
    note = f"mean {1e6 * mean_s:.0f} us, p99.9 {1e6 * tail_s:.0f} us over {len(passes[0])} ticks, {repeats} times"
    ratio = max(mean_s / period_s / MEAN_LIMIT, tail_s / period_s / TAIL_LIMIT)
    return Measured(ratio, mean_s, period_s, "the period", note + "; without ports and record")


def _driving_ticks_s(mission: Mission, recorded: list[tuple[Inputs, tuple[int, ...]]]) -> list[float]:
    rover, jobs, taken = Rover(*_start(mission)), Inline(), []
    for inputs, job_ids in recorded:
        inputs = changed(inputs, jobs=jobs.take(job_ids))
        began = perf_counter()
        outputs = tick(rover, inputs)
        spent = perf_counter() - began
        if rover.executive.phase is Phase.DRIVING:
            taken.append(spent)
        jobs.start(outputs.jobs, outputs.cancelled)
    return taken


def _start(mission: Mission) -> tuple:
    with mission.record.open("rb") as file:
        config = next(a.data for a in make_reader(file).iter_attachments() if a.name == "config.toml")
    path = mission.result.folder / "config.toml"
    path.write_bytes(config)
    tree = load(path)
    return tree, load_gdem(tree.mission.gdem)


def replay_rtf(mission: Mission, repeats: int) -> Measured:
    """Measure the replay and comparison of the record."""
    taken, verdict = [], None
    for _ in range(max(1, repeats // 2)):
        began = perf_counter()
        verdict = replay(mission.record)
        taken.append(perf_counter() - began)
    assert verdict
    bench_s = verdict.ticks * TICK_NS / 1e9
    return Measured(
        bench_s / median(taken),
        median(taken),
        bench_s,
        "real time",
        verdict.first_difference or f"identical, {verdict.ticks} ticks",
        verdict.identical,
    )


ROWS = {"hil-rtf": hil_rtf, "memory": memory, "tick-cost": tick_cost, "replay-rtf": replay_rtf}
