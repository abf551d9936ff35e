"""Beside real hardware: what is not there is emulated in real time, what is there is left alone."""

import json
import os
import signal
import socket
import stat
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from hil.devices.can.socket import NoInterfaceError
from hil.run.realtime import MixedBench, Real, write_keys
from hil.terrain.grounds import GROUNDS
from hil.world.truth import Truth
from onboard.config import Rover
from onboard.drivers.can.bus import CanPort
from onboard.records import Frame, PortState
from protocol.can.guard import Sender
from protocol.generated.can_codec import WheelMode

NOT_YET = (66, 69)  # no station file, no link: the processes are starting
ROOT = Path(__file__).parents[3]


@pytest.fixture
def bench(request):
    made = MixedBench(GROUNDS["flat"](1).field, 1, Rover(), Truth(), Real(*getattr(request, "param", ())))
    yield made
    made.close()


def test_orders_on_the_bus_drive_the_emulated_rover(bench):
    port, sender = CanPort(bench.bus.uri), Sender()
    try:
        bench.bus.wait(5.0)
        while port.wait_open(0.01) is not PortState.OPEN:
            bench.bus.poll()
        for _ in range(120):
            frames = [Frame(0x100, sender.encode(0x100, 1, 0), 0)]
            frames += [Frame(0x100 + n, sender.encode(0x100 + n, WheelMode.RUN, 0.0, 1.0), 0) for n in (1, 2, 3, 4)]
            port.write(frames)
            bench.bus.wait(1.0)
            bench.step()
        assert bench.state.wheels[0].rate_radps > 0.9
        assert 0.03 < bench.progress.way_m < 0.12
        heard = {frame.can_id for frame in port.read(0)}
        assert {0x181, 0x184, 0x1D0, 0x1D1, 0x1C0} <= heard
    finally:
        port.close()


def test_a_client_of_the_emulated_scanner_is_answered_and_may_go_and_come(bench):
    host, port = bench.lidar_server.host, bench.lidar_server.port
    for _ in range(2):
        with socket.create_connection((host, port)) as client:
            client.sendall(b"VV\n")
            client.settimeout(0.01)
            told = b""
            for _ in range(50):
                bench.step()
                with suppress(TimeoutError):
                    told += client.recv(4096)
            assert told.startswith(b"VV\n00P\n")
        bench.step()


@pytest.mark.parametrize("bench", [("tty:/dev/ttyACM7", "")], indirect=True)
def test_a_real_scanner_is_left_to_the_flight_program(bench):
    assert bench.lidar_server is None
    assert bench.addresses["lidar.address"] == "tty:/dev/ttyACM7"
    bench.step()


def test_a_can_interface_that_is_not_there_is_named_with_what_to_do():
    with pytest.raises(NoInterfaceError, match="modprobe vcan"):
        MixedBench(GROUNDS["flat"](1).field, 1, Rover(), Truth(), Real(can="socketcan:nocan9"))


def test_the_keys_of_a_run_are_new_each_time_and_for_the_owner_alone(tmp_path):
    first = [path.read_text() for path in write_keys(tmp_path)]
    paths = write_keys(tmp_path)
    assert [path.read_text() for path in paths] != first
    assert [stat.S_IMODE(path.stat().st_mode) for path in paths] == [0o600, 0o600]


@pytest.mark.mission
def test_the_flight_program_flies_with_a_scanner_of_its_own_beside_the_bench(tmp_path):
    """A scanner on TCP stands for the real one; Ctrl-C ends all."""

    def start(*words):
        return subprocess.Popen(
            [sys.executable, "-m", *words],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    scanner = start("hil", "lidar", "--tcp", "0", "--json")
    try:
        address = json.loads(scanner.stdout.readline())["addresses"][0]
        words = ["hil", "sim", "--terrain", "flat", "--lidar", address, "--out", str(tmp_path)]
        sim = start(*words)
        try:
            station = tmp_path / "ground.toml"
            asked = [sys.executable, "-m", "ground", "status", "--station", str(station), "--timeout", "100", "--json"]
            while True:
                told = subprocess.run(asked, cwd=ROOT, capture_output=True, text=True, timeout=150)
                if told.returncode not in NOT_YET or sim.poll() is not None:
                    break
            assert told.returncode == 0, told.stderr + (tmp_path / "onboard.log").read_text()
            assert "running: wall clock, socketcand" in (log := (tmp_path / "onboard.log").read_text())
            assert address in log
        finally:
            sim.send_signal(signal.SIGINT)
            _, said = sim.communicate(timeout=60)
        assert sim.returncode == 0, said
        assert "all processes are gone" in said
    finally:
        os.killpg(scanner.pid, signal.SIGTERM)
        scanner.communicate(timeout=30)
