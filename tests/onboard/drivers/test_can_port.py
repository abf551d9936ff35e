"""What a bus may do to the port: refuse, fill up, go down, go away, hang; each has its state, words and a way back."""

import errno
import socket
import threading

import can
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.devices.can.hub import CanHub
from onboard.drivers.can import bus as can_bus
from onboard.drivers.can.base import CanBus
from onboard.drivers.can.bus import CanPort
from onboard.drivers.can.socketcan import dbc_filters
from onboard.drivers.can.socketcand import DaemonBus
from onboard.records import BusTrouble, Frame, PortState
from onboard.records.status import BUS_CLOSED, BUS_WORDS
from protocol.generated.can_codec import TABLE

FRAMES = [Frame(0x101 + n % 4, bytes([n, 0, 0, 0, 0, 0, 0, 0])) for n in range(12)]


class Broken(can.BusABC):
    """A python-can bus that raises what the kernel's would. reads, writes: exceptions in order, None for none."""

    def __init__(self, reads=(), writes=()):
        self.reads, self.writes, self.taken, self.timeouts = list(reads), list(writes), [], set()

    def recv(self, timeout=None):
        self.timeouts.add(timeout)
        told = self.reads.pop(0) if self.reads else None
        if isinstance(told, Exception):
            raise told
        return told

    def send(self, msg, timeout=None):
        self.timeouts.add(timeout)
        told = self.writes.pop(0) if self.writes else None
        if told is not None:
            raise told
        self.taken.append(msg)

    def shutdown(self):
        pass


def refused(number):
    return can.CanOperationError("Failed to transmit: it says", number)


def error_frame(classes, detail=0):
    return can.Message(arbitration_id=classes, is_error_frame=True, is_extended_id=False, data=[0, detail, 0, 0])


# -- sending ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("error", [
    refused(errno.ENOBUFS), OSError(errno.ENOBUFS, "No buffer space available"),
    can.CanOperationError("Transmit buffer full"), BlockingIOError(errno.EAGAIN, "again"),
], ids=["python-can", "system", "python-can's timeout", "socket"])  # fmt: skip
def test_a_full_queue_drops_the_rest_of_the_tick_says_so_and_stays_open(error):
    raw = Broken(writes=[None, None, error])
    bus = CanBus(raw)
    assert bus.write(FRAMES[:5]) == 3
    assert bus.state is PortState.OPEN and "queue is full" in bus.error
    assert bus.write(FRAMES[5:8]) == 0 and bus.error == ""
    assert [m.data[0] for m in raw.taken] == [0, 1, 5, 6, 7]  # the newest, not the queue of before
    assert bus.sent == 5 and raw.timeouts == {0}


@pytest.mark.parametrize(("number", "state", "words"), [
    (errno.ENETDOWN, PortState.ERROR, "down"), (errno.ENODEV, PortState.CLOSED, "gone"),
    (errno.ENXIO, PortState.CLOSED, "gone"), (errno.EIO, PortState.ERROR, "it says"),
])  # fmt: skip
@pytest.mark.parametrize("kind", [refused, lambda number: OSError(number, "it says")], ids=["python-can", "system"])
def test_an_interface_down_is_an_error_and_one_that_is_gone_is_closed(kind, number, state, words):
    writing, reading = CanBus(Broken(writes=[kind(number)])), CanBus(Broken(reads=[kind(number)]))
    assert writing.write(FRAMES[:2]) == 2 and reading.read(0) == []
    for bus in (writing, reading):
        assert bus.state is state and words in bus.error


