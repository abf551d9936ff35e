"""The emulator on real cables and the wall clock: who reads slowly, who comes and goes, and what the program says."""

import contextlib
import dataclasses
import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from hil.__main__ import app
from hil.devices.lidar import cable as cables
from hil.devices.lidar.faults import ScheduledFault
from hil.devices.lidar.profile import IDEAL, UTM30LX, UTM30LX_EW
from hil.devices.lidar.scenes import SCENES, still
from hil.devices.lidar.sensor import Lidar, Piece
from hil.devices.lidar.server import LidarServer, LidarTerminal
from hil.devices.lidar.service import Outlet, serve
from protocol import scip

ROOT = Path(__file__).parents[3]
MS = 1_000_000
QUICK_USB = dataclasses.replace(UTM30LX, reply_tick_ns=0)


def five_metres(times_ns):
    return np.full(len(times_ns), 5.0)


class TcpEnd:
    """A client's end of TCP that waits for bytes, at most 10 s."""

    def __init__(self, cable):
        self._socket = socket.create_connection((cable.host, cable.port), timeout=10.0)

    def write(self, data):
        self._socket.sendall(data)

    def read(self, limit_s=10.0):
        ready, _, _ = select.select([self._socket], [], [], limit_s)
        try:
            return self._socket.recv(65536) if ready else b""
        except ConnectionResetError:  # what was not read when the other end closed
            return b""

    def close(self):
        self._socket.close()


class PtyEnd:
    """A client's end of the pseudo terminal, opened as any program would, without setting it up."""

    def __init__(self, cable):
        self._fd = os.open(cable.address.removeprefix("tty:"), os.O_RDWR | os.O_NOCTTY)

    def write(self, data):
        os.write(self._fd, data)

    def read(self, limit_s=10.0):
        ready, _, _ = select.select([self._fd], [], [], limit_s)
        try:
            return os.read(self._fd, 65536) if ready else b""
        except OSError:
            return b""

    def close(self):
        os.close(self._fd)


ENDS = [(LidarServer, TcpEnd), (LidarTerminal, PtyEnd)]


def read_until(end, mark, data=b""):
    while mark not in data:
        piece = end.read()
        assert piece, f"the line ended after {data[-80:]!r}"
        data += piece
    return data


@contextlib.contextmanager
def running(*outlets):
    stop = threading.Event()
    thread = threading.Thread(target=serve, args=(outlets, lambda now_ns: not stop.is_set()))
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join(10.0)
        for outlet in outlets:
            outlet.cable.close()


# -- back-pressure ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("cable_class", "end_class"), ENDS)
def test_a_slow_reader_loses_whole_scans_and_no_reply(cable_class, end_class):
    """Twenty simulated seconds that nobody reads, then ten in which somebody does; the sensor never waits."""
    cable = cable_class()
    outlet = Outlet(Lidar(1, five_metres, dataclasses.replace(IDEAL, bursts=((0.4, 0), (0.6, 5 * MS)))), cable)
    end = end_class(cable)
    outlet.step(0)
    end.write(b"MD0000108001000\n")
    data = b""
    while not data.endswith(b"\n\n"):
        outlet.step(0)
        data += end.read()
    data = b""
    for tick in range(1, 3000):
        outlet.step(tick * 10 * MS)
        if tick > 2000:
            data += end.read(0.0)
        if tick == 2900:
            end.write(b"QT;the.end\n")
    while not data.endswith(b"QT;the.end\n00P\n\n"):
        outlet.step(tick * 10 * MS)
        data += end.read(0.0)
    *frames, _ = data.split(b"\n\n")[:-1]
    asked = scip.ScanRequest("MD", 0, 1080)
    read = [scip.parse_scan(scip.parse_reply(frame), asked) for frame in frames]
    gaps = np.diff([scan.stamp_ms for scan in read])
    assert cable.dropped > 100 and len(read) + cable.dropped == outlet.sensor.scans
    assert gaps.sum() == 25 * (outlet.sensor.scans - 1) and sorted(gaps)[-1] > 1000 and min(gaps) == 25
    end.close()
    cable.close()


