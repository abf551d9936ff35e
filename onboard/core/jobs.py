"""Job book: which jobs run outside the tick, and at which tick each result is taken.

Why a fixed tick: the core must be a function of its inputs. If a result were taken as soon as it is ready, the run
would depend on the load of the machine. So each job has a budget in ticks. In lock-step the tick waits for the result.
On the wall clock a late job is counted as a miss, and the tick that took its result is recorded, so that a replay does
the same.

The second column of JOBS is the rover's response to a late job. The wait always ends: after GIVE_UP_TICKS a job is
cancelled and the executive goes to SAFE. A cancelled job that still waits for its thread never starts; the result of
one that runs is ignored.

Why by name: a job's modules (the planners, the registration, scipy) load where the job runs, outside the tick. The core
loads only the job's records, so the first tick need not wait for modules that are needed minutes later.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType
from typing import Any, NamedTuple

from onboard.records import JobDone, JobRequest


class Late(Enum):
    """Response of the rover while a job is late, in addition to reporting JOB_LATE."""

    WAIT = "it stands and waits"
    HOLD = "it stops driving until the result is there"
    GO_ON = "nothing waits for it"


class Job(NamedTuple):
    """One row. function: `module:name` of a pure function; late: response while the job is late."""

    function: str
    late: Late


JOBS: Mapping[str, Job] = MappingProxyType(
    {
        "look": Job("onboard.perception.map.stop_map:look", Late.WAIT),
        "remember": Job("onboard.perception.map.stop_map:remember_all", Late.WAIT),
        "plan": Job("onboard.planning.cycle:plan", Late.WAIT),
        "guard_begin": Job("onboard.planning.guard.guarded_leg:begin", Late.WAIT),
        "guard_listen": Job("onboard.planning.guard.guarded_leg:listen", Late.HOLD),
        "guard_credit": Job("onboard.planning.guard.guarded_leg:credit", Late.WAIT),
        "predict": Job("onboard.planning.prediction:foresee", Late.GO_ON),
        "product": Job("onboard.planning.prediction:pack", Late.GO_ON),
        "product_scan": Job("onboard.perception.scan.scan_product:pack", Late.GO_ON),
        "product_record": Job("onboard.record.slice:record_slice", Late.GO_ON),  # the shell names the files
        "product_height_std": Job("onboard.perception.map.height_spread:pack", Late.GO_ON),
    }
)
GIVE_UP_TICKS = 6000  # a job is considered hung one minute after its due tick


@dataclass(slots=True)
class JobTimes:
    """Timing record of the jobs of one name.

    done: jobs finished or given up.
    late: those that missed their due tick.
    worst_late_ticks: most ticks past the due tick.
    worst_ns: longest measured run time.
    """

    done: int = 0
    late: int = 0
    worst_late_ticks: int = 0
    worst_ns: int = 0


class JobBook:
    """Jobs of one owner, each a row of the table `jobs`; at most one of a name at a time. kept: timing by name."""

    def __init__(self, jobs: Mapping[str, Job] = JOBS) -> None:
        self._jobs = jobs
        self._next_id = 1
        self._names: dict[int, str] = {}
        self._due: dict[int, int] = {}
        self._requests: list[JobRequest] = []
        self._cancelled: list[int] = []
        self.kept: dict[str, JobTimes] = {}

    @property
    def running(self) -> tuple[str, ...]:
        """Names of the jobs whose results are not taken yet."""
        return tuple(self._names.values())

    @property
    def late_ticks(self) -> int:
        """Most ticks past the due tick at which a result was taken."""
        return max((kept.worst_late_ticks for kept in self.kept.values()), default=0)

    @property
    def late_count(self) -> int:
        """Number of results that came after their due tick, or never."""
        return sum(kept.late for kept in self.kept.values())

    def submit(self, name: str, arguments: tuple[Any, ...], due_tick: int) -> None:
        """Start the job of this name outside the tick; `take` gives its result at `due_tick`."""
        assert name not in self._names.values(), f"job {name} is already running"
        self._names[self._next_id], self._due[self._next_id] = name, due_tick
        self._requests.append(JobRequest(self._next_id, name, self._jobs[name].function, arguments, due_tick))
        self._next_id += 1

    def take(self, done: Sequence[JobDone], tick: int, took_ns: Sequence[int] = ()) -> dict[str, Any]:
        """Return the results of jobs still wanted, by name. took_ns: run time of each, where it was measured."""
        taken: dict[str, Any] = {}
        for k, (job_id, value) in enumerate(done):
            name = self._names.pop(job_id, None)
            due = self._due.pop(job_id, tick)
            if name is not None:
                taken[name] = value
                self._note(name, max(0, tick - due), took_ns[k] if k < len(took_ns) else 0)
        return taken

    def overdue_ticks(self, tick: int, late: Late | None = None) -> int:
        """Ticks past its due tick of the latest running job, of this policy if one is given; 0 if none is late."""
        overdue = 0
        for job_id, name in self._names.items():
            if late in (None, self._jobs[name].late):
                overdue = max(overdue, tick - self._due[job_id])
        return overdue

    def forget(self, names: Collection[str]) -> None:
        """Cancel the running jobs of these names: their results are no longer wanted (the mission was stopped)."""
        self._cancel([job_id for job_id, name in self._names.items() if name in names])

    def give_up(self, tick: int) -> tuple[str, ...]:
        """Cancel the jobs past the limit of waiting and return their names."""
        hung = [job_id for job_id, due in self._due.items() if tick - due > GIVE_UP_TICKS]
        names = tuple(self._names[job_id] for job_id in hung)
        for job_id in hung:
            self._note(self._names[job_id], tick - self._due[job_id], 0)
        self._cancel(hung)
        return names

    def outgoing(self) -> tuple[JobRequest, ...]:
        """Return the jobs to start now, once."""
        requests, self._requests = tuple(self._requests), []
        return requests

    def cancelled(self) -> tuple[int, ...]:
        """Return the ids of started jobs that are no longer wanted, once."""
        ids, self._cancelled = tuple(self._cancelled), []
        return ids

    def _cancel(self, ids: Sequence[int]) -> None:
        for job_id in ids:
            del self._names[job_id], self._due[job_id]
        unsent = {request.job_id for request in self._requests}
        self._requests = [request for request in self._requests if request.job_id not in ids]
        self._cancelled += [job_id for job_id in ids if job_id not in unsent]

    def _note(self, name: str, late_ticks: int, took_ns: int) -> None:
        kept = self.kept.setdefault(name, JobTimes())
        kept.done += 1
        kept.late += late_ticks > 0
        kept.worst_late_ticks = max(kept.worst_late_ticks, late_ticks)
        kept.worst_ns = max(kept.worst_ns, took_ns)