def test_an_interface_that_is_up_again_is_open_with_its_first_frame():
    frame = can.Message(arbitration_id=0x181, data=bytes(8), is_extended_id=False)
    bus = CanBus(Broken(reads=[refused(errno.ENETDOWN), frame]))
    assert bus.read(1) == [] and bus.state is PortState.ERROR
    assert len(bus.read(2)) == 1 and bus.state is PortState.OPEN and bus.error == ""


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 2)), max_size=25))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_a_write_waits_for_nobody_and_never_loses_the_order(course):
    """Ticks of `size` frames; then the far end reads `reads` pieces. Socket buffers of a few frames."""
    near, far = socket.socketpair()
    near.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    far.setblocking(False)
    bus, heard, put, failed = daemon(near), b"", [], 0
    with near, far:
        for size, reads in course:
            frames = [Frame(0x100 + len(put) + k & 0x7FF, bytes([k])) for k in range(size * 20)]
            refusals = bus.write(frames)
            assert refusals in (0, len(frames))
            put += frames[: len(frames) - refusals]
            failed += refusals
            heard += b"".join(drained(far) for _ in range(reads))
        while piece := drained(far):
            heard += piece
            bus.write([])
    assert heard.removeprefix(b"< echo >") == b"".join(f"< send {f.can_id:03X} 1 {f.data[0]:x} >".encode() for f in put)
    assert bus.sent == len(put) and bus.sent + failed == sum(size * 20 for size, _ in course)


def daemon(stream):
    """A DaemonBus on a socket of ours."""
    raw = Broken()
    raw._SocketCanDaemonBus__socket = NoDelay(stream)
    return DaemonBus(raw)


class NoDelay:
    """A UNIX socket that takes TCP's options for granted; a `send` that could wait fails the test."""

    def __init__(self, stream):
        self._stream = stream

    def __getattr__(self, name):
        return getattr(self._stream, name)

    def setsockopt(self, level, option, value):
        assert (level, option, value) == (socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data):
        assert self._stream.getblocking() is False
        return self._stream.send(data)


def drained(stream):
    try:
        return stream.recv(1 << 16)
    except BlockingIOError:
        return b""


# -- error frames ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("classes", "detail", "kind"), [
    (0x40, 0, BusTrouble.BUS_OFF), (0x44, 0x30, BusTrouble.BUS_OFF), (0x100, 0, BusTrouble.RESTARTED),
    (0x4, 0x10, BusTrouble.PASSIVE), (0x4, 0x20, BusTrouble.PASSIVE), (0x4, 0x04, BusTrouble.WARNING),
    (0x4, 0x40, BusTrouble.ACTIVE), (0x4, 0x01, BusTrouble.OVERFLOW), (0x8, 0, BusTrouble.BUS_ERROR),
    (0x80, 0, BusTrouble.BUS_ERROR), (0x88, 0, BusTrouble.BUS_ERROR), (0x20, 0, BusTrouble.NO_ACK),
    (0x1, 0, BusTrouble.OTHER), (0x4, 0, BusTrouble.OTHER),
])  # fmt: skip
def test_each_kind_of_error_frame_is_counted_under_its_name(classes, detail, kind):
    bus = CanBus(Broken(reads=[error_frame(classes, detail)]))
    assert bus.read(0) == [] and bus.received == 1
    assert [BusTrouble(k) for k, count in enumerate(bus.errors) if count] == [kind]
    assert bus.error == BUS_WORDS.get(kind, "")
    assert bus.state is (PortState.ERROR if kind is BusTrouble.BUS_OFF else PortState.OPEN)


def test_error_passive_holds_through_frames_until_the_controller_is_active():
    frame = can.Message(arbitration_id=0x181, data=bytes(8), is_extended_id=False)
    course = [error_frame(0x4, 0x10), frame, error_frame(0x80), frame]
    bus = CanBus(Broken(reads=course))
    bus.read(0)
    assert bus.error == BUS_WORDS[BusTrouble.PASSIVE]
    bus._bus.reads = [error_frame(0x4, 0x40)]
    bus.read(0)
    assert bus.error == ""


def test_errors_on_the_wire_with_no_frame_between_point_at_the_bit_rate():
    bus = CanBus(Broken(reads=[error_frame(0x88)] * 50))
    assert bus.read(0) == [] and "bit rate" in bus.error and bus.errors[BusTrouble.BUS_ERROR] == 50


def test_the_hub_brings_the_controllers_state_through_the_client():
    with OpenHub() as (hub, port):
        for classes, detail, kind in ((0x4, 0x30, BusTrouble.PASSIVE), (0x4, 0x40, BusTrouble.ACTIVE)):
            hub.write_error(classes, detail)
            assert port.read_upto(port.received + 1, [0], 5.0) == []
            assert port.status.error_frames[kind] == 1
        assert port.status.error == ""


