"""The archive keeps what was committed, whatever happens to the station."""

import os
import signal
import sqlite3
import subprocess
import sys

import pytest

from ground.archive import TABLES, Archive


def test_rows_come_back_as_they_went_in(tmp_path):
    with Archive(tmp_path / "a" / "archive.db") as archive:
        archive.add("datagrams", 10, "down", "ok", b"\x00\xff")
        archive.add("items", 10, 7, "mode", 2)
        archive.add("reports", 20, 1, 1, 3, "COMPLETED", 0, "there", "[]")
        assert archive.rows("datagrams") == [(10, "down", "ok", b"\x00\xff")]
        assert archive.rows("items") == [(10, 7, "mode", 2)]
        assert archive.rows("reports") == [(20, 1, 1, 3, "COMPLETED", 0, "there", "[]")]


def test_each_opening_is_a_run_of_its_own(tmp_path):
    for n in range(2):
        with Archive(tmp_path / "archive.db") as archive:
            assert archive.rows("items") == []
            archive.add("items", n, n, "mode", n)
    with sqlite3.connect(tmp_path / "archive.db") as db:
        assert db.execute("select run, value from items").fetchall() == [(1, 0), (2, 1)]


def test_committed_rows_survive_a_kill(tmp_path):
    child = (
        "import sys, time\nfrom ground.archive import Archive\n"
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
