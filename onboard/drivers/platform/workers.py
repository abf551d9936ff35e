"""Runner of jobs outside the tick: one worker thread, in the order of submission; native code releases the interpreter.

In lock-step `collect` waits for a job at its due tick; on the wall clock it takes what is ready and leaves the rest.
A job names its function, and the thread that runs it loads the function's modules.
"""

from __future__ import annotations

import gc
import traceback
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from pkgutil import resolve_name
from threading import get_native_id
from time import perf_counter_ns
from types import MappingProxyType
from typing import Any

from onboard.records import JobDone, JobRequest


class JobError(RuntimeError):
    """A job raised: an error of our own that ends the run. The text is one line; the cause has the traceback."""

    def __init__(self, name: str, error: BaseException) -> None:
        last = traceback.extract_tb(error.__traceback__)[-1:]
        at = f" ({last[0].name}, line {last[0].lineno} of {Path(last[0].filename).name})" if last else ""
        super().__init__(f"the job {name} has failed: {type(error).__name__}: {error}{at}")


class Workers:
    """Worker thread of the core's jobs.

    took_ns: run time of each job of the last `collect`; () in lock-step.
    own: function -> arguments that the shell adds before those of the core.
    """

    def __init__(self, wait: bool) -> None:
        self._wait = wait
        self.own: dict[str, tuple[Any, ...]] = {}
        self.took_ns: tuple[int, ...] = ()
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="job")
        self._running: dict[int, tuple[JobRequest, Future[Any]]] = {}

    def preload(self, names: Iterable[str]) -> Future[None]:
        """Load the modules of these ("module:name"), in this order, before any job; the result: all are loaded.

        A module that cannot be loaded raises where it is needed.
        """
        for name in names:
            self._pool.submit(resolve_name, name)
        return self._pool.submit(gc.freeze)  # collecting the loaded objects again would cost ticks of 30 ms

    def thread_id(self) -> int:
        """Operating system's number of the thread; waits until its present work is done."""
        return self._pool.submit(get_native_id).result()

    def start(self, requests: Sequence[JobRequest], cancelled: Sequence[int] = ()) -> None:
        """Start these jobs. cancelled: a waiting one never starts, the result of a running one is ignored."""
        for job_id in cancelled:
            if job_id in self._running:
                self._running.pop(job_id)[1].cancel()
        for request in requests:
            self._running[request.job_id] = (request, self._pool.submit(_timed, request, self.own))

    def collect(self, tick: int) -> tuple[JobDone, ...]:
        """Return the results due at this tick, in the order of submission. Raises JobError if a job has raised."""
        self.took_ns = ()
        if not self._running:
            return ()
        done, took = [], []
        for job_id, (request, future) in list(self._running.items()):
            if tick >= request.due_tick and (self._wait or future.done()):
                error = future.exception()
                if error is not None:
                    raise JobError(request.name, error) from error
                value, took_ns = future.result()
                done.append(JobDone(job_id, value))
                took.append(took_ns)
                del self._running[job_id]
        self.took_ns = () if self._wait else tuple(took)
        return tuple(done)

    def close(self) -> None:
        """Drop the queued jobs and let the running one end."""
        self._pool.shutdown(wait=True, cancel_futures=True)


class Inline:
    """Runner without a thread, for replay and one-process runs: each job runs when its result is taken."""

    def __init__(self, own: Mapping[str, tuple[Any, ...]] = MappingProxyType({})) -> None:
        self._own = own
        self._waiting: dict[int, JobRequest] = {}

    def start(self, requests: Sequence[JobRequest], cancelled: Sequence[int] = ()) -> None:
        """Store these jobs for later; drop the cancelled ones."""
        for job_id in cancelled:
            self._waiting.pop(job_id, None)
        self._waiting.update((request.job_id, request) for request in requests)

    def due(self, tick: int) -> tuple[int, ...]:
        """Ids of the jobs whose results lock-step takes at this tick, in the order of submission."""
        return tuple(job_id for job_id, request in self._waiting.items() if tick >= request.due_tick)

    def take(self, job_ids: tuple[int, ...]) -> tuple[JobDone, ...]:
        """Run the jobs whose results are taken at this tick: those `due`, or those that the record names."""
        taken = []
        for job_id in job_ids:
            request = self._waiting.pop(job_id)
            taken.append(JobDone(job_id, perform(request, self._own)))
        return tuple(taken)


def _timed(request: JobRequest, own: Mapping[str, tuple[Any, ...]]) -> tuple[Any, int]:
    began_ns = perf_counter_ns()
    return perform(request, own), perf_counter_ns() - began_ns


def perform(request: JobRequest, own: Mapping[str, tuple[Any, ...]] = MappingProxyType({})) -> Any:
    """Run a job now and return its result; load the modules of its function if necessary. own: as in Workers."""
    return resolve_name(request.function)(*own.get(request.function, ()), *request.arguments)