def test_a_client_that_asks_for_ever_and_never_reads_costs_a_bounded_backlog():
    cable = LidarServer()
    end = TcpEnd(cable)
    assert cable.wait_client(5.0)
    for _ in range(2000):
        cable.put(Piece(0, b"x" * 10_000, True, False))
    assert 0 < len(cable._backlog) <= cables.REPLIES_BACKLOG + 10_000 and cable.dropped > 0
    end.close()
    cable.close()


# -- who comes and goes ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("cable_class", "end_class", "profile", "survives"),
    [(*ENDS[0], IDEAL, False), (*ENDS[0], QUICK_USB, True), (*ENDS[1], QUICK_USB, True)],
)
def test_usb_goes_on_for_the_next_client_and_tcp_does_not(cable_class, end_class, profile, survives):
    cable = cable_class()
    with running(Outlet(Lidar(1, five_metres, profile), cable)):
        end = end_class(cable)
        end.write(b"MD0000108001000\n")
        read_until(end, b"99b\n")
        end.close()
        again = end_class(cable)
        again.write(b"II\n")
        assert (b"LASR:ON" in read_until(again, b"STAT:")) is survives
        again.close()


@pytest.mark.parametrize(("cable_class", "end_class"), ENDS)
def test_a_pulled_cable_is_an_end_of_file_and_can_be_opened_again(cable_class, end_class):
    cable = cable_class()
    sensor = Lidar(1, five_metres, IDEAL)
    with running(Outlet(sensor, cable)):
        end = end_class(cable)
        end.write(b"MD0000108001000\n")
        read_until(end, b"99b\n")
        sensor.faults.begin(sensor, "cable")
        while end.read():
            pass
        end.close()
        sensor.faults.end(sensor, "cable")
        while True:
            with contextlib.suppress(OSError):
                again = end_class(cable)
                break
        again.write(b"QT\n")
        assert read_until(again, b"QT\n00P\n\n") == b"QT\n00P\n\n"
        again.close()


def test_rb_twice_drops_the_link_and_the_ew_is_there_again_before_it_measures():
    profile = dataclasses.replace(UTM30LX_EW, reply_tick_ns=0, reboot_ns=50 * MS, dark_ns=50 * MS, denied_ns=1000 * MS)
    cable = LidarServer()
    with running(Outlet(Lidar(1, five_metres, profile), cable)):
        end = TcpEnd(cable)
        end.write(b"RB\nRB\n")
        assert read_until(end, b"RB\n00P\n\n").startswith(b"RB\n01Q\n\n")
        while end.read():
            pass
        said = []
        while not said or said[-1] == b"TM0\n10Q\n\n":  # denied until it has booted
            with contextlib.suppress(OSError, AssertionError):  # while it is dark nobody is let in
                end = TcpEnd(cable)
                end.write(b"TM0\n")
                said.append(read_until(end, b"\n\n"))
                end.close()
        assert said[0] == b"TM0\n10Q\n\n"
        assert said[-1] == b"TM0\n00P\n\n"


def test_tcp_and_terminal_at_once_have_a_sensor_each():
    cables = [LidarServer(), LidarTerminal()]
    cast = still(SCENES["room"]())
    with running(*(Outlet(Lidar(k, cast, IDEAL), cable) for k, cable in enumerate(cables))):
        tcp, pty = TcpEnd(cables[0]), PtyEnd(cables[1])
        tcp.write(b"TM0\n")
        assert read_until(tcp, b"\n\n") == b"TM0\n00P\n\n"
        pty.write(b"MD0000108001002\r")
        assert b"MD0000108001001\n99b\n" in read_until(pty, b"MD0000108001000\n99b\n")
        tcp.close()
        pty.close()


def test_the_terminal_is_raw_before_anybody_knows_its_name():
    """No echo, no CR for LF, no signal for a Ctrl-C byte: a client that sets nothing up reads what was sent."""
    cable = LidarTerminal()
    with running(Outlet(Lidar(1, five_metres, IDEAL), cable)):
        end = PtyEnd(cable)
        end.write(b"\x03\x04QT\r\nVV\n")
        assert read_until(end, b"SERI:00903971;:\n\n").startswith(b"\x03\x04QT\n0Ee\n\nVV\n00P\nVEND:")
        end.close()


