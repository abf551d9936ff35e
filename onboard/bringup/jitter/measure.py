"""Measurement loop: the daemon's clock, wait, core and job thread, nothing connected, a planner always at work."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.bringup.jitter.job import request
from onboard.config import Config
from onboard.core.jobs import JOBS
from onboard.core.rover import Rover
from onboard.core.tick import tick
from onboard.drivers.platform.clock import WallClock, wait_for
from onboard.drivers.platform.realtime import Grant, RealTime
from onboard.drivers.platform.stopwatch import Stopwatch
from onboard.drivers.platform.workers import Workers
from onboard.records import Health, Inputs, JobRequest
from protocol.barrier import Tick

WARM_TICKS = 100  # until caches and allocator have settled and the reference has started
TOLD_TICKS = 50


@dataclass(frozen=True, slots=True)
class JitterFigures:
    """Figures of a measurement.

    late_us: (k,) delay of each tick.
    tick_us: (k,) duration of each tick.
    slipped_ticks: number of ticks left out.
    jobs: number of planner jobs in parallel.
    job_worst_ms: duration of the longest job.
    grants: state of the real-time options.
    """

    late_us: NDArray[np.float64]
    tick_us: NDArray[np.float64]
    slipped_ticks: int
    jobs: int
    job_worst_ms: float
    grants: tuple[Grant, ...]


class Bed:
    """Test bed that runs the ticks.

    told: called with the progress ratio twice a second.
    job: run a planner in parallel.
    """

    def __init__(self, config: Config, clock: WallClock, told: Callable[[float], None], job: bool) -> None:
        self._stack = ExitStack()
        self._clock, self._told = clock, told
        self._rover, self._watch = Rover(config, None), Stopwatch()
        self._workers = Workers(wait=False)
        self._stack.callback(self._workers.close)
        self._request = request(config) if job else None
        self._jobs, self._job_worst_ns = 0, 0
        self._workers.preload(job.function for job in JOBS.values()).result()
        quiet, loud = os.pipe()  # in place of a scanner that sends nothing
        self._stack.callback(os.close, quiet)
        self._stack.callback(os.close, loud)
        gc.freeze()
        self._stack.callback(gc.unfreeze)
        self._realtime = RealTime(config.realtime, self._workers.thread_id())
        self._stack.callback(self._realtime.close)
        clock.alarm = self._realtime.alarm
        alarm = clock.alarm.fileno() if clock.alarm else -1
        clock.idle = lambda left_s: (wait_for(quiet, left_s, alarm), None)[1]

    @property
    def grants(self) -> tuple[Grant, ...]:
        """State of the real-time options."""
        return self._realtime.grants

    def measure(self, ticks: int) -> JitterFigures:
        """Measure this many ticks of the clock, fewer if it is stopped."""
        late_us, tick_us = np.zeros(ticks), np.zeros(ticks)
        clock, count = self._clock, -WARM_TICKS
        slipped = 0
        clock.start()
        self._plan(0)
        while count < ticks and (now := clock.wait()) is not None:
            self._tick(now)
            if count >= 0:
                late_us[count], tick_us[count] = clock.late_ns / 1e3, self._watch.tick_ns / 1e3
            else:
                slipped = clock.slipped_ticks
            count += 1
            if count % TOLD_TICKS == 0:
                self._told(max(0, count) / ticks)
            if self._realtime.collector:
                self._realtime.collector.spend(clock.left_ns)
        n = max(0, count)
        return JitterFigures(
            late_us[:n],
            tick_us[:n],
            clock.slipped_ticks - slipped,
            self._jobs,
            self._job_worst_ns / 1e6,
            self._realtime.grants,
        )

    def close(self) -> None:
        """End the thread and release the real-time options."""
        self._stack.close()

    def _tick(self, now: Tick) -> None:
        self._watch.begin()
        health = Health(self._watch.tick_ns, self._clock.slipped_ticks)
        inputs = Inputs(now.number, now.now_ns, health=health, timing=self._watch.timing(self._clock.late_ns, ()))
        tick(self._rover, inputs, self._watch.mark)
        if self._workers.collect(now.number):
            self._jobs += 1
            self._job_worst_ns = max(self._job_worst_ns, *self._workers.took_ns)
            self._plan(now.number)
        self._watch.end()

    def _plan(self, number: int) -> None:
        if self._request is not None:
            self._workers.start([JobRequest(self._jobs + 1, "plan", JOBS["plan"].function, (self._request,), number)])
