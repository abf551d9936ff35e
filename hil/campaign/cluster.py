"""Cluster that flies the cases of a campaign: dask.distributed, of this machine or an existing one.

    campaign -> scheduler -> worker thread -> FlightProcess -> row

A worker only holds the pipe to the process that flies; so a local cluster's workers are threads of the campaign's own
process. A case whose process, worker or machine is lost is flown again, up to TRIES times.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any
from uuid import uuid4

import dask
from distributed import Client, KilledWorker, LocalCluster, WorkerPlugin, as_completed, get_worker
from distributed.exceptions import WorkerStartTimeoutError

from hil.campaign.flight_process import FLIES, FlightLostError, FlightProcess
from hil.campaign.plan import Plan

TRIES = 3
CONNECT_S = 10
WAIT_S = 3.0  # between two looks for a worker
_SETTINGS = {
    "distributed.scheduler.allowed-failures": TRIES,
    "distributed.scheduler.work-stealing": False,
    "distributed.scheduler.http.routes": [],
    "distributed.worker.memory.terminate": False,  # the flights have processes of their own
}


class NoSchedulerError(RuntimeError):
    """The scheduler cannot be reached, or went away."""


@dataclass(frozen=True, slots=True)
class Ended:
    """Case that has ended. row: None if it was lost `losses` times, the last time for the reason `problem`."""

    number: int
    row: dict[str, Any] | None
    problem: str = ""
    losses: int = 1


class FlightPlugin(WorkerPlugin):
    """Flight processes of a worker, one for each of its threads. Sent to every worker with the plan."""

    def __init__(self, name: str, plan: Plan, flies: str) -> None:
        self.name, self._tree, self._where, self._flies = name, dict(plan.tree), plan.where, flies

    def setup(self, worker: Any) -> None:
        """Prepare a worker."""
        from hil.campaign.plan import plan_of

        self._plan = plan_of(self._tree, self._where)
        self._lock, self._processes = threading.Lock(), dict[int, FlightProcess]()

    def fly(self, number: int) -> dict[str, Any]:
        """Fly a case in this thread's process. Raises FlightLostError."""
        with self._lock:
            process = self._processes.setdefault(threading.get_ident(), FlightProcess(self._flies))
        return process.fly(self._plan, number)

    def teardown(self, worker: Any) -> None:
        """End the processes, in the middle of their flights as well."""
        for process in self._processes.values():
            process.kill()


def fly_one(campaign: str, number: int) -> dict[str, Any]:
    """Task of a worker."""
    plugin: FlightPlugin = get_worker().plugins[campaign]
    return plugin.fly(number)


@contextmanager
def cluster(workers: int, scheduler: str = "") -> Iterator[Client]:
    """Client of an existing scheduler, or of a cluster in this process. Raises NoSchedulerError."""
    for name in ("distributed", "distributed.core", "distributed.worker", "distributed.client", "tornado"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    with dask.config.set(_SETTINGS):
        if not scheduler:
            with (
                LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=False,
                    memory_limit=0,
                    dashboard_address="127.0.0.1:0",
                    silence_logs=logging.CRITICAL,
                ) as local,
                Client(local, set_as_default=False) as client,
            ):
                yield client
            return
        _refuse_address(scheduler)
        try:
            client = Client(scheduler, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            why = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise NoSchedulerError(f"no scheduler at {scheduler}: {why}") from None
        with client:
            yield client


def _refuse_address(scheduler: str) -> None:
    """Refuse what is no address of a scheduler. Raises NoSchedulerError."""
    scheme, _, place = scheduler.rpartition("://")
    host, _, port = place.rpartition(":")
    if scheme not in ("", "tcp", "tls") or not host or not port.isdecimal():
        raise NoSchedulerError(f"no scheduler at {scheduler}: it should be tcp://HOST:PORT or tls://HOST:PORT")


def without_workers(client: Client, every_s: float = WAIT_S) -> Iterator[None]:
    """Yield every `every_s` until the scheduler has a worker. Raises NoSchedulerError if it goes away."""
    while True:
        try:
            client.wait_for_workers(1, timeout=every_s)
            return
        except WorkerStartTimeoutError:
            yield
        except (OSError, CancelledError):
            raise NoSchedulerError("the scheduler went away") from None


def fly_all(client: Client, plan: Plan, numbers: Sequence[int], flies: str = FLIES) -> Iterator[Ended]:
    """Yield the cases as they end. Raises NoSchedulerError if the scheduler goes away."""
    campaign = f"{plan.name}-{uuid4().hex[:8]}"
    client.register_plugin(FlightPlugin(campaign, plan, flies))
    losses, numbers_of = dict.fromkeys(numbers, 0), dict[str, int]()

    def submitted(number: int) -> Any:
        key = f"{campaign}-{number}-{losses[number]}"
        numbers_of[key] = number
        return client.submit(fly_one, campaign, number, key=key, pure=False, priority=-number)

    try:
        ending = as_completed([submitted(number) for number in numbers], loop=client.loop)
        for future in ending:
            number = numbers_of.pop(future.key)
            ended = _ended(future, number)
            future.release()
            if ended.row is None:
                losses[number] += ended.losses
            if ended.row is None and losses[number] < TRIES:
                ending.add(submitted(number))
            else:
                yield replace(ended, losses=losses[number])
    finally:
        _forget(client, campaign)


def _ended(future: Any, number: int) -> Ended:
    """Result of a future that has ended. Raises NoSchedulerError."""
    if future.status == "finished":
        return Ended(number, future.result())
    try:
        error = future.exception()
    except (CancelledError, OSError):
        raise NoSchedulerError("the scheduler went away") from None
    if isinstance(error, FlightLostError):
        return Ended(number, None, str(error))
    if isinstance(error, KilledWorker):
        lost = error.allowed_failures + 1
        return Ended(number, None, f"case {number}: {lost} workers were lost with it", lost)
    if error is None or future.status in ("cancelled", "lost"):
        raise NoSchedulerError("the scheduler went away")
    return Ended(number, None, f"case {number}: {type(error).__name__}: {error}")


def _forget(client: Client, campaign: str) -> None:
    """End what still flies, on the workers of an existing scheduler as well."""
    try:
        client.unregister_worker_plugin(campaign)
    except (OSError, RuntimeError, TimeoutError, CancelledError):
        return  # the scheduler is gone, and its workers end their processes themselves
