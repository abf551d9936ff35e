"""Ports and clock around a machine that commands the hardware, and the replay of a drive from its record."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, TypeVar

from onboard.bringup.calibrate.drive import DRIVEN, WITH_LAG, CalibrationDrive
from onboard.bringup.can.moving.jog import Phase
from onboard.bringup.lidar.again import config_of, rows_of
from onboard.drivers.can.bus import CanPort
from onboard.drivers.lidar.byte_listener import LidarEar
from onboard.drivers.lidar.port import LidarPort
from onboard.drivers.platform.clock import WallClock
from onboard.record.reader import DamagedRecordError
from onboard.record.writer import Recorder
from onboard.records import Inputs, Outputs
from protocol.barrier import Tick


class Machine(Protocol):
    """Machine that a shell runs: the drive, or the sweeps of `onboard lidar lag`."""

    phase: Phase

    def tick(self, inputs: Inputs) -> Outputs:
        """Run one tick of 10 ms."""


M = TypeVar("M", bound=Machine)


class CalibrationShell:
    """The rover's two ports while the `with` of their owner lasts."""

    def __init__(self, can: CanPort, lidar: LidarPort, clock: WallClock, recorder: Recorder) -> None:
        self.can, self.lidar, self.clock, self._recorder = can, lidar, clock, recorder
        self._ear = LidarEar(lidar, clock.now_ns)
        clock.idle = self._ear.listen

    def until(self, machine: M, phase: Phase, tell: Callable[[M], None]) -> bool:
        """Run ticks until the machine is in a phase, or done; return True if it is in that phase."""
        while (now := self.clock.wait()) is not None:
            self._tick(machine, now)
            tell(machine)
            if machine.phase in (phase, Phase.DONE):
                return machine.phase is phase
        return False

    def linger(self, machine: Machine, ticks: int) -> None:
        """Run this many more ticks, for input that arrived while the operator decided, or for the last output."""
        for now in self.clock.overtime(ticks):
            self._tick(machine, now)

    def _tick(self, machine: Machine, now: Tick) -> None:
        inputs = Inputs(
            now.number,
            now.now_ns,
            can_frames=tuple(self.can.read(self.clock.now_ns())),
            can=self.can.status,
            lidar_chunks=self._ear.take(),
            lidar_state=self.lidar.state,
        )
        outputs = machine.tick(inputs)
        self._write(outputs)
        self._recorder.write(inputs, outputs)

    def _write(self, outputs: Outputs) -> None:
        if outputs.lidar_connect:
            self.lidar.connect()
        self.can.write(outputs.can_frames)
        self.lidar.write(outputs.lidar_bytes)


def again(path: Path) -> CalibrationDrive:
    """The drive of a record: the same machine on the same inputs.

    Nothing was sent before `go`, so the first sent frame gives the time of `go`. Raises DamagedRecordError,
    FileNotFoundError.
    """
    rows = rows_of(path)
    _, inputs, recorded = next(rows)
    told = json.loads(recorded.get("/out/event", b"[]"))
    if not told or told[0]["name"] != DRIVEN:
        raise DamagedRecordError("`onboard calibrate` did not make it")
    side_m, _, words = told[0]["text"].partition(" ")
    drive = CalibrationDrive(config_of(path), float(side_m), WITH_LAG in words)
    drive.tick(inputs)
    for _, inputs, recorded in rows:
        if drive.phase is Phase.READY and "/out/can" in recorded:
            drive.go(inputs.now_ns)
        drive.tick(inputs)
    return drive
