"""The scanner's port: addresses, ttys and their bit rates, unplugging, and what it says when it cannot be had."""

from __future__ import annotations

import errno
import fcntl
import os
import socket

import pytest

from onboard.config import ConfigError
from onboard.drivers.lidar import tty_port
from onboard.drivers.lidar.baud_search import BaudSearch
from onboard.drivers.lidar.port import open_port
from onboard.records import PortState

TIOCGEXCL = 0x80045440  # Linux: whether the terminal is marked as taken
RATES = (19_200, 38_400, 57_600, 115_200, 500_000)


@pytest.fixture
def pair():
    """(master, path) of a pty."""
    master, slave = os.openpty()
    path = os.ttyname(slave)
    os.close(slave)
    yield master, path
    os.close(master)


def one_line(text):
    return text and "\n" not in text and len(text) < 200


@pytest.mark.parametrize("address", [
    "", "tcp:", "tcp:host", "tcp:host:0", "tcp::1", "udp:host:1", "tty:", "tty:ttyACM0", "/dev/ttyACM0",
    "tty:/dev/ttyUSB0@", "tty:/dev/ttyUSB0@9600",
])  # fmt: skip
def test_an_address_that_is_none_is_refused_with_examples(address):
    with pytest.raises(ConfigError, match=r"tty:/dev/ttyACM0|one of 19200"):
        open_port(address)


def test_a_tty_is_read_and_written_raw(pair):
    master, path = pair
    port = open_port(f"tty:{path}")
    port.connect()
    assert port.state is PortState.OPEN and port.error == ""
    os.write(master, b"VV\n00P\r\x03\n")
    assert port.read_exactly(9, 5.0) == b"VV\n00P\r\x03\n"
    port.write(b"QT\n")
    assert os.read(master, 10) == b"QT\n"
    port.close()


def test_a_tty_that_another_program_has_is_said_to_be_in_use(pair):
    first, second = (open_port(f"tty:{pair[1]}") for _ in range(2))
    first.connect()
    second.connect()
    assert second.state is PortState.ERROR and "in use by another program" in second.error and one_line(second.error)
    first.close()
    second.connect()
    assert second.state is PortState.OPEN and second.error == ""
    second.close()


def test_a_pseudo_terminal_that_was_let_go_can_be_opened_by_any_user(pair):
    """A mark that it is taken would stay on it as long as the emulator has its other end, and keep out all but root."""
    port = open_port(f"tty:{pair[1]}")
    port.connect()
    port.close()
    with open(pair[1], "rb", buffering=0) as tty:
        marked = fcntl.ioctl(tty, TIOCGEXCL, bytes(4))
    assert marked == bytes(4)


def test_a_path_that_is_not_there_says_where_to_look(tmp_path):
    port = open_port(f"tty:{tmp_path}/ttyACM7")
    port.connect()
    assert port.state is PortState.ERROR and "is it plugged in" in port.error.replace("the sensor", "it")
    assert "ttyACM7" in port.error and "ls /dev/ttyACM*" in port.error and one_line(port.error)


def test_a_path_that_is_no_tty_is_named(tmp_path):
    path = tmp_path / "file"
    path.write_text("")
    port = open_port(f"tty:{path}")
    port.connect()
    assert port.state is PortState.ERROR and "is no tty" in port.error and one_line(port.error)


def test_a_missing_permission_names_the_group(pair, monkeypatch):
    def refused(path, flags):
        raise OSError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(tty_port.os, "open", refused)
    port = open_port(f"tty:{pair[1]}")
    port.connect()
    assert port.state is PortState.ERROR and "usermod -aG dialout" in port.error and one_line(port.error)


def test_an_unplugged_tty_is_an_error_and_opens_again():
    master, slave = os.openpty()
    path = os.ttyname(slave)
    port = open_port(f"tty:{path}")
    port.connect()
    os.close(slave)
    os.close(master)
    assert port.read(1) == () and port.state is PortState.ERROR and "is gone" in port.error
    port.write(b"QT\n")
    port.connect()
    assert port.state is PortState.ERROR and one_line(port.error)


def test_a_refused_tcp_port_names_host_port_and_cause():
    with socket.create_server(("127.0.0.1", 0)) as server:
        number = server.getsockname()[1]
    port = open_port(f"tcp:127.0.0.1:{number}")
    port.connect()
    assert port.wait_open(5.0) is PortState.ERROR
    assert f"refuses port {number}" in port.error and one_line(port.error)


def test_a_tcp_peer_that_closes_is_an_error_and_connects_again():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = open_port(f"tcp:127.0.0.1:{server.getsockname()[1]}")
        port.connect()
        assert port.wait_open(5.0) is PortState.OPEN
        server.accept()[0].close()
        assert port.read_exactly(1, 5.0) == b"" and port.state is PortState.ERROR
        assert "closed by the other side" in port.error and one_line(port.error)
        port.connect()
        assert port.wait_open(5.0) is PortState.OPEN and port.epoch == 2
        port.close()


class SerialLine:
    """A sensor at one bit rate: what is said at another is noise to both."""

    def __init__(self, rate_bps, silent=False):
        self.rate_bps, self.silent, self.line_bps, self.set_to = rate_bps, silent, 0, []

    def exchange(self, move):
        self.line_bps = move.rate_bps or self.line_bps
        if not move.data or self.silent:
            return b""
        if self.line_bps != self.rate_bps:
            return b"\xf8\x00\xe6"
        out = b""
        for request in move.data.split(b"\n"):
            if request == b"QT":
                out += b"0o0o0\n\nQT\n00P\n\n"  # the end of a scan first
            elif request.startswith(b"SS"):
                out += request + b"\n00P\n\n"
                self.rate_bps = int(request[2:])
                self.set_to.append(self.rate_bps)
        return out


@pytest.mark.parametrize("at_bps", RATES)
@pytest.mark.parametrize("wanted_bps", [115_200, 500_000])
def test_a_sensor_is_found_at_any_bit_rate_and_set_to_ours(at_bps, wanted_bps):
    line, search, now_ns, heard = SerialLine(at_bps), BaudSearch(wanted_bps, RATES), 0, b""
    while not search.done:
        heard = line.exchange(search.step(heard, now_ns))
        now_ns += 10_000_000
    assert search.found and line.line_bps == line.rate_bps == wanted_bps and now_ns < 4_000_000_000
    assert line.set_to == ([] if at_bps == wanted_bps else [wanted_bps])


def test_a_line_without_a_sensor_ends_the_search():
    line, search, now_ns = SerialLine(115_200, silent=True), BaudSearch(115_200, RATES), 0
    while not search.done:
        search.step(line.exchange(search.step(b"", now_ns)), now_ns)
        now_ns += 10_000_000
    assert not search.found and 2_900_000_000 < now_ns < 3_300_000_000


def test_a_serial_address_opens_when_the_sensor_has_answered(pair):
    master, path = pair
    port = open_port(f"tty:{path}@115200")
    port.connect()
    assert port.state is PortState.CLOSED
    port.read(0)
    assert os.read(master, 100) == b"\nQT\n"
    os.write(master, b"QT\n00P\n\n")
    assert port.wait_open(5.0) is PortState.OPEN
    port.close()
