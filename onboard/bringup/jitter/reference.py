"""Reference for our wake-ups, run at the same time: cyclictest if it is installed, else the bare loop."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

CYCLICTEST, BARE = "cyclictest", "bare loop"
_BARE_LOOP = "onboard.bringup.jitter.bare"
PACKAGE = "rt-tests"  # Debian's, which has cyclictest
_MOST_US = 20_000  # of its histogram; later wake-ups count as its maximum


class ReferenceError(RuntimeError):
    """Reference that cannot be run; the text gives the reason."""


@dataclass(slots=True)
class Reference:
    """Process that measures in parallel with us.

    kind: CYCLICTEST or BARE.
    process: the process.
    """

    kind: str
    process: subprocess.Popen[str]

    def late_us(self, limit_s: float) -> NDArray[np.float64]:
        """Wait for its end and return the delays of its wake-ups, (k,). Raises ReferenceError."""
        try:
            told, complaint = self.process.communicate(timeout=limit_s)
        except subprocess.TimeoutExpired:
            self.stop()
            raise ReferenceError(f"{self.kind} has not ended in time") from None
        if self.process.returncode:
            raise ReferenceError(f"{self.kind} failed: {(complaint or told).strip().splitlines()[-1:]}")
        return of_cyclictest(told) if self.kind == CYCLICTEST else np.array(told.split(), np.float64) / 1e3

    def stop(self) -> None:
        """End it early."""
        self.process.kill()
        self.process.communicate()


def start(interval_ns: int, count: int, priority: int) -> Reference:
    """Start to measure this many wake-ups.

    priority: of SCHED_FIFO; 0: an ordinary thread.

    Raises ReferenceError.
    """
    program = shutil.which("cyclictest")
    kind = CYCLICTEST if program else BARE
    policy = ["--policy=fifo", f"--prio={priority}"] if priority else ["--policy=other"]
    words = (
        [
            program,
            "--quiet",
            "--threads=1",
            f"--interval={interval_ns // 1000}",
            f"--loops={count}",
            f"--histogram={_MOST_US}",
            *policy,
        ]
        if program
        else [sys.executable, "-m", _BARE_LOOP, str(interval_ns), str(count), str(priority)]
    )
    process = subprocess.Popen(
        words,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,  # so that Ctrl-C reaches only this program
    )
    os.sched_setaffinity(process.pid, range(os.cpu_count() or 1))  # not bound to the tick's core
    assert process.stdout and process.stderr
    if kind == BARE and process.stdout.readline() != "ready\n":
        raise ReferenceError(f"the bare loop does not start: {process.stderr.read().strip().splitlines()[-1:]}")
    return Reference(kind, process)


def of_cyclictest(text: str) -> NDArray[np.float64]:
    """Wake-ups from the histogram that cyclictest writes: `microseconds count` a line, other lines begin with `# `.

    Those beyond the histogram count as its maximum. Raises ReferenceError without wake-ups.
    """
    late: list[float] = []
    most_us = beyond = 0
    for line in text.splitlines():
        name, _, value = line.lstrip("# ").partition(":")
        if line.startswith("#"):
            most_us = int(value.split()[0]) if name == "Max Latencies" and value.split() else most_us
            beyond = int(value.split()[0]) if name == "Histogram Overflows" and value.split() else beyond
        elif len(row := line.split()) == 2 and all(word.isdigit() for word in row):
            late += [float(row[0])] * int(row[1])
    late += [float(max(most_us, _MOST_US))] * beyond
    if not late:
        raise ReferenceError("cyclictest wrote no histogram")
    return np.array(late)
