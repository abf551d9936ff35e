"""Bus and wall clock of `onboard can`: open the bus, read it every 10 ms, close it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from types import TracebackType

from onboard.drivers.can.bus import open_bus
from onboard.drivers.platform.clock import WallClock
from onboard.records import Frame, PortState


class BusError(RuntimeError):
    """Loss of the bus while in use: one line."""


class CanShell:
    """One bus while the `with` lasts. Raises what `open_bus` raises: ConfigError for an invalid URI, OSError."""

    def __init__(self, uri: str, clock: WallClock) -> None:
        self.uri, self.clock = uri, clock
        self.bus = open_bus(uri)

    def __enter__(self) -> CanShell:
        self.clock.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.bus.close()

    def ticks(self, seconds: float = 0.0) -> Iterator[tuple[int, list[Frame]]]:
        """Time and the received frames, every 10 ms, for this many seconds (0: until the clock is asked to stop).

        Raises BusError if the other side closes the bus.
        """
        began_ns = self.clock.now_ns()
        while (tick := self.clock.wait()) is not None:
            frames = self.bus.read(tick.now_ns)
            if self.bus.state is PortState.CLOSED:
                raise BusError(f"{self.uri} is gone: its server has ended, or the interface was taken away")
            yield tick.now_ns, frames
            if seconds and tick.now_ns - began_ns >= seconds * 1e9:
                return

    def write(self, frames: Iterable[Frame]) -> None:
        """Send the frames; frames that the bus does not accept are dropped, because they would be too late."""
        self.bus.write(list(frames))
