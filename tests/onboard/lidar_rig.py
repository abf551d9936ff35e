"""Two ends for the session: the bench's sensor, and one that answers from a script."""

from __future__ import annotations

import numpy as np

from hil.devices.lidar import profile as profiles
from hil.devices.lidar import sensor
from onboard.config import Lidar as LidarConfig
from onboard.devices.lidar.session import LidarSession
from onboard.records import Chunk, PortState
from protocol import scip
from tests.protocol import wire
from tests.protocol.scip.test_scip import PP, VV

TICK_NS = 10_000_000
IDEAL_NS = profiles.stamp_to_first_byte_ns(profiles.IDEAL)
II = b"II\n00P\n" + b"".join(scip.text_line(*row) for row in (
    ("MODL", "UTM-30LX(Hokuyo Automatic Co.,Ltd.)"), ("LASR", "OFF"), ("SCSP", "Initial(2400[rpm])"), ("MESM", "IDLE"),
    ("SBPS", "USB Full Speed"), ("TIME", "4991D0"), ("STAT", "Sensor works well."),
)) + b"\n"  # fmt: skip


def room(times_ns):
    """Ranges 2 m to 4 m, and 3 beams of codes."""
    ranges_m = np.linspace(2.0, 4.0, len(times_ns))
    ranges_m[10], ranges_m[20], ranges_m[30] = np.inf, 0.05, 31.0
    return ranges_m


class Rig:
    """Sensor and session joined by a wire, one tick at a time."""

    def __init__(self, profile=profiles.IDEAL, cut=wire.whole, **config):
        self.session = LidarSession(LidarConfig(**{"latency_ns": IDEAL_NS, **config}))
        self.twin = sensor.Lidar(1, room, profile)
        self.cut, self.tick, self.refusing = cut, 0, False
        self.spoil = lambda data: data
        self.state, self.scans, self.up = PortState.CLOSED, [], b""
        self.asked = []

    @property
    def now_ns(self):
        return self.tick * TICK_NS

    def unplug(self):
        self.twin.disconnect()
        self.state = PortState.ERROR

    def run(self, ticks, until=lambda: False):
        for _ in range(ticks):
            self.tick += 1
            if self.up:
                self.twin.receive(self.up, self.now_ns - TICK_NS)
            self.twin.step(self.now_ns)
            pieces = [Chunk(t, p) for t, data in self.twin.send() for p in self.cut(self.spoil(data))]
            self.scans += self.session.receive(pieces, self.state, self.now_ns)
            self.up = self.session.send(self.now_ns)
            self.asked += [line for line in self.up.split(b"\n") if line]
            if self.session.wants_connect(self.now_ns) and not self.refusing:
                self.twin.connect()
                self.state = PortState.OPEN
            if until():
                return self.tick
        return None


# what a sensor may be in the middle of when the driver comes


def half_request(twin):
    twin.receive(b"MD00001080", 0)


def stray_stream(twin):
    twin.receive(b"MD0000108001000\n", 0)
    twin.connected = False


def time_adjustment(twin):
    twin.receive(b"TM0\n", 0)


class Script:
    """A sensor that answers each request from a table: bytes, or the next of a list; the tick after."""

    def __init__(self, replies=(), **config):
        self.replies = {b"QT": b"QT\n00P\n\n", b"VV": VV, b"PP": PP, b"II": II, **dict(replies)}
        self.session = LidarSession(LidarConfig(**{"latency_ns": IDEAL_NS, **config}))
        self.tick, self.asked, self.scans, self.down = 0, [], [], b""

    def run(self, ticks, until=lambda: False):
        for _ in range(ticks):
            self.tick += 1
            now_ns = self.tick * TICK_NS
            down, self.down = self.down, b""
            self.scans += self.session.receive([Chunk(now_ns, down)], PortState.OPEN, now_ns)
            for line in self.session.send(now_ns).split(b"\n"):
                if line:
                    self.asked.append(line)
                    self.down += self.answer(line)
            if until():
                return self.tick
        return None

    def answer(self, line):
        reply = self.replies.get(line, self.replies.get(line[:2], b""))
        if isinstance(reply, list):
            return reply.pop(0) if len(reply) > 1 else reply[0]
        return reply
