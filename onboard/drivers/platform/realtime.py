"""Real-time options of the operating system for ticks in time: requests, and what was granted or the reason why not.

Each option of the configuration's [realtime] is one row of RealTime.OPTIONS. Without a privilege the program runs all
the same and reports the loss and the remedy. The tick's own thread makes the requests, after the job thread has begun.

Why the job thread also becomes a real-time one, of the lowest priority: a planner takes the interpreter's lock now and
then, and the tick waits until it releases it. As an ordinary thread it could be preempted by any other program
meanwhile, and delay the tick: measured, 9 ms in 1 of 1000 ticks against five busy programs, 2 to 4 ms this way.
"""

from __future__ import annotations

import ctypes
import os
import resource
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from onboard.config import Realtime
from onboard.drivers.platform.alarm import Alarm
from onboard.drivers.platform.garbage_collection import SlackCollector

_ALL_MEMORY = 3  # MCL_CURRENT | MCL_FUTURE
_CAP_IPC_LOCK = 14
JOB_PRIORITY = 1
SWITCH_S = 1e-3  # interval after which a job must release the interpreter's lock; Python's default is 5 ms


class Grant(NamedTuple):
    """Result of one request. text: the present state; or why it was not granted, and what to do."""

    option: str
    granted: bool
    text: str


class RealTime:
    """Requests every option that is on; `close` makes the thread an ordinary one again, for tools that go on.

    job_thread: native id.
    grants: one for each option requested.
    alarm, collector: None unless granted.
    """

    def __init__(self, wanted: Realtime, job_thread: int) -> None:
        self._wanted, self._job_thread = wanted, job_thread
        self._before = os.sched_getaffinity(0)
        self._switch_s = sys.getswitchinterval()
        sys.setswitchinterval(SWITCH_S)
        self.alarm: Alarm | None = None
        self.collector: SlackCollector | None = None
        off = Realtime()
        rows = [row for row in self.OPTIONS if getattr(wanted, row) != getattr(off, row)]
        self.grants = tuple(Grant(row, *self.OPTIONS[row](self)) for row in rows)

    def close(self) -> None:
        """Undo what was granted."""
        sys.setswitchinterval(self._switch_s)
        granted = {grant.option for grant in self.grants if grant.granted}
        if "fifo_priority" in granted:
            for thread in (0, self._job_thread):
                os.sched_setscheduler(thread, os.SCHED_OTHER, os.sched_param(0))
        if "lock_memory" in granted:
            ctypes.CDLL(None).munlockall()
        if "cpu" in granted:
            os.sched_setaffinity(0, self._before)
        for owned in (self.alarm, self.collector):
            if owned:
                owned.close()

    def _sleep(self) -> tuple[bool, str]:
        try:
            self.alarm = Alarm()
        except OSError as error:
            return False, f"no timer of the kernel: {error}"
        return True, "woken at the absolute time, by timerfd"

    def _collect(self) -> tuple[bool, str]:
        self.collector = SlackCollector()
        return True, "no collection within a tick"

    def _core(self) -> tuple[bool, str]:
        core, own = self._wanted.cpu, threading.get_native_id()
        if core not in self._before:
            return False, f"core {core} is not this process's; set realtime.cpu to one of {_listed(self._before)}"
        os.sched_setaffinity(0, {core})
        others = self._before - {core}
        if not others:
            return True, f"core {core}, the only one: jobs run on it too"
        for thread in map(int, os.listdir("/proc/self/task")):
            if thread != own:
                os.sched_setaffinity(thread, others)
        return True, f"core {core}, other threads on {_listed(others)}"

    def _memory(self) -> tuple[bool, str]:
        libc = ctypes.CDLL(None, use_errno=True)
        limit, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
        if limit != resource.RLIM_INFINITY and not _has_capability(_CAP_IPC_LOCK):
            # even if granted, memory that grows over the limit in flight would be refused then
            return False, f"this user may lock {limit >> 10} KiB only; {_todo('memlock', 'LimitMEMLOCK', 'infinity')}"
        if not hasattr(libc, "mlockall") or libc.mlockall(_ALL_MEMORY):
            return False, f"mlockall: {os.strerror(ctypes.get_errno())}"
        return True, "all memory stays in, also what comes later"

    def _fifo(self) -> tuple[bool, str]:
        priority = self._wanted.fifo_priority
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK  # a child that spins at this priority could stop the machine
        try:
            os.sched_setscheduler(0, policy, os.sched_param(priority))
            os.sched_setscheduler(self._job_thread, policy, os.sched_param(JOB_PRIORITY))
        except OSError as error:
            todo = _todo("rtprio", "LimitRTPRIO", str(priority))
            return False, f"SCHED_FIFO {priority}: {error.strerror}; {todo}"
        return True, f"SCHED_FIFO {priority}, jobs {JOB_PRIORITY}; not for children"

    OPTIONS = {  # noqa: RUF012  in the order of the requests
        "absolute_sleep": _sleep, "collect_in_slack": _collect, "cpu": _core, "lock_memory": _memory,
        "fifo_priority": _fifo,
    }  # fmt: skip


def words(grants: Sequence[Grant]) -> list[str]:
    """Lines for people: the options requested, and the result of each."""
    return [f"real time: {row.option} {'granted' if row.granted else 'NOT granted'}: {row.text}" for row in grants]


def _listed(cores: set[int]) -> str:
    return ", ".join(map(str, sorted(cores)))


def _todo(limit: str, unit: str, value: str) -> str:
    shown = "unlimited" if value == "infinity" else value
    return f"allow it by `USER - {limit} {shown}` in /etc/security/limits.conf, or {unit}={value} in the systemd unit"


def _has_capability(bit: int) -> bool:
    status = Path("/proc/self/status").read_text()
    effective = next(line.split()[1] for line in status.splitlines() if line.startswith("CapEff:"))
    return bool(int(effective, 16) >> bit & 1)
