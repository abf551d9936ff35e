"""What the rover told, out of its own record, fills an archive that the link left holes in."""

import pytest

from ground.__main__ import run
from ground.archive.read import reading, rows
from ground.archive.record_talk import NoTalkError, told_down
from ground.archive.store import Archive
from ground.link.telemetry import Value
from tests.onboard.record_rig import fly


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    return fly(tmp_path_factory.mktemp("talk") / "onboard.mcap", settings={"link.boot_count": 4})[0]


def test_the_archive_gets_what_it_had_not_once_and_keeps_what_it_had(record, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    boot_id, heard = told_down(record)
    values = [one for one in heard if isinstance(one, Value)]
    assert boot_id == 4 and {"mode", "x_m", "voltage_v"} <= {value.name for value in values}
    assert max(value.onboard_ns for value in values) == 2_510_000_000  # of three seconds at 2 Hz, in odd ticks
    with Archive(tmp_path / "a.db", utc_ns=10**18) as archive:
        for value in values[::2]:
            archive.add("items", value.onboard_ns + 7, *value, boot_id)
    assert run(["archive", "fill", str(record), "--archive", "a.db"]) == 0
    with reading(tmp_path / "a.db") as db:
        kept = {(row["name"], row["onboard_ns"]): row for row in rows(db, "items")}
    assert set(kept) == {(value.name, value.onboard_ns) for value in values}
    late = [row for row in kept.values() if row["filled"]]
    assert late and len(late) < len(kept)
    assert {row["utc_ns"] - row["onboard_ns"] for row in kept.values()} == {10**18 + 7}  # as what was heard in time
    capsys.readouterr()
    assert run(["archive", "fill", str(record), "--archive", "a.db", "--json"]) == 0
    assert capsys.readouterr().out == '{"boot_id": 4, "values": 0, "events": 0}\n'


def test_a_record_that_was_cut_off_or_still_grows_tells_what_its_whole_chunks_hold(record, tmp_path):
    data = record.read_bytes()
    (tmp_path / "growing.mcap").write_bytes(data[: len(data) * 2 // 3])
    boot_id, told = told_down(tmp_path / "growing.mcap")
    assert boot_id == 4 and repr(told) == repr(told_down(record)[1][: len(told)])  # NaN is not itself
    assert told[-1].onboard_ns > 1_000_000_000


def test_a_record_of_several_parts_tells_all_of_them(tmp_path):
    first = fly(tmp_path / "parts.mcap", settings={"record.part_bytes": 100_000})[0]
    assert (tmp_path / "parts.2.mcap").is_file()
    assert repr(told_down(first)[1]) == repr(told_down(fly(tmp_path / "whole.mcap")[0])[1])


def test_a_record_that_is_not_there_ends_with_66(tmp_path, capsys):
    Archive(tmp_path / "a.db").close()
    assert run(["archive", "fill", str(tmp_path / "none.mcap"), "--archive", str(tmp_path / "a.db")]) == 66
    assert "none.mcap: No such file" in capsys.readouterr().err


def test_what_is_no_record_is_one_line(tmp_path, capsys):
    with pytest.raises(NoTalkError, match="No such file"):
        told_down(tmp_path / "none.mcap")
    (tmp_path / "bad.mcap").write_bytes(b"x" * 100)
    Archive(tmp_path / "a.db").close()
    assert run(["archive", "fill", str(tmp_path / "bad.mcap"), "--archive", str(tmp_path / "a.db")]) == 65
    assert "no record of a rover, or damaged" in capsys.readouterr().err
