"""Child processes of a run: started together, monitored, and always ended with it."""

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

ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # for speed: no result depends on it


def environment() -> dict[str, str]:
    """This process's, with one thread for each library in a child unless somebody has asked for more."""
    return {**ONE_THREAD, **os.environ}


_LIBC = ctypes.CDLL(None)
_PR_SET_PDEATHSIG = 1


class ProcessDiedError(RuntimeError):
    """Unexpected end of a process of the run; the text has its name, exit code and last lines."""


class Processes:
    """Starts children of this Python and ends them when the block is left: SIGTERM, after `grace_s` SIGKILL.

    If this process is killed, the kernel sends them SIGTERM. Start them from the main thread: the kernel sends the
    signal when the thread that started them ends (prctl(2)).
    """

    def __init__(self, folder: Path, grace_s: float = 5.0) -> None:
        self._folder, self._grace_s = folder, grace_s
        self._children: dict[str, subprocess.Popen[bytes]] = {}
        self._started: dict[str, tuple[str, Sequence[str], Mapping[str, str] | None, str]] = {}
        self._expected: set[str] = set()
        self._may_end: dict[str, int] = {}

    def start(
        self,
        name: str,
        module: str,
        arguments: Sequence[str],
        variables: Mapping[str, str] | None = None,
        python: str = "",
    ) -> None:
        """Run `python -m module arguments`; its output goes to FOLDER/name.log.

        python: another interpreter than this one, which may be of another processor; it runs its own installation, not
            the sources of the current folder.
        """
        log = (self._folder / f"{name}.log").open("ab" if name in self._started else "wb")
        self._started[name] = module, arguments, variables, python
        interpreter = [python, "-P"] if python else [sys.executable]
        with log:
            self._children[name] = subprocess.Popen(
                [*interpreter, "-m", module, *arguments],
                stdout=log,
                stderr=subprocess.STDOUT,
                stdin=subprocess.DEVNULL,
                env={**environment(), **(variables or {})},
                start_new_session=True,  # Ctrl-C reaches only the bench, which ends the others in order
                preexec_fn=_end_with_parent,
            )

    def pid(self, name: str) -> int:
        """Process id of a child."""
        return self._children[name].pid

    def peak_rss_bytes(self, name: str) -> int:
        """Largest resident memory of a child so far, bytes; 0 after it has ended."""
        try:
            status = Path(f"/proc/{self.pid(name)}/status").read_text()
        except OSError:
            return 0
        row = next((line for line in status.splitlines() if line.startswith("VmHWM:")), "VmHWM: 0 kB")
        return int(row.split()[1]) * 1024

    def let_end(self, name: str, code: int) -> None:
        """From now on accept that this child ends with this exit code; see `has_ended`."""
        self._may_end[name] = code

    def has_ended(self, name: str, limit_s: float) -> bool:
        """True if the child ends within `limit_s` with the code given to `let_end`."""
        try:
            return self._children[name].wait(limit_s) == self._may_end.get(name)
        except subprocess.TimeoutExpired:
            return False

    def check(self) -> None:
        """Raise ProcessDiedError if a child has ended unexpectedly."""
        for name, child in self._children.items():
            code = child.poll()
            if code is not None and name not in self._expected and code != self._may_end.get(name):
                raise ProcessDiedError(f"{name} ended with {_code(code)}:\n{self.tail(name)}")

    def kill(self, name: str) -> None:
        """Send SIGKILL, as `kill -9` does; the end is expected."""
        self._expected.add(name)
        self._children[name].kill()
        self._children[name].wait()

    def restart(self, name: str) -> None:
        """Start a killed child again with the same arguments; its log continues."""
        self._expected.discard(name)
        self.start(name, *self._started[name])

    def killed(self, name: str) -> bool:
        """True if `kill` ended it."""
        return name in self._expected

    def settle(self, limit_s: float) -> None:
        """Wait up to `limit_s` for a child that is about to end, so that `check` sees it."""
        deadline = time.monotonic() + limit_s
        while time.monotonic() < deadline:
            if any(child.poll() is not None and name not in self._expected for name, child in self._children.items()):
                return
            time.sleep(0.02)

    def tail(self, name: str, lines: int = 12) -> str:
        """Last lines of its output."""
        text = (self._folder / f"{name}.log").read_text(errors="replace")
        return "\n".join(f"  {line}" for line in text.splitlines()[-lines:])

    def wait(self, limit_s: float) -> dict[str, int]:
        """Exit codes after an orderly end of the run; a child that does not end within `limit_s` is killed."""
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
        finally:  # a second Ctrl-C skips the wait
            for child in self._children.values():
                if child.poll() is None:
                    child.kill()
                    child.wait()


def _end_with_parent() -> None:
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


def _code(code: int) -> str:
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"


def free_ports(count: int) -> list[int]:
    """Free ports of the loopback interface, below the range that the system uses for outgoing connections.

    Any connection could take a port of that range before its child listens on it.
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
