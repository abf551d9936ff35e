"""What our wake-ups are compared with, in the same seconds: cyclictest where it is installed, else the bare loop."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

CYCLICTEST, BARE = "cyclictest", "bare loop"
PACKAGE = "rt-tests"  # Debian's, which has cyclictest
_MOST_US = 20_000  # of its histogram; what is later counts as its maximum


class ReferenceError(RuntimeError):
    """The reference cannot be run; the text says why."""


@dataclass(slots=True)
class Reference:
    """A process that measures beside us. kind: CYCLICTEST or BARE."""

    kind: str
    process: subprocess.Popen[str]

    def late_us(self, limit_s: float) -> NDArray[np.float64]:
        """How late its wake-ups were, (k,), when it has ended. Raises ReferenceError."""
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
    """Begin to measure so many wake-ups; priority: of SCHED_FIFO, 0: an ordinary thread. Raises ReferenceError."""
    program = shutil.which("cyclictest")
    kind = CYCLICTEST if program else BARE
    policy = ["--policy=fifo", f"--prio={priority}"] if priority else ["--policy=other"]
    words = (
        [program, "--quiet", "--threads=1", f"--interval={interval_ns // 1000}", f"--loops={count}",
         f"--histogram={_MOST_US}", *policy]
        if program else [sys.executable, "-m", "onboard.jitter.bare", str(interval_ns), str(count), str(priority)]
    )  # fmt: skip
    process = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,  # Ctrl-C is ours
    )  # fmt: skip
    os.sched_setaffinity(process.pid, range(os.cpu_count() or 1))  # not held on the tick's core
    assert process.stdout and process.stderr
    if kind == BARE and process.stdout.readline() != "ready\n":
        raise ReferenceError(f"the bare loop does not start: {process.stderr.read().strip().splitlines()[-1:]}")
    return Reference(kind, process)


def of_cyclictest(text: str) -> NDArray[np.float64]:
    """Wake-ups from the histogram that cyclictest writes: `microseconds count` a line, `# ` before all else.

    Those beyond the histogram count as its maximum. Raises ReferenceError where there are none.
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
