"""Missions beside each other, in processes; and which ones, from a command line."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import active_children, get_context
from typing import Protocol, TypeVar

import typer

Row = TypeVar("Row")


class Seeded(Protocol):
    """What is flown once for each of its seeds."""

    @property
    def seeds(self) -> tuple[int, ...]:
        """The seeds."""


RunT = TypeVar("RunT", bound=Seeded)


def fly_all(
    fly: Callable[[RunT, int], Row], runs: Sequence[RunT], workers: int, renewed: int = 0
) -> Iterator[Row]:  # fmt: skip
    """Every mission of every run, as they end.

    renewed: after so many missions another process takes a worker's place, for missions that leave memory behind; 0:
    never. Workers that are renewed import this program anew: `fly` and `runs` are those of its modules.

    Ctrl-C reaches the caller alone: a mission begun is flown out, unless a second one kills it.
    """
    with ProcessPoolExecutor(
        workers, get_context("spawn") if renewed else None, signal.signal, (signal.SIGINT, signal.SIG_IGN),
        max_tasks_per_child=renewed or None,
    ) as pool:  # fmt: skip
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
        threading.excepthook = lambda _: None  # the pool's own thread may trip over children that are killed
        for child in active_children():
            child.kill()


def numbers(text: str) -> tuple[int, ...]:
    """The seeds of `1-10` or `3,7`. Raises typer.BadParameter."""
    found: list[int] = []
    for part in text.split(","):
        low, _, high = part.partition("-")
        try:
            found += range(int(low), int(high or low) + 1)
        except ValueError:
            raise typer.BadParameter(f"{part!r}: expected a number or low-high", param_hint="--seeds") from None
    return tuple(found)
