"""The wall clock's ticks with time by hand, and the rover on its stand at the far end of the bus."""

from __future__ import annotations

import signal
from contextlib import contextmanager

from hil.devices.can.wheels_off_ground import TICK_NS, Stand
from onboard.drivers.can.bus import open_bus
from protocol.barrier import Tick


class VirtualEnd:
    """The stand's end of a bus inside this process."""

    def __init__(self, name="stand"):
        self.uri = f"virtual:{name}"
        self._bus = open_bus(self.uri)

    def exchange(self, frames, now_ns):
        """Frames to the other end; those that came from it."""
        self._bus.write(frames)
        return self._bus.read(now_ns)

    def close(self):
        self._bus.close()


class StandClock:
    """As WallClock for `onboard can`. at: number of a tick -> function of this clock, before that tick."""

    def __init__(self, stand, end, at=None):
        self.stand, self.end, self.at = stand, end, dict(at or {})
        self.stopping, self.number = False, 0
        self.heard = []  # all that the tool sent
        self._waiting = []

    def start(self):
        pass

    def now_ns(self):
        return self.number * TICK_NS

    def overtime(self, ticks):
        for _ in range(ticks):
            yield self.wait()

    def wait(self):
        self.number += 1
        assert self.number < 5000, "the tool does not come to an end"
        self.at.pop(self.number, lambda _: None)(self)
        if self.stopping:
            return None
        now_ns = self.now_ns()
        came = self.end.exchange(self.stand.step(self._waiting, now_ns), now_ns)
        self._waiting = came
        self.heard += came
        return Tick(self.number, now_ns, ())


def beats(count, stand=None):
    """The frames of a stand that nobody commands, tick after tick."""
    stand = stand or Stand()
    return [(n * TICK_NS, stand.step((), n * TICK_NS)) for n in range(1, count + 1)]


@contextmanager
def handlers_kept():
    """Signal handlers as they were before, whatever a command sets."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
