"""The child processes of a run: started together, watched, and never left behind."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

FIXED_ENVIRONMENT = {
    # for the bench's own arithmetic; the flight program gives the same bits without: see docs/determinism.md
    "PYTHONHASHSEED": "0",
    "OPENBLAS_NUM_THREADS": "1",
    "OPENBLAS_CORETYPE": "Haswell",
    "OMP_NUM_THREADS": "1",
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    "PYTHONWARNINGS": "ignore::RuntimeWarning:numpy._core._multiarray_umath,ignore::ImportWarning",
}

_LIBC = ctypes.CDLL(None)
_PR_SET_PDEATHSIG = 1


class ProcessDiedError(RuntimeError):
    """A process of the run ended when it should not have; the text holds its name, exit code and last lines."""


class Processes:
    """Starts children of this Python and ends them all when the block is left: SIGTERM, after `grace_s` SIGKILL.

    Where this process is killed the kernel sends them SIGTERM. Start them from the main thread: the signal is sent at
    the end of the thread that started them (prctl(2)).
    """

    def __init__(self, folder: Path, grace_s: float = 5.0) -> None:
        self._folder, self._grace_s = folder, grace_s
        self._children: dict[str, subprocess.Popen[bytes]] = {}
        self._started: dict[str, tuple[str, Sequence[str], Mapping[str, str] | None]] = {}
        self._expected: set[str] = set()
        self._may_end: dict[str, int] = {}

    def start(
        self, name: str, module: str, arguments: Sequence[str], environment: Mapping[str, str] | None = None
    ) -> None:
        """Run `python -m module arguments`; its output goes to FOLDER/name.log."""
        log = (self._folder / f"{name}.log").open("ab" if name in self._started else "wb")
        self._started[name] = module, arguments, environment
        with log:
            self._children[name] = subprocess.Popen(
                [sys.executable, "-m", module, *arguments],
                stdout=log, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
                env={**os.environ, **FIXED_ENVIRONMENT, **(environment or {})},
                start_new_session=True,  # Ctrl-C reaches the bench alone, which ends the others in order
                preexec_fn=_end_with_parent,
            )

    def pid(self, name: str) -> int:
        """Process id of a child."""
        return self._children[name].pid

    def peak_rss_bytes(self, name: str) -> int:
        """Largest resident memory of a child so far; 0 when it has ended."""
        try:
            status = Path(f"/proc/{self.pid(name)}/status").read_text()
        except OSError:
            return 0
        row = next((line for line in status.splitlines() if line.startswith("VmHWM:")), "VmHWM: 0 kB")
        return int(row.split()[1]) * 1024

    def let_end(self, name: str, code: int) -> None:
        """From now on an end of this child with this exit code is nobody's fault; `has_ended` tells."""
        self._may_end[name] = code

    def has_ended(self, name: str, limit_s: float) -> bool:
        """Whether a child ends, within a time, as `let_end` said."""
        try:
            return self._children[name].wait(limit_s) == self._may_end.get(name)
        except subprocess.TimeoutExpired:
            return False

    def check(self) -> None:
        """Raise ProcessDiedError if a child has ended that was not expected to."""
        for name, child in self._children.items():
            code = child.poll()
            if code is not None and name not in self._expected and code != self._may_end.get(name):
                raise ProcessDiedError(f"{name} ended with {_code(code)}:\n{self.tail(name)}")

    def kill(self, name: str) -> None:
        """SIGKILL, as `kill -9` does; the end is expected."""
        self._expected.add(name)
        self._children[name].kill()
        self._children[name].wait()

    def restart(self, name: str) -> None:
        """Start a child that was killed with the same words; its log goes on."""
        self._expected.discard(name)
        self.start(name, *self._started[name])

    def killed(self, name: str) -> bool:
        """Whether `kill` ended it."""
        return name in self._expected

    def settle(self, limit_s: float) -> None:
        """Wait a little for a child that is just dying, so that `check` sees it."""
        deadline = time.monotonic() + limit_s
        while time.monotonic() < deadline:
            if any(child.poll() is not None and name not in self._expected for name, child in self._children.items()):
                return
            time.sleep(0.02)

    def tail(self, name: str, lines: int = 12) -> str:
        """Last lines of what it printed."""
        text = (self._folder / f"{name}.log").read_text(errors="replace")
        return "\n".join(f"  {line}" for line in text.splitlines()[-lines:])

    def wait(self, limit_s: float) -> dict[str, int]:
        """Exit codes after the run was ended in order; whoever does not end is killed."""
        codes = {}
        for name, child in self._children.items():
            try:
                codes[name] = child.wait(limit_s)
            except subprocess.TimeoutExpired:
                child.kill()
                codes[name] = child.wait()
        return codes

    def __enter__(self) -> Processes:
        return self

    def __exit__(self, *_: object) -> None:
        try:
            for child in self._children.values():
                if child.poll() is None:
                    child.send_signal(signal.SIGTERM)
            for child in self._children.values():
                with contextlib.suppress(subprocess.TimeoutExpired):
                    child.wait(self._grace_s)
        finally:  # a second Ctrl-C shortens the farewell
            for child in self._children.values():
                if child.poll() is None:
                    child.kill()
                    child.wait()


def _end_with_parent() -> None:
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


def _code(code: int) -> str:
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"


def free_ports(count: int) -> list[int]:
    """Ports of the loopback that nobody listens on now, below those the system hands out for outgoing connections.

    A port of that range could be taken by any connection before its child listens on it.
    """
    first, found = 20_000 + 16 * os.getpid() % 12_000, []
    with contextlib.ExitStack() as held:
        for port in (*range(first, 32_000), *range(20_000, first)):
            probe = held.enter_context(socket.socket())
            with contextlib.suppress(OSError):
                probe.bind(("127.0.0.1", port))
                found.append(port)
            if len(found) == count:
                return found
    raise OSError(f"fewer than {count} free ports from 20000 to 32000 on 127.0.0.1")
