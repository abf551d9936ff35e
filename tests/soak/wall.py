"""The daemon alone on the wall clock: its resources and missed ticks, from its own status."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from hil.processes import free_ports
from onboard.drivers.status_port import StatusError, ask
from tests.soak.taken import Taken, growth, taken

LOOK_S = 10.0
START_LIMIT_S, END_LIMIT_S = 60.0, 30.0


@dataclass(frozen=True, slots=True)
class Sat:
    """Result of the run. ticks: number of counted wake-ups; late_us: lateness of 99 % of them was below this."""

    samples: tuple[Taken, ...]
    ticks: int
    left_out: int
    late_us: int
    exit_code: int

    def faults(self) -> list[str]:
        """Return the broken promises. Missed ticks are counted, not judged: the machine may be busy."""
        found = growth(self.samples)
        if self.exit_code:
            found.append(f"the daemon ended with {self.exit_code}")
        return found


def sit(duration_s: float, folder: Path) -> Sat:
    """Run the daemon for this time. Raises StatusError if it does not start."""
    folder.mkdir(parents=True, exist_ok=True)
    socket, (lidar, link) = folder / "status.sock", free_ports(2)
    settings = {
        "clock.mode": "wall",
        "can.uri": "virtual:soak",
        "lidar.address": f"tcp:127.0.0.1:{lidar}",
        "link.endpoint": f"tcp/127.0.0.1:{link}",
        "link.bench_seed": "1",
        "status.socket": str(socket),
        "record.path": str(folder / "wall.mcap"),
        "mapping.folder": str(folder / "map"),
    }
    options = [f"--set={name}={value}" for name, value in settings.items()]
    with (folder / "wall.log").open("wb") as log:
        daemon = subprocess.Popen(
            [sys.executable, "-m", "onboard", "run", *options],
            stdout=log,
            stderr=log,
            stdin=subprocess.DEVNULL,
        )
    try:
        _until_up(socket, daemon)
        begun = time.monotonic()
        samples = []
        while (at_s := time.monotonic() - begun) < duration_s:
            time.sleep(min(LOOK_S, duration_s - at_s))
            samples.append(taken(daemon.pid, time.monotonic() - begun))
        ticks = json.loads(ask([socket]))["ticks"]
        daemon.terminate()
        code = daemon.wait(END_LIMIT_S)
    finally:
        daemon.kill()
    return Sat(tuple(samples), sum(ticks["lateness"]), ticks["slipped"], ticks["late_below_us"]["p99"], code)


def _until_up(socket: Path, daemon: subprocess.Popen[bytes]) -> None:
    limit = time.monotonic() + START_LIMIT_S
    while True:
        try:
            ask([socket])
        except StatusError:
            if daemon.poll() is not None or time.monotonic() > limit:
                raise
            time.sleep(0.1)
        else:
            return
