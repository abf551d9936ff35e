"""A station over plain UDP: what stops the rover goes out before anybody has answered, and is repeated for as long."""

import socket
import subprocess
import sys
from pathlib import Path

import pytest

from ground.archive.store import Archive
from ground.station.clock import ClockTurn
from ground.station.settings import StationSettings
from ground.station.station import Station
from protocol import WireError
from protocol.link import direct
from protocol.link.datagrams import Opener, bench_keys

ROOT = Path(__file__).parents[3]
KEYS = bench_keys(7)
S = 1_000_000_000


@pytest.fixture
def rover():
    """A rover's port that answers nobody."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        made.bind(("127.0.0.1", 0))
        made.settimeout(60.0)
        yield made


def halting(opener: Opener, datagram: bytes) -> bool:
    try:
        return opener.open(datagram).halt
    except WireError:
        return False


def test_ground_stop_is_sent_before_a_hello_is_answered(tmp_path, rover):
    (tmp_path / "ground.toml").write_text(
        f"bench_seed = 7\nendpoint = 'udp/127.0.0.1:{rover.getsockname()[1]}'\none_way_s = 0.0\n"
    )
    words = [sys.executable, "-m", "ground", "stop", "--contact", "0", "--timeout", "3"]
    with subprocess.Popen(
        words, cwd=tmp_path, env={"PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as run:
        try:
            _, err = run.communicate(timeout=60)
        finally:
            run.kill()
    rover.setblocking(False)
    heard, opener = [], Opener(KEYS.command, boot_id=1)
    try:
        while True:
            heard.append(rover.recv(2000))
    except BlockingIOError:
        pass
    assert any(halting(opener, datagram) for datagram in heard), err
    assert any(datagram[0] == direct.Word.HELLO for datagram in heard)
    assert (run.returncode, "sent and not confirmed yet: stop" in err) == (75, True)


def over_udp(rover: socket.socket, halts: bool) -> Station:
    settings = StationSettings(endpoint=f"udp/127.0.0.1:{rover.getsockname()[1]}", bench_seed=7, one_way_s=0.0)
    return Station(settings, Archive(":memory:"), S if halts else None)


@pytest.mark.parametrize(("name", "stays"), [("stop", True), ("safe", True), ("status", False)])
def test_a_station_that_nobody_answers_stays_while_what_stops_the_rover_is_open(rover, name, stays):
    with over_udp(rover, False) as station:
        station.turn(ClockTurn(0, None))
        assert not station.linked
        station.session.request(name, {}, 0)
        station.flush(0)
        assert station.linked is stays


def test_a_plan_that_does_not_only_stop_the_rover_waits_for_an_answer(rover):
    with over_udp(rover, False) as station:
        asked = []
        station._end.wait_open = lambda *limits_s: bool(asked.append(limits_s)) or True
        station.wait_open(20.0, 3.0)
        assert asked == [(20.0, 3.0)]
