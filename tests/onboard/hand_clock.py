"""The wall clock's ticks with time by hand, between a real port and an emulated scanner on a real cable.

The hand lets a piece leave the sensor at its own time and moves on only when the port has read it; so stamps are those
of the wall clock's ports, tick after tick, and nothing depends on the machine.
"""

from __future__ import annotations

import numpy as np

from hil.devices.lidar import sensor
from hil.devices.lidar.profile import IDEAL
from onboard.drivers.platform.clock import WallClock
from onboard.records import PortState

REAL_LIMIT_S = 30.0


class HandClock(WallClock):
    """`idle` as the shell sets it is called with a long limit, when something was sent. A tick's work takes time."""

    def __init__(self, server, profile=IDEAL, cast=lambda times_ns: np.full(len(times_ns), 2.0), most_busy_ns=4e6):
        self.twin, self.server = sensor.Lidar(1, cast, profile), server
        server.poll()  # a client that was here before has gone
        self.time_ns, self.pieces, self.epoch = 0, [], server.epoch
        self.most_busy_ns, self.busy = most_busy_ns, np.random.default_rng(7)
        super().__init__()
        self.at_ns = {}  # time -> function of the clock

    @property
    def idle(self):
        return self.pass_time

    @idle.setter
    def idle(self, listen):
        self.listen = listen

    @property
    def port(self):
        return self.listen.__self__.port

    def start(self):
        pass

    def now_ns(self):
        return self.time_ns

    def wait(self):
        self.time_ns += int(0.5e6 + (self.most_busy_ns - 0.5e6) * self.busy.random())  # what the last tick took
        for time_ns in [t for t in self.at_ns if t <= self.time_ns]:
            self.at_ns.pop(time_ns)(self)
        return super().wait()

    def pass_time(self, left_s):
        """Up to the sensor's next piece, or to the end; what leaves while the computer works is read later."""
        until_ns = self.time_ns + round(left_s * 1e9)
        self.hear()
        self.twin.step(until_ns)
        self.pieces += self.twin.send()
        if not self.pieces:
            self.time_ns = until_ns
            return
        at_ns, data = self.pieces.pop(0)
        self.time_ns = max(self.time_ns, at_ns) + int(20_000 + self.busy.exponential(50_000))  # it wakes up
        before = self.port.received
        sent = self.server.write(data)
        while self.port.received < before + sent:
            self.listen(REAL_LIMIT_S)

    def hear(self):
        """What the client sent reaches the sensor; so does that it came."""
        if self.port.fileno() >= 0 and self.port.state is not PortState.OPEN:
            assert self.port.wait_open(REAL_LIMIT_S) is PortState.OPEN and self.server.wait_client(REAL_LIMIT_S)
        data = self.server.poll_exactly(self.port.sent, REAL_LIMIT_S) if self.port.state is PortState.OPEN else b""
        if self.server.epoch != self.epoch:
            self.epoch = self.server.epoch
            self.twin.connect()
        self.twin.receive(data, self.time_ns)
