"""A disk that refuses stops no tick: it is named, what was written waits, and less is kept of each tick."""

import errno
import os
import threading

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.bringup.records.info import info_of
from onboard.drivers.storage.record_file import STALLED_FLUSHES, RecordFile
from onboard.record.reader import DamagedRecordError, open_record
from onboard.record.replay import replay
from onboard.record.schema import LEAN, OUTPUTS
from onboard.records import RecordedParts, RecordTrouble
from protocol.tables.faults import BY_NAME
from tests.onboard.record_rig import GOOD, Disk, fly

TICK_S = 0.01
ROWS = {"DISK_FULL": errno.ENOSPC, "RECORD_FAIL": errno.EROFS}
SMALL = {"record.waiting_bytes": 1 << 16}


def faults(events):
    """(tick, name) of what was reported, and of what was said to be over."""
    return [(e.now_ns // 10_000_000, e.name, e.text.partition(":")[0]) for e in events if e.name.startswith("FAULT")]


@pytest.mark.parametrize("row", ROWS)
@pytest.mark.parametrize("first", [51, 77, 100, 101])
def test_a_disk_that_refuses_is_named_within_a_second_and_the_record_has_no_hole_when_it_takes_again(
    tmp_path, row, first
):
    disk = Disk(ROWS[row], (first, 400))
    path, _, events = fly(tmp_path / "run.mcap", ticks=600, disk=disk)
    (found, begin, name), (healed, end, over) = faults(events)
    assert (begin, name, end, over) == ("FAULT", row, "FAULT_CLEARED", row)
    assert first <= found <= first + BY_NAME[row].detect_s / TICK_S
    assert 400 < healed <= 400 + 1.0 / TICK_S
    verdict = replay(disk.store(path))
    assert verdict.identical and verdict.ticks == 600 and not verdict.cut_off
    assert info_of(path).channels["/in/record"].messages == healed - found


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG])
def test_no_room_of_any_kind_is_a_full_disk(tmp_path, number):
    _, statuses, _ = fly(tmp_path / "run.mcap", ticks=100, disk=Disk(number, (10, 100)))
    assert statuses[-1].trouble is RecordTrouble.FULL


@pytest.mark.parametrize("number", [errno.EIO, errno.EROFS, errno.ENOENT, errno.EBADF, errno.ENODEV])
def test_any_other_refusal_is_a_failed_record(tmp_path, number):
    _, statuses, _ = fly(tmp_path / "run.mcap", ticks=100, disk=Disk(number, (10, 100)))
    assert statuses[-1].trouble is RecordTrouble.FAILED


def test_room_that_has_to_stay_free_is_not_used(tmp_path):
    disk = Disk(room_bytes=100_000)
    path, statuses, events = fly(tmp_path / "run.mcap", ticks=600, disk=disk, settings={"record.spare_bytes": 40_000})
    assert statuses[-1].trouble is RecordTrouble.FULL and "are to stay free" in statuses[-1].error
    assert len(disk.files[path]) <= 60_000
    assert [name for _, _, name in faults(events)] == ["DISK_FULL"]


def test_a_disk_that_refuses_from_the_start_on_stops_no_tick(tmp_path):
    disk = Disk(errno.EROFS, (0, 250))
    path, statuses, events = fly(tmp_path / "run.mcap", ticks=400, disk=disk)
    assert statuses[0].trouble is RecordTrouble.FAILED  # before the first tick
    assert faults(events)[0] == (1, "FAULT", "RECORD_FAIL")
    assert replay(disk.store(path)).ticks == 400


def test_while_it_refuses_outputs_are_dropped_first_and_a_replay_compares_what_was_kept(tmp_path):
    disk = Disk(errno.EIO, (100, 700))
    path, statuses, _ = fly(tmp_path / "run.mcap", ticks=800, disk=disk, settings={"record.waiting_bytes": 300_000})
    lean = [k for k, status in enumerate(statuses, 1) if status.keeps is RecordedParts.LEAN]
    assert lean and all(status.keeps is not RecordedParts.NOTHING for status in statuses)
    verdict = replay(disk.store(path))
    assert verdict.identical and verdict.ticks == 800
    for number, messages in open_record(path).ticks():
        assert (number in lean) == (set(messages).isdisjoint(set(OUTPUTS) - set(LEAN))), number
    assert info_of(path).lean == len(lean)


