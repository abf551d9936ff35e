"""A stop goes out though the station can write nothing: its numbers are taken by the rover, then and later."""

import json
from dataclasses import replace

import pytest

from ground.__main__ import run
from ground.archive.store import Archive
from ground.station import halt_numbers
from ground.station.clock import ClockTurn
from ground.station.memory import Memory
from ground.station.settings import StationSettings
from ground.station.station import Station
from onboard.config import ConfigError
from protocol.link.datagrams import MAX_JUMP, bench_keys
from tests.ground.cli.test_bad_input import Wire
from tests.ground.toy_rover import TICK_NS, ToyRover

KEYS = bench_keys(7)
UTC_S = 1_795_000_000
PLACE = {"x_m": 1.0, "y_m": 1.0}


class Bed:
    """Processes of one station at one rover; `full`: its disk takes nothing."""

    def __init__(self, folder, monkeypatch):
        self.folder, self.rover, self.full, self.utc_s, self.now_ns = folder, ToyRover(KEYS), False, UTC_S, 0
        self.settings = StationSettings(bench_seed=7, state=str(folder / "state"))
        write = Memory._write

        def refuses(memory, tree):
            if self.full:
                raise OSError(28, "No space left on device")
            write(memory, tree)

        monkeypatch.setattr(Memory, "_write", refuses)

    def process(self, name, arguments=None, seconds=3.0, deaf=False):
        """One command, as its own process; its state and the process's own lines."""
        halts = name in ("stop", "safe", "emergency_stop")
        self.utc_s += 7
        station = Station(self.settings, Archive(":memory:"), self.utc_s * 10**9 if halts else None)
        station._end = wire = Wire(self.rover)
        station.session.utc_ns, began_ns = self.utc_s * 10**9, self.now_ns
        wire.put = (lambda _: None) if deaf else wire.put
        request = 0
        for n in range(round(seconds * 1e9 / TICK_NS)):
            wire.now_ns = self.now_ns = self.now_ns + TICK_NS
            station.turn(ClockTurn(wire.now_ns - began_ns, None))
            if n == (0 if halts else 100):
                request = station.session.request(name, arguments or {}, wire.now_ns - began_ns)
            station.flush(wire.now_ns - began_ns)
        return station.session.requester.requests[request].state.name, station.without


@pytest.fixture
def bed(tmp_path, monkeypatch):
    return Bed(tmp_path, monkeypatch)


def test_on_a_full_disk_each_stop_is_done_and_nothing_else_is_asked(bed):
    bed.process("stop")
    bed.process("goto", PLACE)
    bed.full = True
    for _ in range(3):
        state, without = bed.process("stop")
        assert state == "COMPLETED" and "No space left" in without[0]
    assert bed.rover.executed == ["stop", "goto", "stop", "stop", "stop"]
    with pytest.raises(OSError, match="No space left"):
        bed.process("goto", PLACE)


def test_when_the_disk_writes_again_both_stop_and_goto_are_done(bed):
    bed.process("stop")
    bed.full = True
    bed.process("safe")
    bed.full = False
    assert bed.process("goto", PLACE, 6.0)[0] == "COMPLETED"  # not taken for one of before the stop
    assert bed.process("stop")[0] == "COMPLETED"  # its counter is behind the rover's mark: the fourth step is over it
    refused = bed.rover.refused
    assert bed.process("stop")[0] == "COMPLETED" and bed.rover.refused == refused


@pytest.mark.parametrize("spoil", ["folder", "file"])
def test_without_any_memory_a_stop_is_done(bed, spoil):
    bed.process("stop")
    if spoil == "folder":
        bed.settings = replace(bed.settings, state=str(bed.folder / "no" / "state"))
        (bed.folder / "no").write_text("a file")
    else:
        (bed.folder / "state" / "station-1.json").write_text("{")
    state, without = bed.process("emergency_stop")
    assert state == "COMPLETED" and "cannot be kept" in without[0]
    with pytest.raises((OSError, ConfigError)):
        bed.process("goto", PLACE)


def test_a_session_whose_disk_has_become_full_still_stops(bed):
    bed.process("stop")
    station = Station(bed.settings, Archive(":memory:"))
    station.session.utc_ns, bed.full = UTC_S * 10**9, True
    assert station._next_halt() > json.loads((bed.folder / "state" / "station-1.json").read_text())["halt"]
    station._use(station._block._replace(counter=station._block.counter_end))
    station._renew_block()
    assert "only what stops the rover" in station.session.texts[0] and station.session.only_halts


@pytest.mark.parametrize("unheard", range(0, 40))
def test_no_number_of_unheard_stops_leads_out_of_the_jump_that_the_rover_takes(unheard):
    told = 100
    kept = halt_numbers.kept(told + 5, told, unheard)
    for utc_s in (0, UTC_S, 2**16 - 1):
        assert told < kept <= halt_numbers.unkept(kept, told, unheard, utc_s) < told + MAX_JUMP - 1000


def test_stops_that_a_deaf_rover_never_heard_do_not_lock_the_station_out(bed):
    bed.process("stop")
    for n in range(12):
        bed.full = n % 2 == 1
        bed.process("stop", seconds=10.0, deaf=True)
    bed.full = False
    assert bed.process("stop")[0] == "COMPLETED"


@pytest.mark.parametrize("windows", [None, "nonsense"])
def test_a_stop_needs_no_readable_contact_windows(bed, windows):
    if windows:
        (bed.folder / "windows.txt").write_text(windows)
    bed.settings = replace(bed.settings, contacts=str(bed.folder / "windows.txt"))
    state, without = bed.process("stop")
    assert state == "COMPLETED" and "windows.txt" in without[0]
    with pytest.raises(ConfigError, match="windows"):
        bed.process("goto", PLACE)


def test_sent_without_it_is_said_only_of_what_was_sent(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "archive.db").write_bytes(b"no database" * 1000)
    (tmp_path / "ground.toml").write_text(
        "bench_seed = 7\narchive = 'archive.db'\nendpoint = 'tcp/127.0.0.1:1'\nstate = 'state'\n"
    )
    monkeypatch.setattr("ground.cli.operations.operate._ALONE_LIMIT_S", 0.1)
    (tmp_path / "state").write_text("a file")
    assert run(["stop"]) == 69
    streams = capsys.readouterr()
    assert "sent without it" not in streams.out + streams.err and "no link" in streams.err
