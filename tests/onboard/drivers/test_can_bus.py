"""The bus contract, over every kind of bus that needs no kernel module, with real sockets."""

import socket
import threading
import time

import can
import pytest
from can.interfaces.virtual import VirtualBus

from hil.devices.can.hub import QUEUE_BYTES, CanHub
from onboard.config import ConfigError
from onboard.drivers.can.bus import open_bus
from onboard.drivers.can.socketcan import KernelBus
from onboard.records import Frame, PortState

FRAMES = [Frame(0x100 + n, bytes([n, 0, 0xFF, 1, 2, 3, 4, 5]), 1_000_000 * n) for n in range(30)]


class Hub:
    """The far end over a socketcand hub, its handshake run beside the blocking client."""

    def __init__(self):
        self.hub = CanHub()
        self.uri = self.hub.uri

    def open(self):
        opened = []
        thread = threading.Thread(target=lambda: opened.append(open_bus(self.uri)))
        before = self.hub.live
        thread.start()
        while self.hub.live == before:
            self.hub.wait(5.0)
        thread.join()
        return opened[0]

    def write(self, frames):
        self.hub.write(frames)

    def read(self, total):
        return self.hub.read_upto(0, total, 5.0)

    def close(self):
        self.hub.close()


class Virtual:
    """The far end as another bus of the same name."""

    uri = "virtual:contract"

    def __init__(self):
        self.bus = open_bus(self.uri)

    def open(self):
        return open_bus(self.uri)

    def write(self, frames):
        self.bus.write(frames)

    def read(self, total):
        return self.bus.read_upto(total, [0] * (total - self.bus.received), 5.0)

    def close(self):
        self.bus.close()


class Kernel(Virtual):
    """The far end on the kernel's virtual interface, where there is one."""

    uri = "socketcan:vcan0"

    def __init__(self):
        try:
            super().__init__()
        except OSError as error:
            pytest.skip(str(error))


@pytest.fixture(params=[Hub, Virtual, Kernel])
def ends(request):
    far = request.param()
    near = far.open()
    yield far, near
    near.close()
    far.close()


def pieces(frames):
    return [(f.can_id, f.data) for f in frames]


# -- the contract ----------------------------------------------------------------------------------------------


def test_an_idle_bus_gives_nothing_and_stays_open(ends):
    _, near = ends
    assert near.read(5) == [] and near.state is PortState.OPEN and near.received == near.sent == 0


def test_lock_step_reads_exactly_the_counted_frames_with_their_stamps(ends):
    far, near = ends
    far.write(FRAMES)
    assert near.read_upto(0, [], 5.0) == []
    first = near.read_upto(11, range(100, 111), 5.0)
    rest = near.read_upto(30, range(19), 5.0)
    assert pieces(first + rest) == pieces(FRAMES)
    assert [f.stamp_ns for f in first] == [us * 1000 for us in range(100, 111)]
    assert near.received == 30


def test_lock_step_names_the_missing_frames_when_they_do_not_come(ends):
    far, near = ends
    far.write(FRAMES[:2])
    with pytest.raises(TimeoutError, match="2 of 3 frames"):
        near.read_upto(3, [0, 0, 0], 0.05)
    with pytest.raises(ValueError, match="1 stamps"):
        near.read_upto(9, [0], 0.05)


def test_written_frames_arrive_whole_and_in_order(ends):
    far, near = ends
    assert near.write(FRAMES) == 0 and near.write([]) == 0
    assert pieces(far.read(30)) == pieces(FRAMES) and near.sent == 30


def test_short_frames_cross_as_they_are(ends):
    far, near = ends
    short = [Frame(0x7FF, b""), Frame(0, b"\x00"), Frame(0x20, b"\x0a\x00\x0b")]
    near.write(short)
    far.write(short)
    assert pieces(far.read(3)) == pieces(near.read_upto(3, [0, 0, 0], 5.0)) == pieces(short)


def test_a_closed_bus_takes_and_gives_nothing(ends):
    _, near = ends
    near.close()
    assert near.state is PortState.CLOSED and near.read(0) == [] and near.write(FRAMES[:2]) == 2


# -- socketcand ------------------------------------------------------------------------------------------------


@pytest.fixture
def hub():
    far = Hub()
    yield far
    far.close()


def test_end_of_file_is_found_after_the_last_frame(hub):
    near = hub.open()
    hub.write(FRAMES)
    hub.close()
    assert pieces(near.read_upto(31, [0] * 31, 5.0)) == pieces(FRAMES)
    assert near.state is PortState.CLOSED and near.write(FRAMES[:1]) == 1


def test_the_loss_of_a_client_is_a_state_of_the_hub(hub):
    near = hub.open()
    near.write(FRAMES[:3])
    near.close()
    with pytest.raises(ConnectionError, match="after 3 of 4"):
        hub.read(4)
    assert hub.hub.clients == ((0, PortState.CLOSED, 0, 3, 0),) and hub.hub.live == 0


def test_a_client_that_does_not_read_blocks_nobody_and_its_queue_is_bounded(hub):
    near = hub.open()
    batch = FRAMES * 200
    for _ in range(200):
        hub.write(batch)
        if hub.hub.clients[0].dropped:
            break
    state = hub.hub.clients[0]
    assert state.dropped and state.state is PortState.OPEN and QUEUE_BYTES < 1e6
    near.close()


