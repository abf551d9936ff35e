"""Bad input of a station: each gives one clear line, no received data is lost, a stop is still sent."""

import sqlite3
from types import SimpleNamespace

import numpy as np
import pytest

from ground.__main__ import run
from ground.archive.read import reading, rows
from ground.archive.store import Archive, ArchiveError
from ground.cli.operations.open_requests import left
from ground.link.session import Session
from ground.station.clock import ClockTurn
from ground.station.settings import StationSettings
from ground.station.station import Station
from protocol.link.datagrams import LinkKeys, bench_keys
from protocol.link.transactions import Report, RequestState, encode_report
from tests.ground.toy_rover import TICK_NS, ToyRover
from tests.ground.virtual_station import VirtualClock, VirtualStation

KEYS, OTHERS = bench_keys(7), bench_keys(8)


@pytest.fixture
def meet(tmp_path, monkeypatch, capsys):
    """Runs the command line against a virtual station with an archive: exit code, lines, the last words."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ground.toml").write_text("bench_seed = 7\narchive = 'archive.db'\n")

    def meet(station, *argv, limit_s=300.0):
        monkeypatch.setattr("ground.cli.operations.operate.Station", lambda *_: station)
        monkeypatch.setattr("ground.cli.operations.operate.WallClock", lambda: VirtualClock(limit_s))
        code = run(list(argv))
        streams = capsys.readouterr()
        assert "Traceback" not in streams.err + streams.out
        return code, streams.out.splitlines(), streams.err

    return meet


def test_a_downlink_key_that_is_not_the_rovers_is_named(meet):
    code, _, err = meet(VirtualStation(rover_keys=OTHERS), "status", limit_s=21.0)
    assert code == 69 and err.count("\n") == 1
    assert "none passed its check (tag): the downlink key of this station is not the rover's" in err


def test_a_command_key_that_is_not_the_rovers_is_named_once_and_nothing_is_executed(meet):
    station = VirtualStation(rover_keys=LinkKeys(OTHERS.command, KEYS.downlink))
    code, lines, err = meet(station, "goto", "1", "1", "--timeout", "40")
    told = [line for line in lines if "is its command key the rover's?" in line]
    assert len(told) == 1 and code == 75 and "not finished in time" in err
    assert station.rover.executed == []


def test_a_rover_that_answers_is_not_said_to_refuse(meet):
    station = VirtualStation(drive_s=60.0)
    station.rover.refused = 5
    code, lines, _ = meet(station, "goto", "1", "1")
    assert code == 0 and not any("refuses" in line for line in lines)


def test_malformed_datagrams_are_counted_by_kind_and_the_genuine_ones_are_heard():
    session, rover, rng = Session(KEYS, 1), ToyRover(KEYS), np.random.default_rng(3)
    genuine = [datagram for tick in range(100) for datagram in rover.tick(tick * TICK_NS)]
    for n, datagram in enumerate(genuine):
        for _ in range(20):
            bad = bytearray(datagram)
            bad[rng.integers(len(bad))] ^= int(rng.integers(1, 256))
            assert session.receive(bytes(bad[: rng.integers(len(bad) + 1)]), n)[0] != "ok"
        assert session.receive(rng.bytes(rng.integers(1200)), n)[0] in ("length", "tag")
        assert session.receive(datagram, n)[0] == "ok"
    assert session.counts["ok"] == len(genuine)
    assert sum(session.counts.values()) == 22 * len(genuine)
    assert session.items["mode"].value == 1


def spoiled(path, how):
    """An archive that cannot be used, and the bytes that it is to keep."""
    Archive(path).close()
    if how == "corrupt":
        path.write_bytes(b"no database" * 1000)
    else:
        with sqlite3.connect(path) as db:
            db.execute("pragma user_version = 99")
        db.close()
    return path.read_bytes()


@pytest.mark.parametrize(("how", "part"), [("corrupt", "damaged, or no archive"), ("newer", "of version 99")])
def test_with_an_archive_that_cannot_be_used_a_goto_is_refused_and_a_stop_goes_out(meet, tmp_path, how, part):
    before = spoiled(tmp_path / "archive.db", how)
    station = VirtualStation()
    code, _, err = meet(station, "goto", "1", "1")
    assert (code, err.count("\n")) == (65, 1) and part in err
    assert station.rover.executed == []
    for verb, name in (("stop", "stop"), ("safe", "safe"), ("emergency-stop", "emergency_stop")):
        station = VirtualStation()
        code, lines, _ = meet(station, verb)
        assert code == 0 and station.rover.executed == [name]
        assert any(part in line and "sent without it" in line for line in lines)
    assert (tmp_path / "archive.db").read_bytes() == before


def test_a_locked_archive_is_exit_code_75_and_says_so(meet, tmp_path, monkeypatch):
    monkeypatch.setattr("ground.archive.schema._OPEN_S", 0.05)
    Archive(tmp_path / "archive.db").close()
    other = sqlite3.connect(tmp_path / "archive.db", isolation_level=None)
    other.execute("begin exclusive")
    code, _, err = meet(VirtualStation(), "goto", "1", "1")
    other.execute("rollback")
    other.close()
    assert code == 75 and "locked by another program" in err and err.count("\n") == 1


def test_what_stops_the_rover_does_not_wait_for_a_locked_archive(meet, tmp_path, monkeypatch):
    waits_s, connect = [], sqlite3.connect
    Archive(tmp_path / "archive.db").close()
    other = connect(tmp_path / "archive.db", isolation_level=None)
    other.execute("begin exclusive")
    monkeypatch.setattr(
        "ground.archive.schema.sqlite3.connect",
        lambda path, **more: (waits_s.append((path, more["timeout"])), connect(path, **more))[1],
    )
    for verb in ("stop", "safe", "emergency-stop"):
        station = VirtualStation()
        code, lines, _ = meet(station, verb)
        assert code == 0 and station.rover.executed == [verb.replace("-", "_")]
        assert any("locked by another program for 0.05 s" in line and "sent without it" in line for line in lines)
    other.execute("rollback")
    other.close()
    assert [wait_s for path, wait_s in waits_s if path != ":memory:"] == [0.05] * 3


class Wire:
    """A link without loss between a real Station and the toy rover."""

    linked = True

    def __init__(self, rover):
        self.rover, self.now_ns, self.heard = rover, 0, 0

    def take(self, _most):
        datagrams = self.rover.tick(self.now_ns)
        self.heard += len(datagrams)
        return datagrams

    def put(self, datagram):
        self.rover.receive(datagram, self.now_ns)

    def close(self):
        pass


def test_on_a_full_disk_a_goto_is_flown_events_stay_with_the_rover_and_no_row_is_lost(tmp_path):
    path, rover = tmp_path / "archive.db", ToyRover(KEYS, drive_s=5.0)
    wire = Wire(rover)
    with Archive(path) as archive:
        station = Station(StationSettings(bench_seed=7), archive)
        station._end = wire

        def fly(seconds):
            for _ in range(round(seconds * 1e9 / TICK_NS)):
                wire.now_ns += TICK_NS
                station.turn(ClockTurn(wire.now_ns, None))
                station.flush(wire.now_ns)

        fly(1.0)
        pages = archive._db.execute("pragma page_count").fetchone()[0]
        archive._db.execute(f"pragma max_page_count = {pages}")
        request = station.session.request("goto", {"x_m": 1.0, "y_m": 1.0}, wire.now_ns)
        fly(20.0)
        assert station.session.requester.requests[request].state.name == "COMPLETED"
        assert "the disk is full" in station.trouble
        assert rover.events_waiting == 1  # ARRIVED is not acknowledged: it is kept nowhere yet
        archive._db.execute("pragma max_page_count = 100000")
        fly(10.0)
        assert station.trouble == "" and rover.events_waiting == 0
    with reading(path) as db:
        assert sum(row["direction"] == "down" for row in rows(db, "datagrams")) == wire.heard
        assert [row["name"] for row in rows(db, "events")] == ["ARRIVED"]
        assert [row["state"] for row in rows(db, "reports")][-1] == "COMPLETED"


def test_old_rows_go_at_the_start_of_a_station_that_is_told_so(meet, tmp_path, monkeypatch):
    with Archive(tmp_path / "archive.db", utc_ns=10**18) as archive:
        archive.add("items", 1, 1, "x_m", 1.0, 1)
        archive.add("requests", 1, 1, 1, "goto", "{}")
    (tmp_path / "ground.toml").write_text("bench_seed = 7\narchive = 'archive.db'\narchive_days = 30\n")
    later_ns = 10**18 + 31 * 86_400 * 10**9
    monkeypatch.setattr("ground.cli.operations.operate.time", SimpleNamespace(time_ns=lambda: later_ns))
    _, lines, _ = meet(VirtualStation(), "status")
    assert any("1 old rows removed, as the station file says" in line for line in lines)
    with reading(tmp_path / "archive.db") as db:
        assert len(list(rows(db, "items"))) == 0 and len(list(rows(db, "requests"))) == 1


class CtrlC(VirtualClock):
    """Somebody presses it after so many seconds."""

    def __init__(self, after_s):
        super().__init__()
        self._after_ns = after_s * 1e9

    def turn(self, sent, wake_ns):
        turn = super().turn(sent, wake_ns)
        if turn.now_ns >= self._after_ns:
            raise KeyboardInterrupt
        return turn


@pytest.mark.parametrize(
    ("argv", "silent", "after_s", "words"),
    [
        (("watch",), (), 2.0, "interrupted\n"),
        (("goto", "1", "1"), ((0.0, 1e9),), 2.0, "interrupted; NOT sent: goto\n"),
        (("stop",), (), 0.0, "interrupted; NOT sent: stop\n"),
        (("stop",), ((0.0, 1e9),), 2.0, "interrupted; sent and not confirmed yet: stop\n"),
        (
            ("goto", "1", "1"),
            (),
            2.0,
            "interrupted; the rover carries on with what it was told (goto), `ground stop` ends it\n",
        ),
    ],
)
def test_ctrl_c_says_what_was_not_sent_and_what_the_rover_carries_on_with(
    meet, monkeypatch, argv, silent, after_s, words
):
    monkeypatch.setattr(f"{__name__}.VirtualClock", lambda _: CtrlC(after_s))
    code, _, err = meet(VirtualStation(silent=silent, drive_s=60.0), *argv)
    assert (code, err) == (130, f"ground: {words}")


@pytest.mark.parametrize(("name", "typed", "end"), [
    ("lease_ask", "lease ask", ""), ("return", "return", ", `ground stop` ends it")])  # fmt: skip
def test_only_of_what_moves_the_rover_a_station_that_ends_says_that_a_stop_ends_it(name, typed, end):
    session = Session(KEYS, 1)
    request_id = session.request(name, {}, 0)
    session.requester.send(0)
    session.requester.receive(encode_report(Report(request_id, 1, 1, RequestState.ACCEPTED)), 0)
    assert left(session) == [f"the rover carries on with what it was told ({typed}){end}"]


def test_what_the_archive_could_not_write_is_told_at_ctrl_c_too(meet, monkeypatch):
    def close(self):
        raise ArchiveError("archive.db: the disk is full; 3 rows of this run are not in it")

    monkeypatch.setattr(f"{__name__}.VirtualClock", lambda _: CtrlC(2.0))
    monkeypatch.setattr(Archive, "close", close)
    code, _, err = meet(VirtualStation(), "watch")
    assert (code, err) == (73, "ground: interrupted; archive.db: the disk is full; 3 rows of this run are not in it\n")


def test_what_a_station_never_sent_is_cancelled_with_that_in_the_archive(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ground.toml").write_text("bench_seed = 7\narchive = 'archive.db'\n")
    with Archive("archive.db", 10**18) as archive:
        station = Station(StationSettings(bench_seed=7), archive)
        station._end = Wire(ToyRover(KEYS))
        with pytest.raises(KeyboardInterrupt):
            try:
                station.session.request("goto", {"x_m": 1.0, "y_m": 1.0}, 0)
                station.flush(0)
                raise KeyboardInterrupt
            finally:
                station.__exit__(None, None, None)
    assert run(["requests", "--open"]) == 0 and capsys.readouterr().out == "no request is open\n"
    assert run(["requests"]) == 0
    assert "goto 1 1  cancelled: never sent: its station ended before" in capsys.readouterr().out
