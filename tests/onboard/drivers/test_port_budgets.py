"""No port holds a tick up: what floods is read in parts, found as a fault of its device, and nothing else notices."""

from __future__ import annotations

import socket
from itertools import count

import can
import pytest

from onboard.app import WallPorts
from onboard.config import Can, Rover
from onboard.core.faults.can import MONITORS
from onboard.devices.nodes import Nodes
from onboard.drivers.can.base import CanBus
from onboard.drivers.can.bus import CanPort
from onboard.drivers.lidar.byte_listener import LidarEar
from onboard.drivers.lidar.port import open_port
from onboard.drivers.link.port import LinkPort
from onboard.records import Chunk, Frame, Machine, PortState
from protocol.barrier import Tick
from protocol.can.guard import Sender
from protocol.conventions import TICK_NS
from protocol.link.datagrams import DatagramKind, Sealer, bench_keys
from tests.onboard.lidar_rig import Rig

FEEDBACK_1 = 0x181
KEYS = bench_keys(7)


# -- the scanner's port ------------------------------------------------------------------------------------------


@pytest.fixture
def scanner():
    """(port, the other end) of a TCP connection."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = open_port(f"tcp:127.0.0.1:{server.getsockname()[1]}")
        port.connect()
        far, _ = server.accept()
        assert port.wait_open(5.0) is PortState.OPEN
        with far:
            yield port, far
        port.close()


def fill(far: socket.socket, data: bytes) -> int:
    """Sends until the line takes no more; the bytes that it took."""
    far.setblocking(False)
    sent = 0
    try:
        while True:
            sent += far.send(data)
    except BlockingIOError:
        return sent


def test_a_scanner_that_sends_without_pause_is_read_in_parts_at_no_more_than_2_mb_a_second(scanner):
    port, far = scanner
    waiting = fill(far, bytes(1 << 16))
    got = 0
    for tick in range(100):
        got += sum(len(chunk.data) for chunk in port.read(tick * TICK_NS))
        waiting += fill(far, bytes(1 << 16))
    assert waiting > 2_300_000  # there was more to be had
    assert 1_900_000 < got <= 2_000_000 + port.BURST_BYTES


def test_bytes_that_come_one_by_one_are_a_bounded_number_of_pieces_a_tick(scanner):
    port, far = scanner
    far.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    now = count(0, 10_000)
    ear = LidarEar(port, lambda: next(now))
    for _ in range(500):
        far.send(b"\n")
        ear.listen(0.0)
    assert 0 < len(ear.take()) <= 65


# -- the scanner's session ---------------------------------------------------------------------------------------


def flooded(rig: Rig, piece: bytes, ticks: int) -> int | None:
    """The tick, counted from the first, in which the flood is found."""
    before = rig.spoil
    rig.spoil = lambda data: data
    for n in range(ticks):
        rig.tick += 1
        rig.session.receive([Chunk(rig.now_ns, piece)], rig.state, rig.now_ns)
        rig.session.send(rig.now_ns)
        if rig.session.flood.flooded:
            return n + 1
    rig.spoil = before
    return None


@pytest.mark.parametrize(
    "piece",
    [b"\n" * 20_000, b"x\n\n" * 6_666, b"a" * 20_000, b"x\n\n" * 100],
    ids=["feeds", "frames", "noise", "few frames"],
)
def test_a_scanner_that_floods_is_found_within_half_a_second(piece):
    rig = Rig()
    rig.session.stream(True)
    assert rig.run(300, lambda: rig.session.counts["scans"] > 20)
    assert not rig.session.flood.flooded
    assert flooded(rig, piece, 50)


def test_frames_over_64_in_a_tick_are_dropped_and_counted():
    rig = Rig()
    assert rig.run(300, lambda: rig.session.ready)
    before = rig.session.counts.copy()
    rig.session.receive([Chunk(rig.now_ns, b"x\n\n" * 1000)], rig.state, rig.now_ns)
    taken = sum(rig.session.counts[name] - before[name] for name in before)
    assert taken <= 70
    assert rig.session.flood.dropped_bytes >= 3 * (1000 - 64)


def test_while_a_scanner_floods_its_bytes_are_dropped_and_after_it_the_scans_come_again():
    rig = Rig()
    rig.session.stream(True)
    assert rig.run(300, lambda: rig.session.counts["scans"] > 20)
    assert flooded(rig, b"x\n\n" * 6_666, 50)
    before = rig.session.bad
    rig.session.receive([Chunk(rig.now_ns, b"x\n\n" * 6_666)], rig.state, rig.now_ns)
    assert rig.session.bad == before
    scans = rig.session.counts["scans"]
    assert rig.run(600, lambda: not rig.session.flood.flooded)
    assert rig.run(600, lambda: rig.session.counts["scans"] > scans + 20)


def test_a_real_scanner_at_its_fastest_is_no_flood_nor_is_what_waited_for_a_second():
    rig = Rig()
    rig.session.stream(True)
    scan = b"z" * 22_000 + b"\n\n"  # NE with three echoes, 40 a second
    for n in range(400):
        rig.tick += 1
        rig.session.receive([Chunk(rig.now_ns, scan)] if n % 5 in (0, 2) else [], PortState.OPEN, rig.now_ns)
        assert not rig.session.flood.flooded
    rig.tick += 100
    rig.session.receive([Chunk(rig.now_ns, b"z" * 3_300 + b"\n\n")] * 39, PortState.OPEN, rig.now_ns)
    assert not rig.session.flood.flooded and rig.session.flood.dropped_bytes == 0


# -- the bus -------------------------------------------------------------------------------------------------------


class Endless(can.BusABC):
    """A bus on which there is always one more frame."""

    def __init__(self) -> None:
        self.taken = 0

    def recv(self, timeout=None):
        self.taken += 1
        assert self.taken < 200_000, "the read has no bound"
        return can.Message(arbitration_id=self.taken % 0x7FF, data=bytes(8), is_extended_id=False)

    def send(self, msg, timeout=None):
        pass

    def shutdown(self):
        pass


def test_a_bus_that_streams_without_pause_is_read_in_parts():
    bus = CanBus(Endless())
    got = [len(bus.read(tick * TICK_NS)) for tick in range(1, 101)]
    assert max(got) <= bus.BURST_FRAMES
    assert sum(got) <= bus.FRAMES_PER_S + bus.BURST_FRAMES


def test_a_read_of_the_bus_ends_when_its_time_is_used_up():
    bus = CanBus(Endless())
    ns = count(0, 1_000_000)
    bus.clock_ns = lambda: next(ns)  # a millisecond passes at each look
    bus.read(0)
    assert len(bus.read(TICK_NS)) <= 64 * 5


def test_after_a_pause_of_a_second_all_that_waited_comes_in_one_tick():
    class Waiting(Endless):
        def recv(self, timeout=None):
            return super().recv() if self.taken < 900 else None

    bus = CanBus(Waiting())
    bus.clock_ns = lambda: 0
    assert len(bus.read(1_000_000_000)) == 900


def test_frames_that_waited_while_the_program_opened_are_forgotten_in_bounded_time():
    port = CanPort("virtual:forget")
    endless = Endless()
    port._bus = CanBus(endless)
    port.forget()
    assert 0 < endless.taken <= 50_000


@pytest.mark.parametrize("ids", [[0x123], range(0x100, 0x500)], ids=["one id", "a thousand ids"])
def test_more_frames_than_a_bus_can_carry_are_found_within_its_time(ids):
    nodes, ids = Nodes(Rover(), Can()), list(ids)
    for tick in range(1, 21):
        frames = [Frame(ids[(tick * 80 + n) % len(ids)], bytes(8), tick * TICK_NS) for n in range(80)]
        nodes.receive(frames, tick * TICK_NS)
        if MONITORS["CAN_BABBLE"](nodes):
            return
    pytest.fail("not found in 0.2 s")


# -- lateness ------------------------------------------------------------------------------------------------------


class LateClock:
    """A clock that has gone past the tick's time."""

    def __init__(self, late_ns: int) -> None:
        self.tick_ns, self.late_ns, self.slipped_ticks = 0, late_ns, 0

    def now_ns(self) -> int:
        return self.tick_ns + self.late_ns


