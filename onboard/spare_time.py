"""Work of the shell outside the core's tick: record, map, port messages, `onboard status`, garbage collection.

`TickRecorder.keep` belongs to the tick (the rate group `record`); `SpareTime` uses the time left after it.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field

from onboard.config import Config
from onboard.core.rover import Rover
from onboard.drivers.lidar.port import LidarPort
from onboard.drivers.platform.clock import LockStepClock, WallClock
from onboard.drivers.platform.memory import trim
from onboard.drivers.platform.realtime import Grant, RealTime, words
from onboard.drivers.platform.service_manager import Service
from onboard.drivers.platform.workers import Workers
from onboard.drivers.status_port import StatusError, StatusPort, place_of
from onboard.drivers.storage.map_tiles import Keeper
from onboard.journal import Announce, Level
from onboard.record.writer import Recorder
from onboard.records import Inputs, Outputs
from onboard.status.report import ShellStatus, report

Clock = LockStepClock | WallClock
TRIM_NS = 10_000_000_000  # period of returning memory, while no mission runs


@dataclass(slots=True)
class TickRecorder:
    """Writer of each tick's record and map, and reporter of changed port errors.

    rover, lidar, recorder, keeper: sources and stores.
    announce: gets a line for each change of a port.
    journal: the core's events are announced too.
    told: port -> last announced error text.
    """

    rover: Rover
    lidar: LidarPort
    recorder: Recorder
    keeper: Keeper
    announce: Announce
    journal: bool
    told: dict[str, str] = field(default_factory=lambda: {"lidar": "", "can": "", "record": ""})

    def keep(self, inputs: Inputs, outputs: Outputs) -> None:
        """Store one tick, after its outputs are sent."""
        told, lidar = self.told, self.lidar.error or self.rover.lidar.complaint
        for port, word in (("lidar", lidar), ("can", inputs.can.error), ("record", inputs.record.error)):
            if word != told[port]:
                told[port] = word
                self.announce(f"{port}: {word or 'is well'}", Level.WARNING if word else Level.NOTICE)
        for event in outputs.events if self.journal else ():
            self.announce(f"{event.name}: {event.text}", Level[event.severity.upper()])
        self.recorder.write(inputs, outputs)
        self.keeper.keep(self.rover.executive.memory)


class SpareTime:
    """User of spare time: `onboard status`, garbage collector, service manager, return of memory.

    It also requests the real-time options.
    """

    def __init__(self, config: Config, rover: Rover, clock: Clock, recorder: Recorder, announce: Announce) -> None:
        self._config, self._rover, self._clock, self._recorder = config, rover, clock, recorder
        self._service = Service(os.environ)
        self._status = _status_port(config, announce)
        self._realtime: RealTime | None = None
        self._trim_ns = TRIM_NS  # not at the start: its modules are loading

    def go(self, workers: Workers, announce: Announce) -> int:
        """Request the options in [realtime], in the thread of the ticks; return the alarm's descriptor, -1 if none."""
        if isinstance(self._clock, LockStepClock):
            return -1
        self._realtime = RealTime(self._config.realtime, workers.thread_id())
        self._clock.alarm = self._realtime.alarm
        for grant, line in zip(self._realtime.grants, words(self._realtime.grants), strict=True):
            announce(line, Level.INFO if grant.granted else Level.WARNING)
        return self._realtime.alarm.fileno() if self._realtime.alarm else -1

    def use(self) -> None:
        """Use the time after a tick; never wait."""
        self._service.beat(self._clock.now_ns(), self._status_line)
        if self._status:
            self._status.serve(self._report, self._clock.now_ns())
        if self._realtime and self._realtime.collector and isinstance(self._clock, WallClock):
            self._realtime.collector.spend(self._clock.left_ns)
        now_ns = self._clock.now_ns()
        if self._rover.executive.in_mission:
            self._trim_ns = now_ns + TRIM_NS
        elif now_ns >= self._trim_ns:
            self._trim_ns = now_ns + TRIM_NS
            trim()

    @property
    def grants(self) -> tuple[Grant, ...]:
        """Results of the real-time requests."""
        return self._realtime.grants if self._realtime else ()

    def stopping(self) -> None:
        """Report to the service manager that the ticks have ended."""
        self._service.tell("STOPPING=1", "STATUS=the rover stands, the record is being closed")

    def close(self) -> None:
        """Undo the real-time options and close the socket."""
        self._service.close()
        if self._status:
            self._status.close()
        if self._realtime:
            self._realtime.close()

    def _status_line(self) -> str:
        executive, pose = self._rover.executive, self._rover.localisation.pose
        faults = " ".join(executive.active) or "none"
        where = f"{executive.mode.name} {executive.phase.name} at {pose.x_m:.2f} {pose.y_m:.2f}"
        return f"{where}; faults: {faults}; ticks left out: {self._clock.slipped_ticks}"

    def _report(self) -> bytes:
        path = self._recorder.path
        shell = ShellStatus(
            clock=self._config.clock.mode,
            pid=os.getpid(),
            uptime_ns=self._clock.now_ns(),
            grants=self.grants,
            record=str(path or ""),
            record_bytes=path.stat().st_size if path and path.exists() else 0,
        )
        return json.dumps(report(self._rover, shell)).encode() + b"\n"


def _status_port(config: Config, announce: Announce) -> StatusPort | None:
    """Open the status socket; None if it is off or cannot be opened: the rover flies all the same and reports it."""
    path = place_of(config.status.socket, config.clock.mode == "lockstep")
    try:
        return StatusPort(path) if path else None
    except StatusError as error:
        announce(f"`onboard status` will not be answered: {error}", Level.WARNING)
        return None