def test_a_write_to_a_peer_that_does_not_read_returns_the_failures(hub):
    near = hub.open()
    failures = 0
    for _ in range(3000):
        failures = near.write(FRAMES * 20)
        if failures:
            break
    assert failures == 600 and near.state is PortState.OPEN
    near.close()


def test_frames_of_one_client_reach_the_other_and_the_hub(hub):
    one, two = hub.open(), hub.open()
    one.write(FRAMES[:4])
    assert pieces(hub.read(4)) == pieces(two.read_upto(4, [0] * 4, 5.0)) == pieces(FRAMES[:4])
    assert one.read(0) == []
    one.close()
    two.close()


def shaken(hub):
    """A socket past the handshake that has not said its first word in raw mode."""
    host, port = hub.uri.split("/")[0].split(":")[1:]
    stream = socket.create_connection((host, int(port)))
    for word in (b"< open rover >", b"< rawmode >"):
        stream.sendall(word)
        hub.hub.wait(5.0)
    return stream


def test_no_frame_follows_the_handshake_before_the_clients_first_word(hub):
    with shaken(hub) as stream:
        hub.write(FRAMES)
        hub.hub.poll()
        assert hub.hub.live == 0
        assert stream.recv(4096) == b"< hi >< ok >< ok >"


def test_a_client_that_has_said_its_first_word_is_live_at_the_next_write(hub):
    with shaken(hub) as stream:
        stream.sendall(b"< echo >")
        hub.write(FRAMES[:5])
        assert hub.hub.live == 1 and hub.hub.clients[0].sent == 5


def test_bus_off_is_a_state_until_the_controller_restarts_or_a_frame_comes(hub):
    near = hub.open()
    hub.hub.write_error(0x40)
    assert near.read_upto(1, [0], 5.0) == [] and near.state is PortState.ERROR and near.error_frames == 1
    hub.hub.write_error(0x100)
    assert near.read_upto(2, [0], 5.0) == [] and near.state is PortState.OPEN
    hub.hub.write_error(0x40)
    hub.write(FRAMES[:1])
    assert len(near.read_upto(4, [0, 0], 5.0)) == 1 and near.state is PortState.OPEN


def test_another_bus_name_is_refused_with_the_right_one(hub):
    raised = []

    def connect():
        try:
            open_bus(hub.uri.replace("/rover", "/other"))
        except OSError as error:
            raised.append(str(error))

    thread = threading.Thread(target=connect)
    thread.start()
    while thread.is_alive():
        hub.hub.wait(0.01)
    assert "no bus other here, it is rover" in raised[0]


def test_noise_from_a_client_is_counted_and_the_next_frame_read(hub):
    with shaken(hub) as stream:
        noise = b"\xff\x00< send zz 1 1 >< send 101 2 1 >< what >"
        for byte in noise + b"< send 101 2 1 2a >":
            stream.sendall(bytes([byte]))
            hub.hub.poll()
        got = hub.read(1)
    assert pieces(got) == [(0x101, b"\x01\x2a")] and hub.hub.malformed == 3


# -- opening ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("uri", ["", "can0", "socketcan:", "socketcand:h/can0", "socketcand:h:1", "virtual:", "x:y"])
def test_a_uri_of_another_form_is_refused_naming_the_three_forms(uri):
    with pytest.raises(ConfigError, match="socketcan:INTERFACE, socketcand:HOST:PORT/BUS or virtual:NAME"):
        open_bus(uri)


def test_a_missing_interface_names_vcan_and_the_alternative():
    with pytest.raises(OSError, match=r"(?s)socketcan:nocan9 .*type vcan.*socketcand:HOST:PORT/BUS"):
        open_bus("socketcan:nocan9")


def test_a_hub_that_is_not_there_is_refused_at_once():
    with CanHubPort() as port, pytest.raises(OSError, match=f"socketcand:127.0.0.1:{port}/rover cannot be opened"):
        open_bus(f"socketcand:127.0.0.1:{port}/rover")


class CanHubPort:
    """A port on which nobody listens."""

    def __enter__(self):
        self.socket = socket.socket()
        self.socket.bind(("127.0.0.1", 0))
        return self.socket.getsockname()[1]

    def __exit__(self, *_):
        self.socket.close()


def test_the_kernels_stamps_count_back_from_the_reading(monkeypatch):
    bus = KernelBus(VirtualBus("stamps"))
    monkeypatch.setattr(time, "time", lambda: 100.0)
    message = can.Message(timestamp=99.996)
    assert bus._stamp_ns(message, 5_000_000_000) == pytest.approx(4_996_000_000, abs=1000)
    bus.close()


@pytest.mark.parametrize("jump_s", [3.2e8, -3.2e8, 0.0])
def test_a_clock_that_is_set_between_stamp_and_reading_moves_a_stamp_by_a_tick_at_most(monkeypatch, jump_s):
    name = f"set{jump_s}"
    bus, node = KernelBus(VirtualBus(name)), VirtualBus(name)
    assert bus.read(4_990_000_000) == []
    node.send(can.Message(arbitration_id=0x181, data=bytes(8), is_extended_id=False))
    now_s = time.time()
    monkeypatch.setattr(time, "time", lambda: now_s + jump_s)
    (frame,) = bus.read(5_000_000_000)
    assert 4_990_000_000 <= frame.stamp_ns <= 5_000_000_000
    bus.close()
    node.shutdown()
