"""Station and link emulator as processes in lock-step with a bench of this test, a toy rover on the real port."""

import json
import os
import random
import socket
import sqlite3
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from ground.archive.store import Archive
from ground.station.memory import COUNTERS, GAP, Memory
from ground.station.settings import StationSettings
from ground.station.station import Station
from ground.station.user import by_hand
from hil.processes import free_ports
from onboard.config import ConfigError
from onboard.drivers.link.port import LinkPort
from protocol import barrier
from protocol.link.datagrams import DatagramKind, Opener, Sealer, bench_keys
from tests.ground.toy_rover import TICK_NS, ToyRover

ROOT = Path(__file__).parents[3]
KEYS = bench_keys(7)
LIMIT_S = 30.0
SCRIPT = "at 2.0: goto 12 3\nwait goto\nget ldem\n"


def free_endpoints(count: int) -> list[str]:
    return [f"tcp/127.0.0.1:{port}" for port in free_ports(count)]


class Peer:
    """One participant's connection."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection, self._receiver = connection, barrier.Receiver()
        connection.settimeout(LIMIT_S)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        hello = self.hear()
        assert isinstance(hello, barrier.Hello)
        self.name, self.wake, self.sent, self.told = hello.name, 0, {}, 0

    def hear(self) -> barrier.Message:
        while True:
            got = self._receiver.receive(self._connection.recv(65_536))
            if got:
                return got[0]

    def say(self, message: barrier.Message) -> None:
        self._connection.sendall(barrier.encode(message))

    def tick(self, number: int, *channels: barrier.Channel) -> None:
        if number < self.wake and not channels:
            return
        self.say(barrier.Tick(number, number * TICK_NS, channels))
        done = self.hear()
        assert isinstance(done, barrier.Done)
        self.wake, self.sent = done.wake_tick, done.sent


def start(stack: ExitStack, folder: Path, *argv: str, stdin: str = "") -> subprocess.Popen:
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    run = subprocess.Popen(
        [sys.executable, *argv],
        cwd=folder,
        env=env,
        text=True,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    stack.callback(lambda: run.poll() is None and run.kill())
    if stdin:
        run.stdin.write(stdin)
    run.stdin.close()
    run.stdin = None
    return run


def fly(folder: Path, profile: str, *extra: str, fails: bool = False) -> dict:
    """A whole run in a folder; what the station said, its exit code, the emulator's report."""
    folder.mkdir()
    rover_end, ground_end = free_endpoints(2)
    (folder / "ground.toml").write_text(f"bench_seed = 7\nendpoint = '{ground_end}'\narchive = 'archive.db'\n")
    with ExitStack() as stack:
        server = stack.enter_context(socket.create_server(("127.0.0.1", 0)))
        server.settimeout(LIMIT_S)
        address = f"tcp:127.0.0.1:{server.getsockname()[1]}"
        link = start(
            stack,
            folder,
            "-c",
            "import typer; from hil.link.command import main; typer.run(main)",
            "--profile",
            profile,
            "--rover",
            rover_end,
            "--ground",
            ground_end,
            "--seed",
            "3",
            "--barrier",
            address,
            "--report",
            "link.json",
        )
        station = start(stack, folder, "-m", "ground", "script", "-", "--barrier", address, *extra, stdin=SCRIPT)
        port = stack.enter_context(LinkPort(rover_end, KEYS, 1))
        port.wait_open(LIMIT_S)
        peers = {peer.name: peer for peer in (Peer(stack.enter_context(server.accept()[0])) for _ in range(2))}
        for peer in peers.values():
            peer.say(barrier.Welcome(TICK_NS, 0))
        ticks = lock_step(peers, port, fails)
        peers["link"].say(barrier.Stop("over"))
        out, err = station.communicate(timeout=LIMIT_S)
        _, link_err = link.communicate(timeout=LIMIT_S)
        assert (link.returncode, link_err) == (0, "")
    report = json.loads((folder / "link.json").read_text())
    return {"out": out, "err": err, "code": station.returncode, "ticks": ticks, "report": report}


