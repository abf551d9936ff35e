"""Books of the long work: what runs beside the tick, and at which tick its result is taken.

Why a fixed tick: the core must be a function of its inputs. Were a result taken as soon as it is there, the run would
depend on the load of the machine. So each job has a budget in ticks; in lock-step the tick waits for it, on the wall
clock a late job is a counted miss and the tick at which it was taken is recorded, so that a replay does the same.

Why by name: a job's modules (the planners, the registration, scipy) load where it runs, beside the tick. The core that
asks for it loads its records alone, so the first tick need not wait for what is first needed minutes later.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from onboard.records import JobDone, JobRequest

JOBS: Mapping[str, str] = MappingProxyType(
    {
        "look": "onboard.perception.stop_map:look",
        "remember": "onboard.perception.stop_map:remember_all",
        "plan": "onboard.planning.cycle:plan",
        "guard_begin": "onboard.planning.guarded_leg:begin",
        "guard_listen": "onboard.planning.guarded_leg:listen",
        "guard_credit": "onboard.planning.guarded_leg:credit",
        "product": "protocol.products:encode_ldem",
    }
)  # name -> module:function, which is pure


class JobBook:
    """One owner's jobs, each a row of its table `functions`; at most one of a name at a time."""

    def __init__(self, functions: Mapping[str, str] = JOBS) -> None:
        self._functions = functions
        self._next_id = 1
        self._names: dict[int, str] = {}
        self._due: dict[int, int] = {}
        self._requests: list[JobRequest] = []
        self.late_ticks = 0

    @property
    def running(self) -> tuple[str, ...]:
        """Names of the jobs whose results are still to be taken."""
        return tuple(self._names.values())

    def submit(self, name: str, arguments: tuple[Any, ...], due_tick: int) -> None:
        """Start the job of this name beside the tick; its result comes with `take` at `due_tick`."""
        assert name not in self._names.values(), f"job {name} is already running"
        self._names[self._next_id], self._due[self._next_id] = name, due_tick
        self._requests.append(JobRequest(self._next_id, name, self._functions[name], arguments, due_tick))
        self._next_id += 1

    def take(self, done: Sequence[JobDone], tick: int) -> dict[str, Any]:
        """Results that belong to jobs still wanted, by name; counts ticks of lateness."""
        taken: dict[str, Any] = {}
        for job_id, value in done:
            name = self._names.pop(job_id, None)
            due = self._due.pop(job_id, tick)
            if name is not None:
                taken[name] = value
                self.late_ticks += max(0, tick - due)
        return taken

    def overdue_ticks(self, tick: int) -> int:
        """How far past its tick the latest of the running jobs is; 0 while none is late."""
        return max((tick - due for due in self._due.values() if tick > due), default=0)

    def forget(self, names: Collection[str]) -> None:
        """Results of running jobs of these names are no longer wanted (the mission was stopped)."""
        for job_id in [job_id for job_id, name in self._names.items() if name in names]:
            del self._names[job_id], self._due[job_id]

    def outgoing(self) -> tuple[JobRequest, ...]:
        """Jobs to start now."""
        requests, self._requests = tuple(self._requests), []
        return requests