# -- opening again -----------------------------------------------------------------------------------------------


class OpenHub:
    """A hub and a port on it; the hub is served beside while the port opens."""

    def __enter__(self):
        self.hub = CanHub()
        self.port = self._served(lambda: CanPort(self.hub.uri))
        return self.hub, self.port

    def _served(self, action):
        made = []
        thread = threading.Thread(target=lambda: made.append(action()))
        thread.start()
        while not self.hub.live:
            self.hub.wait(5.0)
        thread.join()
        return made[0]

    def __exit__(self, *_):
        self.port.close()
        self.hub.close()


def test_a_server_that_hangs_up_is_closed_and_opened_again_on_request():
    with OpenHub() as (hub, port):
        hub.write(FRAMES[:2])
        assert len(port.read_upto(2, [0, 0], 5.0)) == 2
        hub.disconnect(0)
        while port.state is PortState.OPEN:
            port.read(0)
        assert port.write(FRAMES[:3]) == 3 and "closed the connection" in port.status.error
        port.connect()
        hub.wait_client(1, 5.0)
        assert port.wait_open(5.0) is PortState.OPEN and port.received == port.sent == 0
        port.write(FRAMES[:3])
        assert len(hub.read_upto(1, 3, 5.0)) == 3
        status = port.status
        assert (status.error, status.send_failures, status.openings) == ("", 3, 2)


def test_a_server_that_is_not_there_is_a_status_and_not_the_end():
    hub = CanHub()
    hub.listen(False)
    port = CanPort(hub.uri)
    assert port.state is PortState.CLOSED and "cannot be opened" in port.status.error
    assert port.read(0) == [] and port.write(FRAMES[:2]) == 2
    hub.listen(True)
    port.connect()
    hub.wait_client(0, 5.0)
    assert port.wait_open(5.0) is PortState.OPEN and port.status.openings == 2
    port.close()
    hub.close()


def test_an_attempt_that_hangs_holds_nobody_up_and_what_it_opens_late_is_closed(monkeypatch):
    buses, gates, begun = [], [threading.Event(), threading.Event()], threading.Semaphore(0)

    def opening():
        bus, gate = CanBus(Broken()), gates[len(buses)]
        buses.append(bus)
        begun.release()
        gate.wait()
        return bus

    gates[0].set()
    monkeypatch.setattr(can_bus, "_opener", lambda uri, filtered: opening)
    port = CanPort("virtual:slow")
    gates[0] = threading.Event()
    gates += [threading.Event()]
    begun.acquire()
    port.connect()
    begun.acquire()
    assert port.state is PortState.CLOSED and port.read(0) == [] and port.status.error == BUS_CLOSED
    hanging = port._attempt.thread
    port.connect()  # gives the hanging one up
    begun.acquire()
    gates[2].set()
    assert port.wait_open(5.0) is PortState.OPEN
    gates[1].set()
    hanging.join()
    assert [bus.state for bus in buses] == [PortState.CLOSED, PortState.CLOSED, PortState.OPEN]


def test_counts_of_errors_live_longer_than_a_bus(monkeypatch):
    monkeypatch.setattr(can_bus, "_opener", lambda uri, filtered: lambda: CanBus(Broken(reads=[error_frame(0x40)])))
    port = CanPort("virtual:again")
    for _ in range(2):
        port.read(0)
        port.connect()
        port.wait_open(5.0)
    assert port.status.error_frames[BusTrouble.BUS_OFF] == 2


# -- the kernel's filter -------------------------------------------------------------------------------------------


def test_the_kernels_filter_passes_the_blocks_of_the_dbc_and_nothing_else():
    passed = {i for i in range(0x800) if any(i & f["can_mask"] == f["can_id"] & f["can_mask"] for f in dbc_filters())}
    assert set(TABLE) <= passed
    assert {i >> 4 for i in passed} == {i >> 4 for i in TABLE}
    assert all(f["extended"] is False for f in dbc_filters())