def test_the_loop_waits_when_there_is_nothing_to_do():
    """0.5 s with nobody on either cable: the processor is asked for next to nothing."""
    calls = 0

    def go_on(now_ns):
        nonlocal calls
        calls += 1
        return now_ns < 500 * MS

    outlets = [Outlet(Lidar(1, five_metres, UTM30LX), cable) for cable in (LidarServer(), LidarTerminal())]
    serve(outlets, go_on)
    assert calls <= 60
    for outlet in outlets:
        outlet.cable.close()


def test_faults_of_the_schedule_reach_the_client():
    cable = LidarServer()
    with running(Outlet(Lidar(1, five_metres, IDEAL, (ScheduledFault("refuse", 0.0, 1e9, "0I"),)), cable)):
        end = TcpEnd(cable)
        end.write(b"VV\n")
        assert read_until(end, b"\n\n") == b"VV\n0Ii\n\n"
        end.close()


# -- the program -----------------------------------------------------------------------------------------------


def test_the_program_serves_both_cables_and_ends_at_ctrl_c(tmp_path):
    link = tmp_path / "scanner"
    options = f"--profile utm-30lx --tcp 0 --link {link} --json --clock-start -1000".split()
    command = [sys.executable, "-m", "hil", "lidar", *options]
    with subprocess.Popen(command, cwd=ROOT, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as child:
        first = json.loads(child.stdout.readline())
        tcp, tty = first["addresses"]
        assert first["profile"] == "utm-30lx" and tty == f"tty:{link}"
        host, port = tcp.removeprefix("tcp:").split(":")
        with socket.create_connection((host, int(port)), timeout=10.0) as client:
            client.sendall(b"VV\n")
            data = b""
            while b"\n\n" not in data:
                data += client.recv(4096)
        assert b"TOP-URG UTM-30LX;P\n" in data
        status = json.loads(child.stdout.readline())["sensors"][0]
        assert status["state"] == "standby" and status["clock_ms"] >= 2**24 - 1000
        child.send_signal(signal.SIGINT)
        _, errors = child.communicate(timeout=20)
    assert child.returncode == 0 and "Traceback" not in errors
    assert not link.is_symlink()


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (("--profile", "urg"), 64, "--profile 'urg' should be one of ideal, utm-30lx, utm-30lx-ew"),
        (("--scene", "moon"), 64, "--scene 'moon' should be one of room, flat, empty, fbm, craters, real"),
        (("--tcp", "here"), 64, "--tcp 'here' should be PORT or HOST:PORT, as in 10940"),
        (("--fault", "flop@1"), 64, "fault 'flop' should be one of "),
        (("--faults", "missing.toml"), 66, "no file missing.toml"),
        (("--link", "README.md"), 69, "cannot make README.md: it is there already, and no link"),
    ],
)
def test_a_wrong_option_is_one_line(arguments, code, says):
    done = CliRunner().invoke(app, ["lidar", *arguments, "--seconds", "0.1"])
    assert (done.exit_code, done.stdout) == (code, "")
    assert done.stderr.startswith(f"hil lidar: {says}") and done.stderr.count("\n") == 1


def test_a_port_in_use_is_one_line():
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        done = CliRunner().invoke(app, ["lidar", "--tcp", str(port)])
    hint = "Address already in use; is another one running? --tcp 0 takes a free port"
    assert (done.exit_code, done.stderr) == (69, f"hil lidar: cannot serve 127.0.0.1:{port}: {hint}\n")


def test_it_ends_by_itself_after_its_seconds_and_says_where_it_was():
    done = CliRunner().invoke(app, ["lidar", "--tcp", "127.0.0.1:0", "--scene", "empty", "--seconds", "0.05"])
    assert done.exit_code == 0 and done.stdout.startswith("utm-30lx-ew on tcp:127.0.0.1:")
