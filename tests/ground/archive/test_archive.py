"""The archive keeps what was committed, whatever happens to the station."""

import csv
import json
import os
import signal
import sqlite3
import subprocess
import sys

import duckdb
import pytest
from mcap.reader import make_reader

from ground.archive.export import FORMATS
from ground.archive.read import ALL, Span, chains, gaps, reading, rows, sizes
from ground.archive.retention import fill, pack, prune
from ground.archive.schema import APPLICATION_ID, MIGRATIONS, VERSION, open_checked
from ground.archive.store import TABLES, Archive, ArchiveError
from ground.link.telemetry import Event, Value
from protocol.link.datagrams import DatagramKind, Sealer


def test_rows_come_back_as_they_went_in(tmp_path):
    with Archive(tmp_path / "a" / "archive.db") as archive:
        archive.add("datagrams", 10, "down", "ok", b"\x00\xff")
        archive.add("items", 10, 7, "mode", 2)
        archive.add("reports", 20, 1, 1, 3, "COMPLETED", 0, "there", "[]")
        assert archive.rows("datagrams") == [(10, "down", "ok", b"\x00\xff", None, None)]
        assert archive.rows("items") == [(10, 7, "mode", 2, None, None)]
        assert archive.rows("reports") == [(20, 1, 1, 3, "COMPLETED", 0, "there", "[]", None)]


def test_each_opening_is_a_run_of_its_own(tmp_path):
    for n in range(2):
        with Archive(tmp_path / "archive.db") as archive:
            assert archive.rows("items") == []
            archive.add("items", n, n, "mode", n)
    with sqlite3.connect(tmp_path / "archive.db") as db:
        assert db.execute("select run, value from items").fetchall() == [(1, 0), (2, 1)]


def test_committed_rows_survive_a_kill(tmp_path):
    child = (
        "import sys, time\nfrom ground.archive.store import Archive\n"
        "a = Archive(sys.argv[1])\na.add('items', 1, 1, 'kept', 1)\na.commit()\na.add('items', 2, 2, 'lost', 2)\n"
        "sys.stdout.write('ready\\n'); sys.stdout.flush(); time.sleep(60)"
    )
    path = tmp_path / "archive.db"
    run = subprocess.Popen([sys.executable, "-c", child, str(path)], stdout=subprocess.PIPE, env={**os.environ})
    assert run.stdout.readline() == b"ready\n"
    run.send_signal(signal.SIGKILL)
    run.wait()
    run.stdout.close()
    with sqlite3.connect(path) as db:
        assert db.execute("select name from items").fetchall() == [("kept",)]


@pytest.mark.parametrize("table", TABLES)
def test_every_table_starts_with_its_time(tmp_path, table):
    with Archive(":memory:") as archive:
        assert archive.rows(table) == []
        columns = [row[1] for row in archive._db.execute(f"pragma table_info({table})")]
        assert columns[:2] == ["run", "at_ns"]


def test_an_unknown_table_is_refused():
    with Archive(":memory:") as archive, pytest.raises(ValueError, match="no table `item`"):
        archive.add("item", 1)


# -- what a station meets ----------------------------------------------------------------------------------------------


def filled(path, rows=3):
    with Archive(path) as archive:
        for n in range(rows):
            archive.add("items", n, n, "mode", n)


def test_a_killed_station_leaves_whole_turns_and_all_that_it_said_were_safe(tmp_path):
    child = (
        "import sys\nfrom ground.archive.store import Archive\na = Archive(sys.argv[1])\n"
        "for n in range(10**6):\n"
        "    for k in range(7): a.add('items', n, n, 'turn', k)\n"
        "    a.commit()\n    sys.stdout.write(f'{n}\\n'); sys.stdout.flush()\n"
    )
    path = tmp_path / "archive.db"
    run = subprocess.Popen([sys.executable, "-c", child, str(path)], stdout=subprocess.PIPE, env={**os.environ})
    for line in run.stdout:
        said = int(line)
        if said >= 200:
            run.send_signal(signal.SIGKILL)
            break
    said = max([said, *(int(line) for line in run.stdout if line.strip())])
    run.wait()
    run.stdout.close()
    with sqlite3.connect(path) as db:
        turns = dict(db.execute("select at_ns, count(*) from items group by at_ns"))
        assert db.execute("pragma integrity_check").fetchone() == ("ok",)
    assert set(turns.values()) == {7}
    assert set(turns) >= set(range(said + 1))


