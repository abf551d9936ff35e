"""The flight program's port on an interface of the kernel: filters, error frames with their data, down, gone and back.

Each test makes an interface of its own.
"""

import errno
import socket
import struct
import subprocess

import pytest

from onboard.drivers.can.bus import CanPort, open_bus
from onboard.records import BusTrouble, Frame, PortState
from onboard.records.status import BUS_WORDS
from protocol.generated.can_codec import TABLE
from tests.vcan.interface import ip_link

NAME, LIMIT_S = "vcan2", 30.0
ERROR_FLAG = 0x2000_0000
FRAMES = [Frame(can_id, bytes([k])) for k, can_id in enumerate(TABLE)]


def make():
    ip_link("add", "dev", NAME, "type", "vcan")
    ip_link("set", NAME, "up")


def there():
    return NAME in [name for _, name in socket.if_nameindex()]


@pytest.fixture(autouse=True)
def interface():
    make()
    yield
    if there():
        ip_link("del", NAME)


@pytest.fixture
def port():
    opened = CanPort(f"socketcan:{NAME}", filtered=True)
    yield opened
    opened.close()


class Node:
    """Another end of the wire: a raw socket."""

    def __init__(self):
        self.socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.socket.bind((NAME,))
        self.socket.settimeout(LIMIT_S)

    def put(self, can_id, data=bytes(8)):
        frame = struct.pack("=IB3x8s", can_id, len(data), data)
        try:
            self.socket.send(frame)
        except OSError as error:
            if error.errno != errno.ENETDOWN:
                raise
            self.socket.send(frame)  # the kernel tells each socket once that its interface was down

    def error(self, classes, detail=0):
        self.put(ERROR_FLAG | classes, bytes([0, detail, 0, 0, 0, 0, 0, 0]))

    def take(self):
        can_id, length, data = struct.unpack("=IB3x8s", self.socket.recv(16))
        return can_id, data[:length]


@pytest.fixture
def node():
    made = Node()
    yield made
    made.socket.close()


def heard(port, count):
    """The next frames, however late the kernel hands them over."""
    frames = []
    while len(frames) < count:
        port._bus._wait(LIMIT_S)
        frames += port.read(0)
    return frames


# -- the filter ----------------------------------------------------------------------------------------------------


def test_the_kernel_keeps_back_what_is_outside_the_blocks_of_the_dbc(port, node):
    for can_id in range(0x800):
        node.put(can_id)
        if can_id % 64 == 63:
            node.put(0x181, b"end")
            got = heard(port, 1)
            while got[-1].data != b"end":
                got += heard(port, 1)
            assert {f.can_id >> 4 for f in got} <= {i >> 4 for i in TABLE}
            assert {f.can_id for f in got} >= {i for i in TABLE if i >> 6 == can_id >> 6}


def test_error_frames_pass_the_filter(port, node):
    node.error(0x4, 0x10)
    node.put(0x181)
    assert len(heard(port, 1)) == 1
    assert port.status.error_frames[BusTrouble.PASSIVE] == 1


def test_without_a_filter_every_id_is_heard(node):
    bus = open_bus(f"socketcan:{NAME}")
    ids = list(range(0, 0x800, 9))  # 228: the kernel keeps 277 frames for a socket
    for can_id in ids:
        node.put(can_id)
    assert [f.can_id for f in bus.read_upto(len(ids), [0] * len(ids), LIMIT_S)] == ids
    bus.close()


# -- error frames ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("classes", "detail", "kind"), [
    (0x40, 0, BusTrouble.BUS_OFF), (0x100, 0, BusTrouble.RESTARTED), (0x4, 0x30, BusTrouble.PASSIVE),
    (0x4, 0x0C, BusTrouble.WARNING), (0x4, 0x40, BusTrouble.ACTIVE), (0x88, 0, BusTrouble.BUS_ERROR),
    (0x20, 0, BusTrouble.NO_ACK), (0x4, 0x01, BusTrouble.OVERFLOW),
])  # fmt: skip
def test_each_kind_of_error_frame_is_counted_and_named(port, node, classes, detail, kind):
    node.error(classes, detail)
    port._bus._wait(LIMIT_S)
    assert port.read(0) == []
    assert [BusTrouble(k) for k, count in enumerate(port.status.error_frames) if count] == [kind]
    assert port.status.error == BUS_WORDS.get(kind, "")
    assert port.state is (PortState.ERROR if kind is BusTrouble.BUS_OFF else PortState.OPEN)


