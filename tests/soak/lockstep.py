"""Ten missions in a row, then idle to the end of the hour, in lock-step: the daemon itself with its record and map.

The rover drives to and fro on flat ground, one mission in each time slot, so that it stands when a slot's end is
sampled. The first missions make the map and load what missions need: growth is judged from SETTLED on.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from mcap.reader import make_reader

from hil.run.demo import told
from hil.run.run import RunResult, run
from hil.scenarios.model import Scenario, ground_of
from hil.world.world import Progress
from onboard.record.parts import family
from tests.soak.taken import Taken, child, growth, taken

SLOT_S, FIRST_S = 110.0, 2.0
SETTLED = 3  # missions
WAYS_M = ((1.8, 0.0), (0.0, 0.0))  # from the start, in turn
PART_BYTES = 1 << 22  # of the record: its index in memory grows by 1.7 kB/s until a part ends
IDLE_S = 300.0  # between two samples of an idle rover


@dataclass(frozen=True, slots=True)
class Soaked:
    """Result of the soak. missions: samples at their ends; idle: samples without orders."""

    missions: tuple[Taken, ...]
    idle: tuple[Taken, ...]
    arrived: int
    ticks: int
    left_out: int
    bench_s: float
    wall_s: float
    error: str

    def faults(self, wanted: int, duration_s: float) -> list[str]:
        """Return the broken promises."""
        found = [self.error] if self.error else []
        if self.arrived != wanted:
            found.append(f"{self.arrived} of {wanted} missions arrived")
        found += growth((*self.missions[SETTLED - 1 :], *self.idle))
        if self.left_out:
            found.append(f"{self.left_out} ticks were left out")
        if self.ticks < round(100 * duration_s):
            found.append(f"{self.ticks} ticks are in the record, {100 * duration_s:.0f} were to be run")
        return found


class Sampler:
    """Called by the bench about twice a second; stores the last sample before each mark of the bench's time."""

    def __init__(self, marks_s: Sequence[float], tell: Callable[[Taken], None]) -> None:
        self._marks_s, self._tell = list(marks_s), tell
        self._pid: int | None = None
        self._last: Taken | None = None
        self.kept: list[Taken] = []

    def __call__(self, progress: Progress, _wall_s: float) -> None:
        """Take a sample."""
        self._pid = self._pid or child(("onboard", "run"))
        if self._pid is None:
            return
        if self._marks_s and progress.now_s >= self._marks_s[0]:
            self._marks_s.pop(0)
            if self._last is not None:
                self.kept.append(self._last)
                self._tell(self._last)
        self._last = taken(self._pid, progress.now_s)


def soak(missions: int, duration_s: float, folder: Path, tell: Callable[[Taken], None]) -> Soaked:
    """Fly the missions, then idle until `duration_s` of the bench's time."""
    start = ground_of(Scenario(terrain="flat")).field.start
    goals = [(start.x_m + dx, start.y_m + dy) for dx, dy in (WAYS_M[k % len(WAYS_M)] for k in range(missions))]
    script = "".join(f"at {FIRST_S + k * SLOT_S}: goto {x:.3f} {y:.3f}\n" for k, (x, y) in enumerate(goals))
    ends_s = [FIRST_S + (k + 1) * SLOT_S for k in range(missions)]
    duration_s = max(duration_s, ends_s[-1] + 1.0)
    sampler = Sampler([*ends_s, *_every(ends_s[-1], duration_s)], tell)
    scenario = replace(
        Scenario(terrain="flat", link="lan", script=script, end_s=duration_s + 1.0),
        name="soak",
        set={
            "mapping.folder": str(folder / "map"),
            "state.folder": str(folder / "state"),
            "record.part_bytes": PART_BYTES,
        },
    )
    result = run(scenario, folder, sampler)
    return _soaked(result, sampler.kept, missions)


def _every(from_s: float, to_s: float) -> list[float]:
    count = int((to_s - from_s) / IDLE_S)
    return [from_s + (k + 1) * IDLE_S for k in range(count)]


def _soaked(result: RunResult, kept: Sequence[Taken], missions: int) -> Soaked:
    arrived = ticks = 0
    for part in family(result.folder / "onboard.mcap", whole_folder=False):
        arrived += sum(event.name == "ARRIVED" for event in told(part).events)
        with part.open("rb") as file:
            reader = make_reader(file)
            rhythms = [json.loads(a.data) for a in reader.iter_attachments() if a.name == "rhythm.json"]
            summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        by_channel = summary.statistics.channel_message_counts
        ticks += next(by_channel[k] for k, channel in summary.channels.items() if channel.topic == "/in/tick")
    return Soaked(
        tuple(kept[:missions]),
        tuple(kept[missions:]),
        arrived,
        ticks,
        rhythms[-1]["ticks"]["slipped"],
        result.bench_s,
        result.wall_s,
        result.error,
    )
