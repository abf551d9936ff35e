"""Missions in parallel processes, and their selection on a command line."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from contextlib import ExitStack
from multiprocessing import active_children, get_context
from typing import Protocol, TypeVar

import typer

Row = TypeVar("Row")


class Seeded(Protocol):
    """Runs that are flown once for each of their seeds."""

    @property
    def seeds(self) -> tuple[int, ...]:
        """The seeds."""


RunT = TypeVar("RunT", bound=Seeded)


def fly_all(fly: Callable[[RunT, int], Row], runs: Sequence[RunT], workers: int, renewed: int = 0) -> Iterator[Row]:
    """Yield the rows of every mission of every run, as they end.

    renewed: after this many missions a new process replaces a worker, for missions that leave memory in use; 0: never.
        New
    workers import this program again: `fly` and `runs` are those of its modules.
    Ctrl-C reaches the caller alone: missions in progress are completed, unless a second one kills them.
    """
    workshop = _Workshop(renewed) if renewed else None
    with ExitStack() as ended, ThreadPoolExecutor(workers) if workshop else _processes(workers) as pool:
        if workshop:
            ended.callback(workshop.close)
        try:
            jobs = [(run, seed) for run in runs for seed in run.seeds]
            asked = [pool.submit(workshop.fly, fly, *job) if workshop else pool.submit(fly, *job) for job in jobs]
            for job in as_completed(asked):
                yield job.result()
        except (KeyboardInterrupt, GeneratorExit):  # the second where the caller had a row in hand
            _finish(pool)
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


class _Workshop:
    """A process for each calling thread, replaced after `renewed` missions.

    ProcessPoolExecutor's own max_tasks_per_child hangs in Python 3.11 (cpython issue 115634).
    """

    def __init__(self, renewed: int) -> None:
        self._renewed, self._own, self._all = renewed, threading.local(), list[ProcessPoolExecutor]()

    def fly(self, fly: Callable[[RunT, int], Row], run: RunT, seed: int) -> Row:
        """Run one mission in this thread's process."""
        own = self._own
        if getattr(own, "left", 0) == 0:
            if hasattr(own, "process"):
                own.process.shutdown()
            own.process, own.left = _processes(1, "spawn"), self._renewed
            self._all.append(own.process)
        own.left -= 1
        return own.process.submit(fly, run, seed).result()

    def close(self) -> None:
        """End all processes."""
        for process in self._all:
            process.shutdown()


def _processes(count: int, start: str | None = None) -> ProcessPoolExecutor:
    ignore = (signal.SIGINT, signal.SIG_IGN)
    return ProcessPoolExecutor(count, get_context(start) if start else None, signal.signal, ignore)


def _finish(pool: Executor) -> None:
    try:
        print("finishing the missions in flight; Ctrl-C again ends at once", file=sys.stderr, flush=True)
        pool.shutdown(wait=True, cancel_futures=True)
    except KeyboardInterrupt:
        threading.excepthook = lambda _: None  # the pool's own thread may trip over children that are killed
        for child in active_children():
            child.kill()


def numbers(text: str) -> tuple[int, ...]:
    """Return the seeds of `1-10` or `3,7`. Raises typer.BadParameter."""
    found: list[int] = []
    for part in text.split(","):
        low, _, high = part.partition("-")
        try:
            found += range(int(low), int(high or low) + 1)
        except ValueError:
            raise typer.BadParameter(f"{part!r}: expected a number or low-high", param_hint="--seeds") from None
    return tuple(found)
