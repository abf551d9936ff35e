"""Missions beside each other, in processes."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import active_children
from typing import Protocol, TypeVar

Row = TypeVar("Row")


class Seeded(Protocol):
    """What is flown once for each of its seeds."""

    @property
    def seeds(self) -> tuple[int, ...]:
        """The seeds."""


RunT = TypeVar("RunT", bound=Seeded)


def fly_all(fly: Callable[[RunT, int], Row], runs: Sequence[RunT], workers: int) -> Iterator[Row]:
    """Every mission of every run, as they end.

    Ctrl-C reaches the caller alone: a mission begun is flown out, unless a second one kills it.
    """
    with ProcessPoolExecutor(workers, initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN)) as pool:
        try:
            for job in as_completed([pool.submit(fly, run, seed) for run in runs for seed in run.seeds]):
                yield job.result()
        except (KeyboardInterrupt, GeneratorExit):  # the second where the caller had a row in hand
            _finish(pool)
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _finish(pool: ProcessPoolExecutor) -> None:
    try:
        print("finishing the missions in flight; Ctrl-C again ends at once", file=sys.stderr, flush=True)
        pool.shutdown(wait=True, cancel_futures=True)
    except KeyboardInterrupt:
        for child in active_children():
            child.kill()
