"""Rover's and bench's ends of a CAN interface of the kernel: order, counts, error frames, down, up, gone."""

import os
import socket
import struct
import subprocess
from contextlib import closing

import pytest

from hil.devices.can.socket import CanSocket, NoInterfaceError
from onboard.drivers.can.bus import open_bus
from onboard.records import Frame, PortState
from tests.vcan.interface import ip_link, virtual_can

BUS_OFF, RESTARTED, ERROR_FLAG = 0x40, 0x100, 0x2000_0000  # linux/can/error.h, linux/can.h
FRAMES = [Frame(0x010 + n, bytes([n]) * (n % 9)) for n in range(40)]
CAN_RAW_ERR_FILTER = 2  # linux/can/raw.h; not every Python names it
LIMIT_S = 30.0


@pytest.fixture
def interface():
    with virtual_can("vcan1") as name:
        yield name


@pytest.fixture
def rover(interface):
    bus = open_bus(f"socketcan:{interface}")
    yield bus
    bus.close()


@pytest.fixture
def wire(interface):
    bench = CanSocket(f"socketcan:{interface}")
    yield bench
    bench.close()


@pytest.fixture
def raw(interface):
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as anyone:
        anyone.bind((interface,))
        yield anyone


def send_error(raw, flags):
    raw.send(struct.pack("=IB3x8s", ERROR_FLAG | flags, 8, bytes(8)))


def plain(frames):
    return [(frame.can_id, frame.data) for frame in frames]


def test_the_interface_of_the_run_is_a_real_one():
    assert os.environ["EL_DORADO_CAN"] in [name for _, name in socket.if_nameindex()]


def test_frames_cross_both_ways_in_order_and_are_counted(rover, wire):
    wire.write(FRAMES)
    assert plain(rover.read_upto(40, [7] * 40, LIMIT_S)) == plain(FRAMES)
    assert rover.write(FRAMES[::-1]) == 0
    assert plain(wire.read_upto(0, 40, LIMIT_S)) == plain(FRAMES[::-1])
    assert (wire.sent, wire.received, rover.sent, rover.received) == (40, 40, 40, 40)


def test_nobody_hears_itself(rover, wire):
    wire.write(FRAMES)
    rover.write(FRAMES[:3])
    assert plain(rover.read_upto(40, [0] * 40, LIMIT_S)) == plain(FRAMES)
    assert rover.read(0) == []
    with pytest.raises(TimeoutError, match="3 of 4 frames"):
        wire.read_upto(0, 4, 0.05)


def test_a_frame_is_stamped_with_its_age(rover, wire):
    wire.write(FRAMES[:1])
    (frame,) = rover.read_upto(1, [123], LIMIT_S)
    assert frame.stamp_ns == 123_000
    wire.write(FRAMES[:1])
    (frame,) = rover.read(3_600_000_000_000)
    assert 0 < frame.stamp_ns < 3_600_000_000_000


def test_error_frames_are_counted_and_not_returned(rover, wire, raw):
    send_error(raw, 0x04)  # a controller problem
    wire.write(FRAMES[:2])
    assert plain(rover.read(0)) == plain(FRAMES[:2])
    assert (rover.error_frames, rover.state) == (1, PortState.OPEN)


def test_the_bench_sends_error_frames_as_a_driver_does(rover, wire, raw):
    raw.setsockopt(socket.SOL_CAN_RAW, CAN_RAW_ERR_FILTER, 0x1FFF_FFFF)
    wire.write_error(BUS_OFF)
    wire.write_error(0x04, 0x30)
    assert rover.read_upto(2, [0, 0], LIMIT_S) == [] and rover.error_frames == 2
    assert struct.unpack("=IB3x8s", raw.recv(16)) == (ERROR_FLAG | BUS_OFF, 8, bytes(8))
    assert struct.unpack("=IB3x8s", raw.recv(16)) == (ERROR_FLAG | 0x04, 8, b"\0\x30\0\0\0\0\0\0")
    assert wire.sent == 2


def test_bus_off_is_a_state_until_the_controller_restarts(rover, raw):
    send_error(raw, BUS_OFF)
    assert rover.read(0) == [] and rover.state is PortState.ERROR
    send_error(raw, RESTARTED)
    assert rover.read(0) == [] and rover.state is PortState.OPEN
    assert rover.error_frames == 2


def test_an_interface_that_goes_down_is_an_error_and_never_blocks(rover, interface):
    ip_link("set", interface, "down")
    assert rover.read(0) == [] and rover.state is PortState.ERROR
    assert rover.write(FRAMES) == len(FRAMES)


def test_frames_cross_again_when_the_interface_is_up_again(rover, interface):
    ip_link("set", interface, "down")
    assert rover.read(0) == [] and rover.state is PortState.ERROR
    ip_link("set", interface, "up")
    with closing(CanSocket(f"socketcan:{interface}")) as wire:
        wire.write(FRAMES)
        assert plain(rover.read(0)) == plain(FRAMES) and rover.state is PortState.OPEN
        assert rover.write(FRAMES) == 0
        assert plain(wire.read_upto(0, 40, LIMIT_S)) == plain(FRAMES)


def test_an_interface_that_is_removed_is_no_open_bus_and_never_blocks(rover, interface):
    ip_link("del", interface)
    assert rover.read(0) == [] and rover.state is not PortState.OPEN
    assert rover.write(FRAMES) == len(FRAMES)


def test_a_bus_that_is_not_there_is_named_with_the_commands_that_make_it():
    for opener in (open_bus, CanSocket):
        with pytest.raises(OSError, match=r"socketcan:vcan7 cannot be opened .*modprobe vcan"):
            opener("socketcan:vcan7")
    with pytest.raises(NoInterfaceError, match="socketcan:INTERFACE"):
        CanSocket("socketcand:127.0.0.1:29536/rover")


def test_faults_that_need_the_hub_end_the_run_and_say_so(wire):
    wire.listen(True)
    for fault in (lambda: wire.listen(False), lambda: wire.disconnect(0)):
        with pytest.raises(ConnectionError, match="use the bench's hub"):
            fault()
    with pytest.raises(ConnectionError, match="only the bench's hub"):
        wire.wait_client(1, LIMIT_S)


@pytest.mark.parametrize("end", ["down", "removed"])
def test_the_bench_says_how_far_it_came_when_its_interface_goes(wire, interface, end):
    wire.write(FRAMES)
    ip_link(*(("set", interface, "down") if end == "down" else ("del", interface)))
    with pytest.raises(ConnectionError, match=f"socketcan:{interface} is gone after 0 of 1 frames"):
        wire.read_upto(0, 1, LIMIT_S)
    with pytest.raises(ConnectionError, match=f"socketcan:{interface} takes no frame after 40"):
        wire.write(FRAMES)


def test_a_frame_of_cansend_is_read_and_a_frame_of_ours_is_seen_by_candump(rover, interface):
    subprocess.run(["cansend", interface, "181#DEADBEEF"], check=True)
    assert plain(rover.read(0)) == [(0x181, b"\xde\xad\xbe\xef")]
    with subprocess.Popen(["candump", "-L", "-n", "1", interface], stdout=subprocess.PIPE, text=True) as candump:
        while candump.poll() is None:  # it says nowhere when it listens
            rover.write([Frame(0x101, b"\x01\x02")])
        assert candump.stdout.read().split()[1:3] == [interface, "101#0102"]
