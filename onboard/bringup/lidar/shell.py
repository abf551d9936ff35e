"""Port, clock and record around the flight session: the `onboard run` of the scanner alone."""

from __future__ import annotations

from collections.abc import Iterator
from types import TracebackType

from onboard.bringup.lidar.core import LidarCore, SessionOrder
from onboard.config import Config
from onboard.drivers.lidar.byte_listener import LidarEar
from onboard.drivers.lidar.port import open_port
from onboard.drivers.platform.clock import WallClock
from onboard.record.writer import Recorder
from onboard.records import Inputs, PortState, Scan
from protocol.barrier import Tick

READY_S, FAREWELL_TICKS = 10.0, 100


class SensorError(RuntimeError):
    """Sensor that cannot be used: one line with the reason and what to do.

    wrong_model: the sensor is not the configured model.
    """

    def __init__(self, text: str, wrong_model: bool = False) -> None:
        super().__init__(text)
        self.wrong_model = wrong_model


class LidarShell:
    """One sensor while the `with` lasts; at its end the sensor is quiet and its laser off, if it still answers.

    Raises ConfigError for an invalid address.
    """

    def __init__(self, config: Config, clock: WallClock, recorder: Recorder | None = None) -> None:
        self.config, self.clock, self.recorder = config, clock, recorder
        self.port = open_port(config.lidar.address, "ADDRESS")
        self.core = LidarCore(config)
        self.session = self.core.session
        self._ear = LidarEar(self.port, clock.now_ns)
        self.now_ns = 0

    def __enter__(self) -> LidarShell:
        self.clock.idle = self._ear.listen
        self.clock.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        order = SessionOrder.FAREWELL
        for now in self.clock.overtime(FAREWELL_TICKS if self.port.state is PortState.OPEN else 0):
            self._at(now, order)
            order = SessionOrder.NONE
            if self.session.dark:
                break
        self.port.close()

    def tick(self, order: SessionOrder = SessionOrder.NONE) -> list[Scan] | None:
        """Wait for the next tick; return its scans, or None if a stop was requested."""
        now = self.clock.wait()
        return None if now is None else self._at(now, order)

    def _at(self, now: Tick, order: SessionOrder) -> list[Scan]:
        self.now_ns = now.now_ns
        inputs = Inputs(now.number, now.now_ns, lidar_chunks=self._ear.take(), lidar_state=self.port.state)
        outputs, scans = self.core.tick(inputs, order)
        if outputs.lidar_connect:
            self.port.connect()
        self.port.write(outputs.lidar_bytes)
        if self.recorder is not None:
            self.recorder.write(inputs, outputs)
        return scans

    def until_ready(self, limit_s: float = READY_S) -> bool:
        """Tick until the sensor has identified itself.

        Returns False if a stop was requested. Raises SensorError if the sensor does not identify itself in time.
        """
        while not self.session.ready:
            if self.tick() is None:
                return False
            if self.port.state is PortState.ERROR:
                raise SensorError(self._refusal())
            self._complain()
            if self.now_ns > limit_s * 1e9:
                raise SensorError(f"{self.config.lidar.address} did not say who it is within {limit_s:g} s")
        return True

    def stream(self, seconds: float, scans: int = 0) -> Iterator[list[Scan]]:
        """The scans of each tick of a stream, until enough (0: no limit) or a stop is requested. Raises SensorError."""
        began_ns, taken, order = self.now_ns, 0, SessionOrder.STREAM
        while not (scans and taken >= scans) and not (seconds and self.now_ns - began_ns >= seconds * 1e9):
            found, order = self.tick(order), SessionOrder.NONE
            if found is None:
                return
            self._complain()
            taken += len(found)
            yield found

    @property
    def trouble(self) -> str:
        """Reason why no scans come now; empty while they come."""
        if self.port.state is not PortState.OPEN or not self.session.ready:
            return "gone: unplugged or closed; trying again"
        return "silent: no scans come" if self.session.silent(self.now_ns) else ""

    def _refusal(self) -> str:
        if self.port.received and not self.session.counts["replies"]:
            return f"{self.port.address} answered, but not in SCIP: is this a Hokuyo?"
        if self.port.epoch and not self.session.counts["replies"] and self.port.address.startswith("tcp:"):
            return f"{self.port.address} closed without an answer in SCIP: is this a Hokuyo, has it another client?"
        return self.port.error

    def _complain(self) -> None:
        if self.session.complaint:
            raise SensorError(self.session.complaint, "lidar.model" in self.session.complaint)