# -- down, gone and back ---------------------------------------------------------------------------------------------


def test_an_interface_that_is_down_is_an_error_and_open_with_the_first_frame_when_it_is_up(port, node):
    ip_link("set", NAME, "down")
    port._bus._wait(LIMIT_S)
    assert port.read(0) == [] and port.state is PortState.ERROR and "down" in port.status.error
    assert port.write(FRAMES) == len(FRAMES) == port.status.send_failures
    ip_link("set", NAME, "up")
    node.put(0x181)
    assert len(heard(port, 1)) == 1
    assert port.state is PortState.OPEN and port.status.error == ""
    assert port.write(FRAMES) == 0


def test_a_port_opened_on_an_interface_that_is_down_says_so_and_comes_up_with_it(port, node):
    ip_link("set", NAME, "down")
    port.connect()
    port.wait_open(LIMIT_S)
    port._bus._wait(LIMIT_S)
    assert port.read(0) == [] and port.state is PortState.ERROR and "down" in port.status.error
    ip_link("set", NAME, "up")
    node.put(0x181)
    assert len(heard(port, 1)) == 1 and port.state is PortState.OPEN


def test_an_interface_that_is_gone_is_closed_and_comes_back_by_opening_it_anew(port):
    ip_link("del", NAME)
    port._bus._wait(LIMIT_S)
    assert port.read(0) == [] and port.state is PortState.CLOSED and "gone" in port.status.error
    assert port.write(FRAMES) == len(FRAMES)
    port.connect()
    assert port.wait_open(LIMIT_S) is PortState.CLOSED and "cannot be opened" in port.status.error
    make()
    port.connect()
    assert port.wait_open(LIMIT_S) is PortState.OPEN
    other = Node()
    assert port.write(FRAMES) == 0
    assert [other.take() for _ in FRAMES] == [(f.can_id, f.data) for f in FRAMES]
    other.socket.close()
    assert port.status.openings == 3 and port.status.send_failures == len(FRAMES)


def test_an_interface_that_is_missing_at_the_start_is_waited_for():
    ip_link("del", NAME)
    port = CanPort(f"socketcan:{NAME}", filtered=True)
    assert port.state is PortState.CLOSED and "cannot be opened" in port.status.error
    make()
    port.connect()
    assert port.wait_open(LIMIT_S) is PortState.OPEN
    port.close()


# -- sending -----------------------------------------------------------------------------------------------------------


def test_a_full_queue_refuses_keeps_the_order_and_takes_the_newest_when_it_drains(port, node):
    """vcan has no queue; a slow one is put before it: 4 frames at 8 kbit/s."""
    limit = ["root", "tbf", "rate", "8kbit", "burst", "32", "limit", "128"]
    done = subprocess.run(["tc", "qdisc", "add", "dev", NAME, *limit], check=False, capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"no token bucket here: {done.stderr.strip()}")
    numbered = [Frame(0x101, bytes([k])) for k in range(100)]
    refused = port.write(numbered)
    assert refused > 0 and port.state is PortState.OPEN and "queue is full" in port.status.error
    subprocess.run(["tc", "qdisc", "del", "dev", NAME, "root"], check=True)
    assert port.write([Frame(0x102, b"new")]) == 0 and port.status.error == ""
    came = []
    while not came or came[-1] != (0x102, b"new"):
        came.append(node.take())
    numbers = [data[0] for can_id, data in came if can_id == 0x101]
    assert numbers == sorted(set(numbers)) and len(numbers) <= 100 - refused
