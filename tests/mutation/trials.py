"""Trials beside each other, each in a process of its own that ends with it: what killed the mutant, if anything did.

The processes are forked from one that has imported what the tests need and nothing of ours: a trial costs its tests.
"""

from __future__ import annotations

import multiprocessing
import os
import resource
import signal
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import Enum
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

WAITS = 20
PRELOADED = ["pytest", "_pytest.assertion.rewrite", "hypothesis.strategies", "numpy"]


class End(Enum):
    """How a trial ended."""

    KILLED = "killed"
    TIMEOUT = "killed by time-out"
    SURVIVED = "survived"
    BROKEN = "broken"  # the trial says nothing: it could not be made


@dataclass(frozen=True, slots=True)
class Trial:
    """kill(*arguments) runs in the process and says what killed the mutant, "" where nothing did.

    limit_s: of processor time, as the machine may be busy; one that waits ends after WAITS times as long.
    """

    name: str
    kill: Callable[..., str]
    arguments: tuple[Any, ...]
    limit_s: int


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of a trial. by: what killed it, or why it is broken."""

    name: str
    end: End
    by: str


class Trials:
    """Use it inside `with`: what still runs at its end is killed."""

    def __init__(self, workers: int) -> None:
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(PRELOADED)
        self._pool = ThreadPoolExecutor(workers)
        self._live: set[BaseProcess] = set()
        self._ended = False

    def __enter__(self) -> Trials:
        return self

    def __exit__(self, *_: object) -> None:
        self._ended = True
        for process in tuple(self._live):
            process.kill()
        self._pool.shutdown(cancel_futures=True)

    def run(self, trials: Sequence[Trial]) -> Iterator[Outcome]:
        """An outcome each, in the order of the trials."""
        yield from self._pool.map(self._one, trials)

    def _one(self, trial: Trial) -> Outcome:
        ours, theirs = self._context.Pipe(duplex=False)
        process = self._context.Process(target=_in_child, args=(theirs, trial))
        process.start()
        self._live.add(process)
        if self._ended:  # while it started
            process.kill()
        theirs.close()
        try:
            if not ours.poll(WAITS * trial.limit_s):
                return Outcome(trial.name, End.TIMEOUT, f"waited {WAITS * trial.limit_s} s")
            end, by = ours.recv()
            return Outcome(trial.name, end, by)
        except EOFError:
            process.join()
            if process.exitcode == -signal.SIGXCPU:
                return Outcome(trial.name, End.TIMEOUT, f"{trial.limit_s} s of the processor")
            return Outcome(trial.name, End.BROKEN, f"its process ended with {process.exitcode}")
        finally:
            process.kill()
            process.join()
            self._live.discard(process)
            ours.close()


def _in_child(pipe: Connection, trial: Trial) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (trial.limit_s, resource.RLIM_INFINITY))
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    try:
        by = trial.kill(*trial.arguments)
    except Exception:  # noqa: BLE001  the parent tells whatever it was
        pipe.send((End.BROKEN, traceback.format_exc(limit=-3)))
    else:
        pipe.send((End.KILLED if by else End.SURVIVED, by))
    pipe.close()
