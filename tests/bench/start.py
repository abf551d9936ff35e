"""Row `start`: processor time of `onboard run`, from its launch to its first tick, over that of the bare imports.

On the wall clock, as a rover starts: with zenoh as its link, a record, and all that its jobs need, which loads before
the first tick. The bus is python-can's virtual one, and no scanner answers: neither takes processor time.
The reference imports what a rover cannot fly without (NEEDED) and does nothing.
"""

from __future__ import annotations

import compileall
import os
import socket
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from hil.processes import free_ports
from tests.bench.goals import Measured

NEEDED = ("numpy", "scipy.linalg", "scipy.ndimage", "small_gicp", "fastcrc", "zenoh", "mcap.writer", "click",
          "can.interfaces.virtual")  # fmt: skip
LIMIT_S = 120.0
_CPU_OF_A_PROCESS = 2  # clock_getcpuclockid(3), of Linux: (~pid << 3) | 2


def start(repeats: int) -> Measured:
    """Each start is followed by its reference: both see the same machine.

    Byte code is there on both sides, as `make` leaves it, also where the environment forbids Python to write it.
    """
    for package in ("protocol", "onboard"):
        compileall.compile_dir(package, quiet=2)
    pairs = [(first_tick_s(), bare_imports_s()) for _ in range(repeats)]
    ours_s, theirs_s = median(ours for ours, _ in pairs), median(theirs for _, theirs in pairs)
    ratio = median(ours / theirs for ours, theirs in pairs)
    return Measured(ratio, ours_s, theirs_s, f"python -c 'import {', '.join(NEEDED)}'", "processor time")


def first_tick_s() -> float:
    """Processor time of the flight program until it says READY, which it does after its first tick."""
    with TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(f"{folder}/notify")
        manager.settimeout(LIMIT_S)
        program = subprocess.Popen(
            [sys.executable, "-m", "onboard", "run", *_settings(Path(folder))],
            env={**os.environ, "NOTIFY_SOCKET": f"{folder}/notify"},
            stderr=subprocess.DEVNULL,
        )
        try:
            while b"READY=1" not in manager.recv(4096):
                pass
            return time.clock_gettime((~program.pid << 3) | _CPU_OF_A_PROCESS)
        finally:
            program.terminate()
            program.wait()


def _settings(folder: Path) -> list[str]:
    (port,) = free_ports(1)
    settings = {
        "can.uri": "virtual:start",
        "lidar.address": "tcp:127.0.0.1:1",
        "link.endpoint": f"tcp/127.0.0.1:{port}",
        "link.bench_seed": 1,
        "status.socket": "off",
        "record.path": folder / "start.mcap",
    }
    return [word for name, value in settings.items() for word in ("--set", f"{name}={value}")]


def bare_imports_s() -> float:
    """Processor time of a Python that imports NEEDED. Raises CalledProcessError where one is missing."""
    command = [sys.executable, "-c", f"import {', '.join(NEEDED)}"]
    _, status, used = os.wait4(os.posix_spawn(command[0], command, os.environ), 0)
    if status:
        raise subprocess.CalledProcessError(os.waitstatus_to_exitcode(status), command)
    return used.ru_utime + used.ru_stime