def lock_step(peers: dict[str, Peer], port: LinkPort, fails: bool) -> int:
    rover, link, ground = ToyRover(KEYS, rate_bps=1024e3), peers["link"], peers["ground"]
    rover.fails = fails
    up_out = 0
    for n in range(20_000):
        now_ns = n * TICK_NS
        news = link.sent.get("up_out", 0)
        for message in port.read_upto(news, (now_ns // 1000,) * (news - up_out)):
            rover.deliver(message, now_ns)
        up_out, before = news, port.sent
        port.write(rover.tick_payloads(now_ns))
        link.tick(n, *([barrier.Channel("down_in", port.sent)] if port.sent != before else []))
        delivered, asked = link.sent.get("down_out", 0), ground.sent.get("up_in", 0)
        ground.tick(n, *([barrier.Channel("down_out", delivered)] if delivered != ground.told else []))
        ground.told = delivered
        if ground.sent.get("up_in", 0) != asked:
            link.tick(n, barrier.Channel("up_in", ground.sent["up_in"]))
        if "finished" in ground.sent:
            return n
    raise AssertionError("the script did not end")


def test_a_script_in_lock_step_drives_and_fetches_and_repeats_to_the_byte(tmp_path):
    first, again = fly(tmp_path / "a", "ets8-c"), fly(tmp_path / "b", "ets8-c")
    assert first["code"] == 0, first["err"]
    assert "command   goto #1 completed: there" in first["out"]
    assert "product   ldem" in first["out"]
    assert "    2.00 s  script    at 2.0: goto 12 3" in first["out"]
    assert first == again
    assert first["report"]["down"]["lost"] > 0
    with sqlite3.connect(tmp_path / "a" / "archive.db") as db:
        assert db.execute("select name from products").fetchall() == [("ldem",)]
        assert (
            db.execute("select count(*) from datagrams where direction = 'down'").fetchone()[0]
            == first["report"]["down"]["out"]["datagrams"]
        )


def test_a_failed_goto_is_exit_code_1_and_json_tells_it(tmp_path):
    got = fly(tmp_path / "a", "lan", "--json", fails=True)
    assert (got["code"], got["err"]) == (1, "ground: goto failed: no way\n")
    news = [json.loads(line) for line in got["out"].splitlines()]
    assert {"FAILED"} == {n["state"] for n in news if n["news"] == "report" and n["command"] == "goto"} - {
        "ACCEPTED",
        "STARTED",
        "RECEIVED",
    }
    assert any(n["news"] == "product" and n["name"] == "ldem" for n in news)


def test_counters_are_reserved_on_disk_before_use(tmp_path):
    first = Memory(str(tmp_path / "state"), 1).reserve()
    again = Memory(str(tmp_path / "state"), 1).reserve(boot_id=5)
    third = Memory(str(tmp_path / "state"), 1).reserve()
    assert (first.counter, again.counter, third.counter) == (0, COUNTERS, 2 * COUNTERS)
    assert first.request_end + GAP == again.request_id  # the gap is for who cannot write
    assert third.boot_id == 5


def test_processes_of_one_station_stay_within_the_rovers_window_however_they_take_turns(tmp_path):
    """One lives long and says little, one says much beside it, and short ones come and go."""
    rng, rover = random.Random(5), Opener(KEYS.command, boot_id=1)

    class Process:
        def __init__(self):
            self.memory, self.sealer = Memory(str(tmp_path), 1), Sealer(KEYS.command.key(1, 0), 1, 1)
            self.take()

        def take(self):
            self.block = self.memory.reserve()
            self.sealer.counter = self.block.counter

        def say(self):
            if self.sealer.counter + 512 > self.block.counter_end or self.memory.behind(self.sealer.counter):
                self.take()
            rover.open(self.sealer.seal(DatagramKind.MAVLINK, b""))  # raises where it is too old, or was there before

    quiet, loud = Process(), Process()
    for _ in range(3000):
        (quiet if rng.random() < 0.05 else loud).say()
        if rng.random() < 0.05:
            Process().say()
    reserved = json.loads((tmp_path / "station-1.json").read_text())["counter"]
    assert reserved < 400 * COUNTERS  # none wastes its numbers on the other


def test_request_ids_rise_in_the_order_of_asking_over_all_processes_of_a_station(tmp_path):
    settings = StationSettings(bench_seed=7, state=str(tmp_path))
    stations = [Station(settings, Archive(":memory:")) for _ in range(3)]
    rng, asked = random.Random(3), []
    for _ in range(400):
        asked.append(stations[rng.randrange(3)].session.request("status", {}, 0))
    assert asked == sorted(set(asked))
    alone = [stations[0].session.request("status", {}, 0) for _ in range(300)]
    assert alone == sorted(set(alone)) and alone[0] > asked[-1]
    assert alone[-1] - alone[0] < 300 + GAP + 256  # a block is used up before the next is taken


def test_the_archive_has_who_asked(tmp_path, monkeypatch):
    monkeypatch.setattr("getpass.getuser", lambda: "alice")
    monkeypatch.setattr("socket.gethostname", lambda: "desk")
    with Archive(":memory:") as archive:
        station = Station(StationSettings(bench_seed=7), archive)
        station.session.asked_by = by_hand("command line")
        station.session.request("status", {}, 0)
        station.session.request("stop", {}, 0, asked_by="gateway 127.0.0.1:14555 system 255, unsigned")
        station._add_requests()
        assert [row[-1] for row in archive.rows("requests")] == [
            "command line alice@desk",
            "gateway 127.0.0.1:14555 system 255, unsigned",
        ]


def test_a_user_without_a_name_is_told_by_number(monkeypatch):
    def nobody():
        raise KeyError("getpwuid(): uid not found: 1234")

    monkeypatch.setattr("getpass.getuser", nobody)
    monkeypatch.setattr("os.getuid", lambda: 1234)
    assert by_hand("shell").startswith("shell 1234@")


def test_a_stop_is_asked_though_the_stations_disk_has_gone(tmp_path):
    station = Station(StationSettings(bench_seed=7, state=str(tmp_path / "state")), Archive(":memory:"))
    first = station.session.request("status", {}, 0)
    (tmp_path / "state" / "station-1.json").write_text("[]")
    assert station.session.request("stop", {}, 0) == first + 1


def test_a_damaged_memory_is_an_error_never_a_start_from_zero(tmp_path):
    (tmp_path / "station-1.json").write_text("{")
    with pytest.raises(ConfigError, match="damaged"):
        Memory(str(tmp_path), 1).reserve()