class NoLink:
    state = PortState.CLOSED

    def read(self, stamp_ns):
        return ()


class NoProbe:
    def take(self) -> Machine | None:
        return None


def test_frames_that_a_late_tick_reads_are_never_from_the_future():
    clock, sender = LateClock(50_000_000), Sender()
    port, far = CanPort("virtual:late"), CanPort("virtual:late")
    port.wait_open(5.0), far.wait_open(5.0)
    ports = WallPorts(port, open_port("tcp:127.0.0.1:1"), NoLink(), clock, NoProbe())
    nodes = Nodes(Rover(), Can())
    for tick in range(1, 101):
        clock.tick_ns = tick * TICK_NS
        far.write([Frame(FEEDBACK_1, sender.encode(FEEDBACK_1, 0.0, tick, 0.1, 1))])
        inputs = ports.read(Tick(tick, clock.tick_ns, ()))
        assert len(inputs.can_frames) == 1
        nodes.receive(inputs.can_frames, inputs.now_ns, inputs.can)
    assert nodes.from_future == 0 and not MONITORS["CAN_CORRUPT"](nodes)
    port.close(), far.close()


# -- the link --------------------------------------------------------------------------------------------------------


class Crowd:
    """A link's end at which forged datagrams wait without end; `genuine`: datagrams behind so many of them."""

    open, failed, linked, emptied = True, False, True, False

    def __init__(self, forged: bytes, ahead: int, genuine: bytes) -> None:
        self.forged, self.ahead, self.genuine, self.taken = forged, ahead, genuine, 0

    def knock(self) -> None:
        pass

    def close(self) -> None:
        pass

    def take(self, most: int) -> list[bytes]:
        got = [self.genuine if self.taken + n == self.ahead else self.forged for n in range(most)]
        self.taken += most
        return got


@pytest.fixture
def crowded():
    forged = Sealer(bytes(32), 1, 3).seal(DatagramKind.TELECOMMAND, bytes(900))
    genuine = Sealer(KEYS.command.key(1), 1, 3).seal(DatagramKind.TELECOMMAND, b"stop")
    with LinkPort("tcp/127.0.0.1:1", KEYS, 3) as port:
        port._end.close()
        port._end = Crowd(forged, 2000, genuine)
        yield port


def test_a_tick_takes_a_bounded_number_of_datagrams_and_a_genuine_one_comes_through(crowded):
    for tick in range(1, 2000):
        messages = crowded.read(tick * TICK_NS)
        assert len(messages) <= 512
        accepted = [message for message in messages if message.accepted]
        if accepted:
            assert accepted[0].payload == b"stop" and len(messages) > 1
            return
    pytest.fail("the genuine one never came")


def test_the_reading_of_datagrams_ends_when_its_time_is_used_up(crowded):
    ns = count(0, 1_000_000)
    crowded.clock_ns = lambda: next(ns)
    assert 0 < len(crowded.read(0)) <= 5 * 16