def test_on_a_full_disk_rows_wait_and_are_written_when_there_is_room(tmp_path):
    path = tmp_path / "archive.db"
    with Archive(path) as archive:
        pages = archive._db.execute("pragma page_count").fetchone()[0]
        archive._db.execute(f"pragma max_page_count = {pages + 1}")
        for n in range(2000):
            archive.add("datagrams", n, "down", "ok", bytes(500))
            archive.commit()
        assert archive.trouble == f"{path}: the disk is full; free some, or `ground archive prune`"
        archive._db.execute("pragma max_page_count = 1000000")
        for _ in range(100):
            archive.commit()
        assert archive.trouble == ""
        assert len(archive.rows("datagrams")) == 2000


def test_what_a_full_disk_does_not_take_until_the_end_is_told_with_its_number(tmp_path):
    archive = Archive(tmp_path / "archive.db")
    archive._db.execute("pragma max_page_count = 1")
    for n in range(400):
        archive.add("datagrams", n, "down", "ok", bytes(500))
    with pytest.raises(ArchiveError, match=r"the disk is full.*400 rows of this run are not in it"):
        archive.close()


def test_while_another_program_holds_the_file_rows_wait(tmp_path):
    path = tmp_path / "archive.db"
    with Archive(path) as archive:
        other = sqlite3.connect(path, isolation_level=None)
        other.execute("begin immediate")
        archive.add("items", 1, 1, "mode", 1)
        archive.commit()
        assert "locked by another program" in archive.trouble
        other.execute("rollback")
        other.close()
    with reading(path) as db:
        assert [row["value"] for row in rows(db, "items")] == [1]


@pytest.fixture
def held(tmp_path):
    """An archive that another program holds; `execute("rollback")` lets it go."""
    path = tmp_path / "a.db"
    with Archive(path, 5):
        pass
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("begin immediate")
    yield path, other
    other.close()


def test_who_does_not_want_to_wait_begins_at_once_and_what_is_heard_is_written_when_it_can_be(held):
    path, other = held
    with Archive(path, 10**18, "shell", wait_s=0.0, later=True) as archive:
        assert archive.late and archive.trouble == f"{path}: locked by another program for 0 s"
        archive.add("requests", 2, 7, 1, "goto", "{}", b"", "shell alice@desk")
        for n in range(60):
            archive.add("items", n, n, "mode", n)
            archive.commit()
        assert archive.late and archive.halt_after(7, 1) == "" and archive.orphans(1) == []
        with pytest.raises(ArchiveError, match="locked"):
            archive.chunks()
        other.execute("rollback")
        for n in range(60, 120):
            archive.add("items", n, n, "mode", n)
            archive.commit()
        assert not archive.late and archive.trouble == "" and archive.chunks() == []
        assert [row[3] for row in archive.rows("items")] == list(range(120))
    with reading(path) as db:
        assert [(row["run"], row["utc_ns"]) for row in rows(db, "requests")] == [(2, 10**18 + 2)]
        assert db.execute("select note from runs where run = 2").fetchone() == ("shell",)


def test_what_could_be_written_only_at_the_end_is(held):
    path, other = held
    with Archive(path, 10**18, wait_s=0.0, later=True) as archive:
        archive.add("items", 1, 1, "mode", 4)
        archive.commit()
        other.execute("rollback")
    with reading(path) as db:
        assert [row["value"] for row in rows(db, "items")] == [4]


def test_what_could_not_be_written_to_the_end_is_told_with_its_number(held, monkeypatch):
    path, _ = held
    monkeypatch.setattr("ground.archive.store._CLOSE_MS", 0)
    with pytest.raises(ArchiveError, match="locked by another program for 0 s; 2 rows of this run are not in it"):  # noqa: SIM117
        with Archive(path, 10**18, wait_s=0.0, later=True) as archive:
            archive.add("items", 1, 1, "mode", 4)
            archive.add("items", 2, 2, "mode", 4)


@pytest.mark.parametrize("spoil", ["pragma user_version = 9", "pragma application_id = 7"])
def test_a_file_that_is_no_archive_of_ours_is_refused_at_once_though_one_would_wait(tmp_path, spoil):
    path = tmp_path / "a.db"
    filled(path)
    with sqlite3.connect(path) as db:
        db.execute(spoil)
    db.close()
    with pytest.raises(ArchiveError, match=r"version 9|another program"):
        Archive(path, wait_s=0.0, later=True)