def test_when_memory_is_used_up_nothing_is_kept_and_the_record_says_how_many_ticks_it_lacks(tmp_path):
    disk = Disk(errno.ENOSPC, (100, 1200))
    path, statuses, _ = fly(tmp_path / "run.mcap", ticks=1400, disk=disk, settings=SMALL)
    lost = sum(status.keeps is RecordedParts.NOTHING for status in statuses)
    assert lost > 0 and statuses[-1].lost_ticks == lost
    assert statuses[-1].trouble is RecordTrouble.NONE
    info = info_of(disk.store(path))
    assert (info.missing, info.ticks, info.replayable) == (lost, 1400 - lost, False)
    with pytest.raises(DamagedRecordError, match=f"are missing; {lost} ticks of the run were not kept"):
        replay(path)


def test_what_waits_takes_no_more_memory_than_is_allowed_and_the_chunk_that_passed_it(tmp_path):
    waiting = []
    fly(
        tmp_path / "run.mcap",
        ticks=900,
        disk=Disk(errno.ENOSPC, (0, 10_000)),
        settings=SMALL,
        look=lambda recorder: waiting.append(recorder.waiting_bytes),
    )
    assert SMALL["record.waiting_bytes"] < max(waiting) < SMALL["record.waiting_bytes"] + 20_000


def test_on_a_good_disk_the_status_is_that_of_the_start_throughout(tmp_path):
    assert set(fly(tmp_path / "run.mcap", ticks=120)[1]) == {GOOD}


# -- the file ------------------------------------------------------------------------------------------------------


@given(st.lists(st.tuples(st.binary(max_size=40), st.booleans(), st.floats(0, 1)), max_size=30))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_whatever_a_disk_refuses_the_file_is_a_beginning_of_what_was_written_that_ends_with_a_piece(
    tmp_path_factory, steps
):
    path, disk = tmp_path_factory.mktemp("file") / "f", Disk(errno.EIO)
    file, written, borders = RecordFile(path, 0, True, disk.open), b"", [0]
    for data, good, torn in steps:
        disk._broken, disk._torn = not good, torn
        file.write(data)
        written += data
        borders.append(len(written))
        file.flush()
        on_disk = bytes(disk.files.get(path, b""))
        assert file.tell() == len(written)
        if good:
            assert on_disk == written and file.waiting_bytes == 0 and file.error is None
        elif file.waiting_bytes:
            assert file.error is not None
        settled = len(written) - file.waiting_bytes
        assert on_disk[:settled] == written[:settled] and settled in borders
    file.close()


def test_a_real_file_is_written_whole_and_forced(tmp_path, monkeypatch):
    forced = []
    monkeypatch.setattr(os, "fdatasync", lambda fd: forced.append(os.fstat(fd).st_size))
    file = RecordFile(tmp_path / "deep" / "f", 0, wait=True)
    file.write(b"abc")
    file.write(b"def")
    file.flush()
    assert (tmp_path / "deep" / "f").read_bytes() == b"abcdef" and forced == [6]
    file.close()


def test_a_real_disk_without_room_refuses(tmp_path):
    (tmp_path / "f").symlink_to("/dev/full")
    file = RecordFile(tmp_path / "f", 0, wait=True)
    file.write(b"abc")
    file.flush()
    assert file.error is not None and file.error.errno == errno.ENOSPC and file.waiting_bytes == 3
    file.close()


def test_a_folder_that_may_not_be_written_is_an_error_and_no_exception(tmp_path):
    (tmp_path / "file").write_bytes(b"")
    file = RecordFile(tmp_path / "file" / "f", 0, wait=True)
    file.write(b"abc")
    file.flush()
    assert file.error is not None and file.error.errno in (errno.ENOTDIR, errno.EEXIST)
    file.close()


def test_a_disk_that_does_not_answer_is_an_error_after_a_while_and_the_caller_never_waits(tmp_path):
    answers = threading.Event()

    class Deaf(Disk):
        def ask(self):
            answers.wait()

    file = RecordFile(tmp_path / "f", 0, False, Deaf().open)
    for _ in range(STALLED_FLUSHES + 1):
        assert file.error is None
        file.write(b"x")
        file.flush()
    assert file.error is not None and file.error.errno == errno.ETIMEDOUT
    answers.set()
    file.settle()
    file.flush()
    file.settle()
    assert file.error is None and file.waiting_bytes == 0
    file.close()
