"""`onboard run` as on the rover: its own clock, no bench, no scanner, nobody at the other end of the link."""

import os
import signal
import socket
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from hil.devices.can.hub import CanHub

ROOT = Path(__file__).parents[3]
EX_UNAVAILABLE, EX_CONFIG = 69, 78


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def command(*words, **settings):
    options = [f"--set={key.replace('__', '.')}={value}" for key, value in settings.items()]
    return [sys.executable, "-m", "onboard", *words, *options]


@contextmanager
def started(*words, **settings):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    program = subprocess.Popen(
        command(*words, **settings),
        cwd=ROOT,
        env=environment,
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    try:
        yield program
    finally:
        program.kill()
        program.communicate()


def alone(record):
    """Settings of a rover to which nothing is connected."""
    return {
        "clock__mode": "wall",
        "can__uri": "virtual:wall",
        "lidar__address": f"tcp:127.0.0.1:{free_port()}",
        "link__endpoint": f"tcp/127.0.0.1:{free_port()}",
        "link__bench_seed": 1,
        "record__path": record,
        "status__socket": "off",
    }


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_without_scanner_and_link_it_runs_and_a_signal_ends_it_with_a_whole_record(tmp_path, number):
    record = tmp_path / "onboard.mcap"
    with started("run", **alone(record)) as program:
        line = program.stderr.readline()
        assert line.startswith("onboard: running: wall clock, virtual:wall"), line
        refused = program.stderr.readline()
        assert refused.startswith("onboard: lidar: 127.0.0.1 refuses port ")  # with what to do
        with pytest.raises(subprocess.TimeoutExpired):  # it goes on by itself
            program.wait(0.5)
        program.send_signal(number)
        out, rest = program.communicate(timeout=60)
        assert (program.returncode, out, rest) == (0, "", "")  # said once
    with started("replay", str(record)) as replay:
        verdict, complaints = replay.communicate(timeout=120)
        assert (replay.returncode, complaints) == (0, "")
        assert verdict.startswith("identical: ")


def test_a_can_server_that_is_not_there_is_named_and_waited_for_and_the_bus_is_used_when_it_comes(tmp_path):
    hub = CanHub()
    hub.listen(False)
    settings = alone(tmp_path / "onboard.mcap") | {"can__uri": hub.uri}
    with started("run", **settings) as program:
        assert program.stderr.readline().startswith("onboard: running: wall clock")
        told = iter(program.stderr.readline, "")
        assert next(line for line in told if "can: " in line).startswith(f"onboard: can: {hub.uri} cannot be opened")
        hub.listen(True)
        hub.wait_client(0, 60.0)
        while not (heard := hub.read()):
            hub.wait(10.0)
        assert {frame.can_id for frame in heard} <= {0x080, 0x100, 0x101, 0x102, 0x103, 0x104, 0x120, 0x300}
        assert next(line for line in told if "can: " in line) == "onboard: can: is well\n"
        program.send_signal(signal.SIGTERM)
        assert program.wait(60) == 0
    hub.close()


@pytest.mark.skipif(Path("/proc/net/can").exists(), reason="this kernel has AF_CAN")
def test_socketcan_without_af_can_is_one_line_that_says_what_to_do(tmp_path):
    settings = alone(tmp_path / "onboard.mcap") | {"can__uri": "socketcan:can0"}
    with started("run", **settings) as program:
        out, told = program.communicate(timeout=60)
    assert (program.returncode, out) == (EX_UNAVAILABLE, "")
    assert told.startswith("onboard: socketcan:can0 cannot be opened")
    assert "socketcand:HOST:PORT/BUS" in told
    assert told.count("\n") == 1


def test_without_keys_it_is_refused_with_the_names_of_the_settings(tmp_path):
    settings = alone(tmp_path / "onboard.mcap") | {"link__bench_seed": -1}
    with started("run", **settings) as program:
        out, told = program.communicate(timeout=60)
    assert (program.returncode, out) == (EX_CONFIG, "")
    assert "link.command_keys" in told
    assert told.count("\n") == 1
