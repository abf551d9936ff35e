"""Missions beside each other, in processes."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import Protocol, TypeVar

Row = TypeVar("Row")


class Seeded(Protocol):
    """What is flown once for each of its seeds."""

    @property
    def seeds(self) -> tuple[int, ...]:
        """The seeds."""


RunT = TypeVar("RunT", bound=Seeded)


def fly_all(fly: Callable[[RunT, int], Row], runs: Sequence[RunT], workers: int) -> Iterator[Row]:
    """Every mission of every run, as they end. Ctrl-C reaches the caller alone: a mission begun is flown out."""
    with ProcessPoolExecutor(workers, initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN)) as pool:
        jobs = [pool.submit(fly, run, seed) for run in runs for seed in run.seeds]
        try:
            for job in as_completed(jobs):
                yield job.result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