def test_a_file_of_the_first_version_is_brought_up_to_date_with_its_rows(tmp_path):
    path, datagram = tmp_path / "old.db", Sealer(b"k" * 32, 0, 5, counter=77).seal(DatagramKind.MAVLINK, b"")
    with sqlite3.connect(path) as db:
        db.executescript(MIGRATIONS[0])
        db.execute("insert into runs values (1, 1000, '')")
        db.execute("insert into datagrams values (1, 10, 'down', 'ok', ?)", (datagram,))
        db.execute("insert into datagrams values (1, 11, 'down', 'length', x'00')")
        db.execute("insert into items values (1, 10, 7, 'mode', 2)")
        db.execute("insert into requests values (1, 5, 1, 1, 'stop', '{}')")
    db.close()
    with reading(path) as db:
        assert [(r["counter"], r["boot_id"]) for r in rows(db, "datagrams")] == [(77, 5), (None, None)]
        assert [(r["name"], r["value"], r["boot_id"], r["utc_ns"]) for r in rows(db, "items")] == [("mode", 2, 5, 1010)]
        assert [(chain.name, chain.asked_by) for chain in chains(db)] == [("stop", "")]
    with Archive(path) as archive:
        archive.add("items", 1, 1, "mode", 3)
    with sqlite3.connect(path) as db:
        assert db.execute("pragma user_version").fetchone() == (VERSION,)


@pytest.mark.parametrize("version", range(1, VERSION + 1))
def test_an_archive_of_every_version_comes_up_to_date_without_loss(tmp_path, version):
    """As each version's own program left it: its statements, its number, a request with its reports."""
    path = tmp_path / "old.db"
    with sqlite3.connect(path) as db:
        db.create_function("counter_of", 1, lambda _: None)
        db.create_function("boot_of", 1, lambda _: None)
        for statements in MIGRATIONS[:version]:
            db.executescript(statements)
        db.execute(f"pragma user_version = {version}")
        db.execute(f"pragma application_id = {APPLICATION_ID}")
        db.execute("insert into runs values (1, 1000, '')")
        names = "run, at_ns, request_id, station, name, arguments"
        db.execute(f"insert into requests ({names}) values (1, 5, 9, 1, 'goto', '{{}}')")
        db.execute(
            "insert into reports (run, at_ns, request_id, station, serial, state, code, text, data) "
            "values (1, 6, 9, 1, 1, 'COMPLETED', 0, 'there', '[]')"
        )
    db.close()
    with Archive(path) as archive:
        archive.add("requests", 7, 10, 1, "stop", "{}", b"", "shell alice@desk")
    with reading(path) as db:
        found = [(chain.name, chain.state, chain.asked_by) for chain in chains(db)]
        assert found == [("stop", "REQUESTED", "shell alice@desk"), ("goto", "COMPLETED", "")]
        assert db.execute("pragma user_version").fetchone() == (VERSION,)


def test_a_station_killed_in_a_migration_leaves_the_old_version_whole(tmp_path, monkeypatch):
    path = tmp_path / "old.db"
    with sqlite3.connect(path) as db:
        db.executescript(MIGRATIONS[0])
    db.close()
    monkeypatch.setattr("ground.archive.schema.MIGRATIONS", (MIGRATIONS[0], MIGRATIONS[1] + "broken;\n"))
    with pytest.raises(ArchiveError):
        Archive(path)
    monkeypatch.undo()
    with sqlite3.connect(path) as db:
        assert db.execute("pragma user_version").fetchone()[0] < VERSION
        assert "counter" not in [row[1] for row in db.execute("pragma table_info(datagrams)")]
    db.close()
    filled(path)


@pytest.mark.parametrize(
    ("spoil", "text", "code"),
    [
        ("pragma user_version = 9", f"of version 9, this program writes version {VERSION}", 65),
        ("pragma application_id = 7", "a database of another program", 65),
        ("garbage", "damaged, or no archive", 65),
    ],
)
def test_a_file_that_is_no_archive_of_ours_is_refused_in_one_line_and_stays_as_it_is(tmp_path, spoil, text, code):
    path = tmp_path / "a.db"
    filled(path)
    if spoil == "garbage":
        path.write_bytes(b"not a database, but long enough to have a head" * 100)
    else:
        with sqlite3.connect(path) as db:
            db.execute(spoil)
        db.close()
    before = path.read_bytes()
    with pytest.raises(ArchiveError, match=text) as error:
        Archive(path)
    assert error.value.code == code and "\n" not in str(error.value)
    assert path.read_bytes() == before


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ArchiveError, match=r"file: (File exists|Not a directory)"):
        Archive(tmp_path / "file" / "archive.db")


# -- questions ---------------------------------------------------------------------------------------------------------


