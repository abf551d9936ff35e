"""The bench's rover standing on flat ground with a scanner like a real one, for `onboard lidar lag`."""

from dataclasses import replace

from hil.devices.lidar.profile import UTM30LX, stamp_to_first_byte_ns
from hil.devices.lidar.sensor import Lidar
from onboard.config import Config, Record, Rover
from onboard.records import Chunk, Frame, PortState
from protocol.barrier import Tick
from protocol.conventions import TICK_NS
from tests.onboard.calibrate_rig import Yard

REAL = replace(
    UTM30LX, rate_error=80e-6, motor_jitter_ns=20_000.0, dropout_ratio=0.01, start_ms=321.5, spike_ratio=0.02,
    spike_ns=5e6,
)  # fmt: skip
LATE_NS = 3_000_000
AXIS_S = 1e-4  # the axis's frames are on the bus for so long at least: its own times are as late


def standing_rover(terrain="flat", profile=REAL, seed=1, built=None):
    """A yard with that scanner."""
    world = Yard(built or Rover(), seed, terrain=terrain)
    world.lidar = Lidar(seed, world._cast, profile)
    return world


def believing(path, late_ns=LATE_NS, profile=REAL):
    """A configuration whose latency makes the scans' times late by late_ns."""
    own = Config()
    lidar = replace(own.lidar, latency_ns=stamp_to_first_byte_ns(profile) - late_ns)
    return replace(own, lidar=lidar, record=Record(str(path)))


class Port:
    """The scanner's port of a tool, in this process: what the world's scanner says and hears."""

    def __init__(self, world):
        self.world, self.written = world, []

    @property
    def state(self):
        return PortState.OPEN if self.world.lidar_open else PortState.CLOSED

    def connect(self):
        self.world.plug_in()

    def fileno(self):
        return -1

    def read(self, _now_ns):
        return [Chunk(*piece) for piece in self.world.lidar_says() or ()]

    def write(self, data):
        self.written.append(data)

    def close(self):
        pass


class RigClock:
    """As WallClock, time by hand: each tick the world goes on, its bus and its scanner with it."""

    def __init__(self, world, end, port):
        self.world, self.end, self.port = world, end, port
        self.stopping, self.number = False, 0

    def start(self):
        pass

    def now_ns(self):
        return self.number * TICK_NS

    def overtime(self, ticks):
        for _ in range(ticks):
            yield self.wait()

    def wait(self):
        self.number += 1
        assert self.number < 10_000, "the tool does not come to an end"
        now_ns, world = self.now_ns(), self.world
        world.tick = self.number
        if self.number > 1:  # the world stands at the first tick when it is made
            world.advance(now_ns)
        came = self.end.exchange(world.frames(), now_ns)
        written, self.port.written = b"".join(self.port.written), []
        world.hear([Frame(frame.can_id, frame.data, now_ns) for frame in came], written, now_ns)
        return None if self.stopping else Tick(self.number, now_ns, ())
