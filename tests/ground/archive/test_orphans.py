"""Requests whose station process ended before their outcome, and what a later session of that station makes of them."""

import sqlite3
import subprocess
import sys
from dataclasses import replace

import pytest

from ground.archive.read import chains, reading
from ground.archive.store import Archive
from ground.archive.unfinished_requests import Living, Orphan, fate
from ground.station.clock import ClockTurn
from ground.station.settings import StationSettings
from ground.station.station import Station
from protocol.link.datagrams import bench_keys
from protocol.link.transactions import Code
from protocol.tables import commands
from tests.ground.toy_rover import TICK_NS, ToyRover

KEYS = bench_keys(7)
S = 10**9
UTC_NS = 10**18
PLACE = {"x_m": 1.0, "y_m": 2.0}
GOTO = commands.encode(commands.Telecommand(5, 10 * S, 70 * S, "goto", commands.check("goto", PLACE)))
ENDED = "its station ended before the outcome"


@pytest.mark.parametrize(
    ("orphan", "boot_id", "later_s", "words"),
    [
        ({"state": "STARTED", "boot_id": 3}, 3, 1e6, None),
        (
            {"state": "STARTED", "boot_id": 3},
            4,
            1,
            f"{ENDED}; the rover has been restarted since (boot 4); until then: started",
        ),
        ({}, 4, 60, None),
        ({}, 4, 659, None),
        ({}, 4, 661, f"{ENDED}; nothing was heard of it, it may have been done"),
        ({"payload": b""}, 4, 601, f"{ENDED}; nothing was heard of it, it may have been done"),
        ({"state": "ACCEPTED"}, 4, 661, f"{ENDED}; nothing more was heard of it"),
    ],
)
def test_a_request_ends_by_a_new_boot_or_when_its_lifetime_is_over_and_nothing_was_heard(
    orphan, boot_id, later_s, words
):
    one = Orphan(5, "goto", GOTO, UTC_NS)._replace(**orphan)
    assert fate(one, boot_id, UTC_NS + round(later_s * S)) == words


class Air:
    """A link without loss, or none."""

    linked = True

    def __init__(self, rover):
        self.rover, self.now_ns, self.silent = rover, 0, False

    def take(self, _most):
        told = self.rover.tick(self.now_ns)
        return [] if self.silent else told

    def put(self, datagram):
        if not self.silent:
            self.rover.receive(datagram, self.now_ns)


class Sessions:
    """Processes of one station, one after the other, none of which ends in order."""

    def __init__(self, folder, rover):
        self.path, self.air = folder / "archive.db", Air(rover)
        self._settings = replace(StationSettings(bench_seed=7), state=str(folder / "state"), archive=str(self.path))

    def fly(self, seconds, ask="", deaf_s=0.0):
        """One process that is killed after so long. deaf_s: from when on nothing passes."""
        archive = Archive(self.path, UTC_NS + self.air.now_ns)
        station, zero_ns = Station(self._settings, archive), self.air.now_ns
        station._end, station.session.utc_ns, self.air.silent = self.air, UTC_NS + zero_ns, False
        for n in range(round(seconds * S / TICK_NS)):
            self.air.now_ns += TICK_NS
            now_ns = self.air.now_ns - zero_ns
            self.air.silent = bool(deaf_s) and now_ns >= deaf_s * S
            station.turn(ClockTurn(now_ns, None))
            if ask and n == 100:
                station.session.request(ask, PLACE, now_ns, 60.0)
            station.flush(now_ns)
        archive._living.close()
        archive._db.close()

    @property
    def chain(self):
        with reading(self.path) as db:
            (chain,) = chains(db)
        return chain


def test_a_later_session_asks_what_became_of_a_request_that_the_rover_had_and_nothing_is_done_twice(tmp_path):
    rover = ToyRover(KEYS, drive_s=5.0)
    sessions = Sessions(tmp_path, rover)
    sessions.fly(3.0, "goto")
    sessions.fly(1.0, deaf_s=0.01)
    assert sessions.chain.state == "STARTED"
    sessions.air.now_ns += 60 * S
    for n in range(1000):
        rover.tick(sessions.air.now_ns + n * TICK_NS)  # what it says of its end nobody hears
    sessions.air.now_ns += 10 * S
    sessions.fly(3.0)
    assert sessions.chain.reports[-1][1:] == ("COMPLETED", "there") and rover.executed == ["goto"]


def test_after_a_restart_of_the_rover_it_ends_with_that(tmp_path):
    sessions = Sessions(tmp_path, ToyRover(KEYS, drive_s=50.0))
    sessions.fly(3.0, "goto")
    sessions.air.rover = ToyRover(KEYS, boot_id=2)
    sessions.fly(1.0)
    _, state, text = sessions.chain.reports[-1]
    assert state == "FAILED" and "the rover has been restarted since (boot 2)" in text
    assert sessions.air.rover.executed == []


def test_one_that_the_rover_never_had_is_not_sent_again_and_ends_when_its_lifetime_is_over(tmp_path):
    sessions = Sessions(tmp_path, ToyRover(KEYS))
    sessions.fly(3.0, "goto", deaf_s=1.0)
    sessions.fly(2.0)
    assert sessions.chain.state == "REQUESTED"
    sessions.air.now_ns += 700 * S
    sessions.fly(2.0)
    assert sessions.chain.reports[-1][1:] == ("FAILED", f"{ENDED}; nothing was heard of it, it may have been done")
    assert sessions.air.rover.executed == []
    with sqlite3.connect(sessions.path) as db:
        db.execute(
            "insert into reports values (9, 1, ?, 1, 2, 'COMPLETED', 0, 'there', '[]', 1)", (sessions.chain.request_id,)
        )
    assert sessions.chain.state == "COMPLETED"  # what the rover says counts more, whenever it comes
    with sqlite3.connect(sessions.path) as db:
        assert db.execute("select code from reports where state = 'FAILED'").fetchone() == (Code.RESTARTED,)


def test_a_run_is_dead_when_its_process_is(tmp_path):
    path = tmp_path / "a.db"
    code = (
        "import sys; from ground.archive.unfinished_requests import Living; one = Living(sys.argv[1], 7)\n"
        "sys.stdout.write('held\\n'); sys.stdout.flush(); sys.stdin.read()"
    )
    other = subprocess.Popen(
        [sys.executable, "-c", code, str(path)], text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    with other:
        assert other.stdout.readline() == "held\n"
        here = Living(path, 8)
        assert here.lives(7) and not here.lives(6)
        other.kill()
        other.wait()
        assert not here.lives(7)
    here.close()