def heard(archive, counter, at_ns, boot=1):
    datagram = Sealer(b"k" * 32, 0, boot, counter=counter).seal(DatagramKind.MAVLINK, b"")
    archive.add("datagrams", at_ns, "down", "ok", datagram, counter, boot)


def test_gaps_are_what_the_numbers_say_and_late_data_fills_them(tmp_path):
    path = tmp_path / "a.db"
    with Archive(path, utc_ns=10**18) as archive:
        for counter, at_s in ((10, 0), (11, 1), (15, 2), (16, 9), (3, 9.5)):
            heard(archive, counter, round(at_s * 1e9))
        for serial in (1, 2, 5):
            archive.add("events", serial, serial, serial, "info", "MODE", "", 1)
    with reading(path) as db:
        found = sorted((g.kind, g.first, g.last, g.missing) for g in gaps(db))
    assert found == [("datagrams", 4, 9, 6), ("datagrams", 12, 14, 3), ("events", 3, 4, 2), ("silence", 2, 9, 0)]
    with Archive(path, utc_ns=10**18 + 1) as archive:
        for counter in (*range(4, 10), 12, 13):
            heard(archive, counter, 0)
        archive.add("events", 7, 7, 3, "info", "MODE", "", 1)
        archive.add("events", 8, 8, 4, "info", "MODE", "", 1)
    with reading(path) as db:
        assert [(g.first, g.last) for g in gaps(db) if g.kind == "datagrams"] == [(14, 14)]
        assert not [g for g in gaps(db) if g.kind == "events"]


def test_rows_are_found_by_name_time_and_number_and_what_two_stations_heard_comes_once(tmp_path):
    path = tmp_path / "a.db"
    for station in range(2):
        with Archive(path, utc_ns=10**18 + station) as archive:
            for n in range(5):
                archive.add("items", n * 10**9, n, "x_m", n / 2, 1)
                archive.add("items", n * 10**9, n, "y_m", -n, 1)
    with reading(path) as db:

        def values(**which):
            return [row["value"] for row in rows(db, "items", Span(**which))]

        assert values(names=("x_m",)) == [0.0, 0.5, 1.0, 1.5, 2.0]
        assert values(names=("y_m",), since_ns=10**18 + 2 * 10**9) == [-2, -3, -4]
        assert values(names=("x_m",), until_ns=10**18 + 10**9) == [0.0]
        assert values(names=("x_m",), last=2) == [1.5, 2.0]
        assert len(values(run=2)) == 10
        with pytest.raises(ValueError, match="no table `item`"):
            list(rows(db, "item"))


def test_a_chain_is_the_request_with_its_reports_in_the_order_of_their_serials():
    db = open_checked(":memory:")
    db.execute("insert into runs values (1, 0, '')")
    db.execute("insert into requests values (1, 5, 9, 1, 'goto', '{\"x_m\": 1}', null, null)")
    for serial, state in ((2, "STARTED"), (1, "ACCEPTED"), (1, "ACCEPTED"), (3, "COMPLETED")):
        db.execute("insert into reports values (1, 6, 9, 1, ?, ?, 0, '', '[]', 1)", (serial, state))
    (chain,) = chains(db)
    assert [state for _, state, _ in chain.reports] == ["ACCEPTED", "STARTED", "COMPLETED"]
    assert chain.state == "COMPLETED"


# -- keeping -----------------------------------------------------------------------------------------------------------


def flown(path, days=4, each=200):
    """A run a day, from UTC day 1 on."""
    for day in range(1, days + 1):
        with Archive(path, utc_ns=day * 86_400 * 10**9) as archive:
            archive.add("requests", 0, day, 1, "goto", "{}")
            archive.add("reports", 1, day, 1, 1, "COMPLETED", 0, "", "[]")
            archive.add("products", 1, day, "ldem", "ldem-2", bytes(2000))
            for n in range(each):
                archive.add("datagrams", n, "down", "ok", bytes(1000))
                archive.add("items", n, n, "x_m", n, day)
                archive.add("events", n, n, n, "info", "MODE", "", day)


def test_pruning_by_age_takes_old_rows_but_never_a_chain_nor_the_newest_product(tmp_path):
    path = tmp_path / "a.db"
    flown(path)
    with reading(path) as db:
        gone = prune(db, before_utc_ns=3 * 86_400 * 10**9)
        assert gone.rows == {"datagrams": 400, "items": 400, "products": 2, "events": 400}
        assert [row["run"] for row in rows(db, "requests")] == [1, 2, 3, 4] and len(chains(db)) == 4
        gone = prune(db, before_utc_ns=9 * 86_400 * 10**9)
        assert len(list(rows(db, "products"))) == 1 and len(list(rows(db, "items"))) == 0
        assert [chain.state for chain in chains(db)] == ["COMPLETED"] * 4


