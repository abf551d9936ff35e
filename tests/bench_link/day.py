"""Row `memory`: a day of both ends and the link in one process, whose memory may not grow.

`python -m tests.bench_link.day HOURS` is that process: a command each minute, an event each 10 s, a cloud each 10 min,
a blackout of one minute each hour, 30 % loss. It prints its resident memory in bytes each hour of virtual time.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from tests.bench_link.figures import Figure, Told, mean

MOST_MB, FLAT_MB, SETTLED_H = 100.0, 2.0, 6
_LINK = {"blackout_first_s": 1800.0, "blackout_every_s": 3600.0}


def live(hours: int) -> None:
    """Run the process."""
    from onboard.records import Event
    from tests.bench_link.world import World, profile

    world = World(profile("moon-bad", **_LINK), 1)
    world.run(10.0)
    rng = np.random.default_rng(1)
    for step in range(360 * hours):
        world.rover.core.event(Event(world.now_ns, "info", "NOTE", f"step {step}"))
        if step % 6 == 0:
            world.request("goto", {"x_m": 1.0, "y_m": 1.0}, 120.0)
        if step % 60 == 0:
            world.rover.core.offer("cloud", rng.bytes(160_000), "raw")
        world.run(10.0 + 10.0 * (step + 1))
        world.executed.clear()
        if step % 360 == 359:
            print(resident_bytes(), flush=True)


def resident_bytes() -> int:
    """Return the resident memory of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def row(quick: bool, told: Told) -> list[Figure]:
    """Run the process and record its memory."""
    hours, sizes_mb = (2 if quick else 24), []
    words = [sys.executable, "-m", "tests.bench_link.day", str(hours)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            sizes_mb.append(int(line) / 1e6)
            told(f"hour {len(sizes_mb)} of {hours}: {sizes_mb[-1]:.1f} MB")
    if process.returncode or len(sizes_mb) != hours:
        raise RuntimeError(f"the day ended with {process.returncode} after {len(sizes_mb)} h")
    settled = sizes_mb[min(SETTLED_H, hours - 1) :]
    where = f"both ends, {hours} h"
    return [
        mean("memory", where, "resident, most", [max(sizes_mb)], MOST_MB, "MB"),
        mean("memory", where, f"growth after {SETTLED_H} h", [max(settled) - settled[0]], FLAT_MB, "MB"),
    ]


if __name__ == "__main__":
    live(int(sys.argv[1]))
