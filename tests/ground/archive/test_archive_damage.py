"""An archive that was damaged within: a line that names row and column, exit code 65, never a traceback."""

import os
import sqlite3
import stat

import pytest
from typer.testing import CliRunner

from ground.__main__ import app
from ground.archive.read import chains, gaps, info, newest_product, reading, rows
from ground.archive.store import Archive, ArchiveError
from onboard.drivers.storage.map_tiles import write_whole
from onboard.drivers.storage.record_file import DiskFile
from onboard.drivers.storage.state_folder import count_boot


@pytest.fixture
def path(tmp_path):
    with Archive(tmp_path / "a" / "archive.db", utc_ns=10**18) as archive:
        archive.add("datagrams", 10, "down", "ok", b"\x00\xff", 3, 1)
        archive.add("items", 10, 7, "mode", 2, 1)
        archive.add("events", 10, 7, 1, "info", "MODE", "there", 1)
        archive.add("requests", 10, 1, 1, "goto", '{"x_m": 1}')
        archive.add("reports", 20, 1, 1, 3, "COMPLETED", 0, "there", "[]", 1)
        archive.add("products", 20, 1, "ldem", "zstd", b"1")
    return tmp_path / "a" / "archive.db"


def damage(path, change):
    with sqlite3.connect(path) as db:
        db.execute(change)


DAMAGE = [
    "update reports set state = 'DONE'",
    "update reports set state = null",
    "update reports set at_ns = 'x'",
    "update reports set serial = x'00'",
    "update reports set text = cast(x'ff' as text)",
    "update items set at_ns = 'soon'",
    "update items set value = 'a text'",
    "update events set severity = x'00'",
    "update events set number = 'x'",
    "update requests set at_ns = 'x'",
    "update requests set name = null",
    "update requests set arguments = '[]'",
    "update requests set arguments = '[[['",
    "update products set data = null",
    "update products set data = 'text'",
    "update datagrams set data = 7",
]


@pytest.mark.parametrize("change", DAMAGE)
def test_damaged_content_is_one_error_that_names_the_archive(path, change):
    damage(path, change)
    with pytest.raises(ArchiveError) as raised, reading(path) as db:
        for table in ("datagrams", "items", "events", "requests", "reports", "products"):
            list(rows(db, table))
        chains(db)
        newest_product(db, "ldem")
    assert str(path) in str(raised.value) and "\n" not in str(raised.value) and raised.value.code == 65


def test_a_silence_between_times_that_are_no_numbers_is_one_error(path):
    with sqlite3.connect(path) as db:
        names = [row[1] for row in db.execute("pragma table_info(datagrams)") if row[1] != "id"]
        fields = ", ".join("'soon'" if name == "at_ns" else name for name in names)
        db.execute(f"insert into datagrams ({', '.join(names)}) select {fields} from datagrams")
    with pytest.raises(ArchiveError) as raised, reading(path) as db:
        gaps(db)
    assert "datagrams.at_ns" in str(raised.value) and raised.value.code == 65


def test_a_time_that_no_calendar_has_is_one_error(path):
    damage(path, "update datagrams set at_ns = 1e300")
    with pytest.raises(ArchiveError) as raised, reading(path) as db:
        info(db)
    assert "datagrams.at_ns" in str(raised.value)


@pytest.mark.parametrize("change", DAMAGE)
def test_no_verb_that_reads_an_archive_ends_in_a_traceback(path, change):
    damage(path, change)
    (path.parent / "ground.toml").write_text("bench_seed = 7\narchive = 'archive.db'\n")
    end = ("--station", str(path.parent / "ground.toml"))
    for words in (
        ("events",),
        ("requests",),
        ("link", "--since", "100000d"),
        ("archive", "info"),
        ("archive", "gaps"),
        ("archive", "show", "items"),
        ("archive", "show", "reports"),
        ("archive", "export", "--out", str(path.parent / "out")),
    ):
        done = CliRunner().invoke(app, [*words, *end])
        told = isinstance(done.exception, ArchiveError | SystemExit | None)
        assert told, (words, done.exception)


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def test_archive_state_and_records_are_for_their_owner_alone(tmp_path):
    before = os.umask(0o022)
    try:
        with Archive(tmp_path / "a" / "archive.db") as archive:
            archive.add("items", 10, 7, "mode", 2)
            archive.commit()
            made = list((tmp_path / "a").iterdir())
            assert len(made) >= 3 and {mode(path) for path in made} == {0o600}
        count_boot(str(tmp_path / "state"), 1)
        DiskFile(tmp_path / "records" / "run.mcap").close()
        for name, file in (("a", "archive.db"), ("state", "boots.json"), ("records", "run.mcap")):
            assert mode(tmp_path / name) == 0o700 and mode(tmp_path / name / file) == 0o600
        write_whole(tmp_path / "boots.json", b"1")
        assert mode(tmp_path / "boots.json") == 0o600
    finally:
        os.umask(before)
