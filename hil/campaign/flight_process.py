"""Process that flies cases one after the other, and its owner's end: `FlightProcess`.

    owner -> stdin   {"plan": tables, "where": file, "number": 17}
    owner <- stdout  {"row": {...}}

A flight leaves memory behind, and a flight may die of it; so it is not flown in the process that must stay. A process
ends by itself if its owner is gone. The function that flies is named on its command line as MODULE:FUNCTION.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from importlib import import_module
from typing import IO, Any

from hil.campaign.plan import Plan, plan_of
from hil.processes import ONE_THREAD

IDLE_S = 120.0  # without an order, after which a process ends: its campaign may be gone
RENEWED = 4  # flights before a new process replaces the old one
FLIES = "hil.campaign.case:fly"
_TAIL = 400


class FlightLostError(RuntimeError):
    """The process that flew a case ended before it had the row."""


class FlightProcess:
    """Process of one worker thread, started when it is needed and renewed after RENEWED flights."""

    def __init__(self, flies: str = FLIES, renewed: int = RENEWED) -> None:
        self._flies, self._renewed, self._left = flies, renewed, 0
        self._process: subprocess.Popen[str] | None = None
        self._errors: IO[bytes] | None = None

    def fly(self, plan: Plan, number: int) -> dict[str, Any]:
        """Fly a case. Raises FlightLostError."""
        if self._left == 0 or (self._process and self._process.poll() is not None):
            self.close()
        process = self._process or self._started()
        self._left -= 1
        try:
            assert process.stdin and process.stdout
            process.stdin.write(json.dumps({"plan": plan.tree, "where": plan.where, "number": number}) + "\n")
            process.stdin.flush()
            answer = process.stdout.readline()
        except OSError:
            answer = ""
        if not answer.endswith("\n"):
            raise FlightLostError(f"case {number}: its process {self._end()}")
        row: dict[str, Any] = json.loads(answer)["row"]
        return row

    def _started(self) -> subprocess.Popen[str]:
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "hil.campaign.flight_process", self._flies],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            env={**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            text=True,
            start_new_session=True,  # Ctrl-C is for the owner
        )
        self._left = self._renewed
        return self._process

    def _end(self) -> str:
        """How the process ended, in words."""
        assert self._process and self._errors
        code = self._process.wait()
        self._errors.seek(max(0, self._errors.seek(0, os.SEEK_END) - _TAIL))
        said = self._errors.read().decode(errors="replace").strip().splitlines()
        self.close()
        if code == -signal.SIGKILL:
            return "was killed (signal 9): by the system, if memory ran out"
        ended = f"ended by signal {-code}" if code < 0 else f"ended with exit code {code}"
        return f"{ended}: {said[-1]}" if said else ended

    def kill(self) -> None:
        """End the process from another thread; the thread that flies then raises FlightLostError."""
        if process := self._process:
            process.kill()

    def close(self) -> None:
        """End the process."""
        process, self._process, self._left = self._process, None, 0
        if process:
            assert process.stdin and process.stdout
            process.kill()
            process.wait()
            process.stdin.close()
            process.stdout.close()
        if self._errors:
            self._errors.close()
            self._errors = None


def named(flies: str) -> Callable[[Plan, int], dict[str, Any]]:
    """Function MODULE:FUNCTION."""
    module, _, name = flies.partition(":")
    found: Callable[[Plan, int], dict[str, Any]] = getattr(import_module(module), name)
    return found


def main() -> None:
    """Fly what is asked on stdin until it ends; then end at once, in the middle of a flight as well."""
    fly, answers = named(sys.argv[1]), os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # libraries that print do not disturb the answers
    asked: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(asked,), daemon=True).start()
    while True:
        try:
            order = json.loads(asked.get(timeout=IDLE_S))
        except queue.Empty:
            return
        row = fly(plan_of(order["plan"], order["where"]), order["number"])
        answers.write(json.dumps({"row": row}, allow_nan=False) + "\n")
        answers.flush()


def _listen(asked: queue.SimpleQueue[str]) -> None:
    for line in sys.stdin:
        asked.put(line)
    os._exit(0)


if __name__ == "__main__":
    main()