def test_pruning_by_size_takes_the_oldest_raw_datagrams_first_and_packing_gives_the_disk_back(tmp_path):
    path = tmp_path / "a.db"
    flown(path)
    before = path.stat().st_size
    with reading(path) as db:
        assert sizes(db)["used_bytes"] > 600_000
        gone = prune(db, most_bytes=600_000)
        assert gone.used_bytes <= 600_000
        assert gone.rows["datagrams"] > 0 and gone.rows["items"] == gone.rows["events"] == 0
        left = [row["run"] for row in rows(db, "datagrams")]
        assert left == sorted(left) and left[-1] == 4 and 1 not in left
        assert prune(db, most_bytes=1).rows["events"] == 800
        assert len(chains(db)) == 4
        pack(db)
    assert path.stat().st_size < before / 4


def test_filling_enters_what_was_lost_once_and_marks_it(tmp_path):
    path = tmp_path / "a.db"
    with Archive(path, utc_ns=10**18) as archive:
        archive.add("items", 5 * 10**9, 2 * 10**9, "x_m", 1.0, 3)
        archive.add("events", 5 * 10**9, 2 * 10**9, 1, "info", "MODE", "", 3)
    said = [
        Value(2 * 10**9, "x_m", 1.0),
        Value(3 * 10**9, "x_m", 1.5),
        Event(2 * 10**9, 1, "info", "MODE", ""),
        Event(4 * 10**9, 2, "info", "PHASE", ""),
    ]
    with reading(path) as db:
        assert fill(db, 3, said, "test") == (1, 1)
        assert fill(db, 3, said, "test") == (0, 0)
        assert [(r["onboard_ns"], r["value"], r["filled"]) for r in rows(db, "items")] == [
            (2 * 10**9, 1.0, None),
            (3 * 10**9, 1.5, 1),
        ]
        assert [r["utc_ns"] - 10**18 for r in rows(db, "items")] == [5 * 10**9, 6 * 10**9]
        assert [r["name"] for r in rows(db, "events")] == ["MODE", "PHASE"]


# -- other programs ----------------------------------------------------------------------------------------------------


def test_an_export_holds_every_row_in_each_format(tmp_path):
    path = tmp_path / "a.db"
    with Archive(path, utc_ns=10**18) as archive:
        for n in range(300):
            archive.add("items", n, 7 * n, "x_m" if n % 2 else "mode", n / 4 if n % 2 else n, 1)
        archive.add("datagrams", 1, "down", "ok", b"\x00\xff", 1, 1)
        archive.add("events", 1, 2, 1, "info", "MODE", 'a, "quoted"\nline', 1)
    with reading(path) as db:
        expected = list(rows(db, "items"))
        for name, make in FORMATS.items():
            (tmp_path / name).mkdir()
            assert all(made.is_file() for made in make(db, TABLES, ALL, tmp_path / name))
        to_csv = FORMATS["csv"]
        (only,) = to_csv(db, ["items"], Span(names=("x_m",)), tmp_path)
    with (tmp_path / "csv" / "items.csv").open(newline="") as file:
        read = list(csv.DictReader(file))
    assert [(int(r["utc_ns"]), r["name"], float(r["value"])) for r in read] == [
        (r["utc_ns"], r["name"], r["value"]) for r in expected
    ]
    assert {line.split(",")[4] for line in only.read_text().splitlines()[1:]} == {"x_m"}
    assert next(csv.DictReader((tmp_path / "csv" / "events.csv").open(newline="")))["text"] == 'a, "quoted"\nline'
    assert next(csv.DictReader((tmp_path / "csv" / "datagrams.csv").open(newline="")))["data"] == "00ff"
    duck = duckdb.sql(f"select utc_ns, name, value from '{tmp_path}/parquet/items.parquet'").fetchall()
    assert duck == [(r["utc_ns"], r["name"], r["value"]) for r in expected]
    assert duckdb.sql(f"select data from '{tmp_path}/parquet/datagrams.parquet'").fetchall() == [(b"\x00\xff",)]
    with (tmp_path / "mcap" / "archive.mcap").open("rb") as file:
        got = [
            (c.topic, m.log_time, m.publish_time, json.loads(m.data)) for _, c, m in make_reader(file).iter_messages()
        ]
    assert sum(topic == "/items/x_m" for topic, *_ in got) == 150
    assert next(row for row in got if row[0] == "/items/x_m")[1:] == (10**18 + 1, 7, {"value": 0.25})
