"""A record whose program was killed or whose disk lost its power, at any byte: all up to the last whole chunk."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.records import Chunk
from mcap.stream_reader import StreamReader

from onboard.bringup.records.cut import Slice, cut
from onboard.bringup.records.info import info_of
from onboard.native.variant import available
from onboard.record import reader
from onboard.record.parts import part_path
from onboard.record.reader import DamagedRecordError, open_record, survey
from onboard.record.replay import last_map, replay
from onboard.record.replay_command import print_verdict
from onboard.record.writer import FLUSH_TICKS
from tests.onboard.app.test_wall_clock import alone, started
from tests.onboard.record_rig import TICKS, fly

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    return fly(tmp_path_factory.mktemp("record") / "onboard.mcap")[0]


@pytest.fixture(scope="module")
def borders(record):
    """(byte after it, last tick) of each chunk."""
    found = []
    with record.open("rb") as file:
        for one in StreamReader(file, emit_chunks=True).records:
            if isinstance(one, Chunk):
                found.append((file.tell(), one.message_end_time // 10_000_000))
    return found


def shortened(record, path, size):
    path.write_bytes(record.read_bytes()[:size])
    return path


def test_a_chunk_ends_at_least_twice_a_second_and_holds_whole_ticks(borders):
    assert [tick for _, tick in borders] == list(range(FLUSH_TICKS, TICKS + 1, FLUSH_TICKS))


def test_a_record_that_grows_while_it_is_read_is_what_it_was_at_the_start(record, borders, tmp_path, monkeypatch):
    """Found as `-67909 bytes behind it are no whole chunk`."""
    end, tick = borders[1]
    growing = shortened(record, tmp_path / "growing.mcap", end + 7)
    note = reader._note

    def note_and_grow(*words):
        growing.write_bytes(record.read_bytes()[: borders[3][0]])
        return note(*words)

    monkeypatch.setattr(reader, "_note", note_and_grow)
    assert open_record(growing).cut_off == f"cut off after tick {tick}, 7 bytes behind it are no whole chunk"


@given(st.floats(0.0, 1.0, exclude_max=True))
@settings(max_examples=80, deadline=None, derandomize=True)
def test_cut_at_any_byte_every_tick_of_the_last_whole_chunk_is_there(record, borders, tmp_path_factory, share):
    size = within(record, borders, share)
    path = shortened(record, tmp_path_factory.mktemp("cut") / "cut.mcap", size)
    whole = max((tick for end, tick in borders if end <= size), default=0)
    try:
        found = open_record(path)
    except DamagedRecordError:
        assert size < borders[0][0]
        return
    assert [number for number, _ in found.ticks()] == list(range(1, whole + 1))
    assert found.cut_off.startswith(f"cut off after tick {whole}, ")


def within(record, borders, share):
    """A size that leaves the first chunk whole, and this share of what is behind it."""
    first = borders[0][0]
    return first + int(share * (record.stat().st_size - first))


@pytest.mark.parametrize("share", [0.2, 0.6, 0.999])
def test_a_replay_of_it_is_identical_as_far_as_it_goes_and_says_how_far(record, borders, tmp_path, capsys, share):
    path = shortened(record, tmp_path / "cut.mcap", within(record, borders, share))
    verdict = replay(path)
    assert verdict.identical and 0 < verdict.ticks <= TICKS
    assert verdict.cut_off.startswith(f"cut off after tick {verdict.ticks}, ")
    assert print_verdict(path, False, replay) == 0
    assert capsys.readouterr().out.splitlines()[1] == verdict.cut_off


@pytest.mark.parametrize("size", [0, 5, 8, 30, 400])
def test_what_holds_no_tick_is_never_identical(record, tmp_path, capsys, size):
    path = shortened(record, tmp_path / "cut.mcap", size)
    assert print_verdict(path, False, replay) in (1, 65)
    assert "identical" not in capsys.readouterr().out


@given(st.floats(0, 0.95), st.integers(1, 5000), st.booleans())
@settings(max_examples=25, deadline=None, derandomize=True)
def test_an_end_that_was_never_written_leaves_the_chunks_before_it(record, borders, tmp_path_factory, share, more, one):
    """A file system that knows the new length and has not the new bytes: zeros, or what was there before."""
    size = within(record, borders, share)
    path = shortened(record, tmp_path_factory.mktemp("torn") / "torn.mcap", size)
    path.write_bytes(path.read_bytes() + (b"\xff" if one else b"\0") * more)
    whole = max(tick for end, tick in borders if end <= size)
    assert [number for number, _ in open_record(path).ticks()] == list(range(1, whole + 1))


def test_damage_before_the_end_of_a_record_that_was_cut_off_is_damage(record, borders, tmp_path):
    whole = bytearray(record.read_bytes()[: borders[-1][0]])
    whole[borders[2][0] - 200] ^= 1  # in the third of six chunks
    path = tmp_path / "both.mcap"
    path.write_bytes(whole)
    with pytest.raises(DamagedRecordError, match=f"as far as tick {borders[1][1]}; then: "):
        open_record(path)


def test_cut_makes_a_closed_record_of_it_that_replays(record, tmp_path):
    path = shortened(record, tmp_path / "cut.mcap", int(0.7 * record.stat().st_size))
    ticks = cut(path, tmp_path / "whole.mcap", Slice())
    made = survey(tmp_path / "whole.mcap")
    assert made.closed and made.part["cut_from"] == "cut.mcap"
    verdict = replay(tmp_path / "whole.mcap")
    assert verdict.identical and verdict.ticks == ticks and not verdict.cut_off


def test_a_flight_program_that_is_killed_leaves_a_record_up_to_the_last_second(tmp_path):
    path = tmp_path / "onboard.mcap"
    lived_s = 3.0
    with started("run", **alone(path)) as program:
        assert program.stderr.readline().startswith("onboard: running")
        with pytest.raises(subprocess.TimeoutExpired):
            program.wait(lived_s)
        os.kill(program.pid, signal.SIGKILL)
        program.wait()
    found = open_record(path)
    assert "cut off" in found.cut_off
    assert found.files[0].last_tick * 0.01 >= lived_s - 1.0
    assert info_of(path).replayable
    assert replay(path).identical


# -- parts -----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    """A run in several files."""
    path = tmp_path_factory.mktemp("parts") / "run.mcap"
    fly(path, ticks=1000, settings={"record.part_bytes": 65536})
    return [part for n in range(1, 9) if (part := part_path(path, n)).is_file()]


def test_a_long_record_goes_on_in_parts_that_are_read_and_replayed_as_one(parts):
    assert len(parts) >= 3
    assert all(survey(part).closed for part in parts)
    verdict = replay(parts[0])
    assert verdict.identical and verdict.ticks == 1000
    assert len(info_of(parts[0]).files) == len(parts)


def test_a_part_that_begins_later_says_why_it_cannot_be_replayed(parts):
    with pytest.raises(DamagedRecordError, match=r"it begins at tick \d+: part 2 of a run"):
        replay(parts[1])
    assert not info_of(parts[1]).replayable
    assert last_map(parts[1]) == ()


def test_a_part_of_another_run_is_not_taken_for_the_next(parts, tmp_path):
    for part in parts:
        (tmp_path / part.name).write_bytes(part.read_bytes())
    (tmp_path / parts[0].name).write_bytes(fly(tmp_path / "other.mcap")[0].read_bytes())
    assert replay(tmp_path / parts[0].name).ticks == TICKS


def test_cut_joins_parts(parts, tmp_path):
    assert cut(parts[0], tmp_path / "one.mcap", Slice()) == 1000
    assert replay(tmp_path / "one.mcap").ticks == 1000


def test_the_next_run_removes_the_parts_of_the_one_before(tmp_path):
    path = tmp_path / "run.mcap"
    fly(path, ticks=600, settings={"record.part_bytes": 65536})
    assert part_path(path, 2).is_file()
    fly(path, ticks=100)
    assert not part_path(path, 2).is_file()


def test_a_folder_has_a_record_for_each_run_and_the_oldest_go(tmp_path):
    settings = {"record.part_bytes": 65536, "record.keep_bytes": 250_000}
    for _ in range(6):
        fly(f"{tmp_path}/", ticks=TICKS, settings=settings)
        assert sum(path.stat().st_size for path in tmp_path.iterdir()) <= settings["record.keep_bytes"] + 20_000
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names[-1].startswith("0006") and "0001.mcap" not in names
    assert replay(tmp_path / "0006.mcap").ticks == TICKS


@pytest.mark.parametrize("simd", available()[:2])
def test_a_record_with_maps_and_plans_replays_identical_on_either_build_of_the_kernels(flown, simd):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "EL_DORADO_SIMD": simd}
    done = subprocess.run(
        [sys.executable, "-m", "onboard", "replay", str(flown)],
        env=environment,
        text=True,
        capture_output=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith("identical: ")


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A first scan, its map and plan, and the beginning of the drive."""
    from dataclasses import replace

    from onboard.record.writer import Recorder
    from tests.onboard.core_bench import QUICK, CoreBench

    path = tmp_path_factory.mktemp("flown") / "onboard.mcap"
    config = replace(QUICK, record=replace(QUICK.record, path=str(path)))
    rover = CoreBench(settings=config)
    with Recorder(config, None) as recorder:
        step = rover.step

        def recorded():
            outputs = step()
            recorder.write(rover.inputs, outputs)
            return outputs

        rover.step = recorded
        rover.settle()
        rover.goto(3.0, 0.5)
        rover.until_driving()
        rover.run(1.0)
    return path
