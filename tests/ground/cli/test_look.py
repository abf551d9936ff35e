"""Verbs that look: events, requests, link, plot, archive; the figures of the link; bars in a terminal."""

import io
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from ground.__main__ import run
from ground.archive.link_figures import DatagramRow, figures
from ground.archive.schema import VERSION
from ground.archive.store import Archive
from ground.cli.operations.bars import Bars
from ground.cli.verbs import times as when
from ground.link.news import ProductHeard, Progress
from pictures.items import items as items_picture
from protocol.link.bulk import Product
from protocol.link.datagrams import DatagramKind, Sealer
from protocol.tables.modes import Mode

UTC_NS = 10**18  # 2001-09-09 01:46:40
S = 10**9


@pytest.fixture
def flown(tmp_path, monkeypatch):
    """A station that has flown: its folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ground.toml").write_text("bench_seed = 7\narchive = 'archive.db'\n")
    with Archive(tmp_path / "archive.db", utc_ns=UTC_NS) as archive:
        for n in range(10):
            datagram = Sealer(b"k" * 32, 0, 1, counter=n + 2 * (n > 4)).seal(DatagramKind.MAVLINK, bytes(56))
            archive.add("datagrams", n * S, "down", "ok", datagram, n + 2 * (n > 4), 1)
            archive.add("items", n * S, n * S, "voltage_v", 28 - n / 10, 1)
        archive.add("datagrams", 9 * S, "down", "tag", b"x")
        archive.add("datagrams", 9 * S, "up", "ok", datagram, 0, 1)
        archive.add("events", S, S, 1, "info", "MODE", "STANDBY -> AUTONOMOUS", 1)
        archive.add("events", 2 * S, 2 * S, 2, "warning", "FAULT", "SLIP_HIGH", 1)
        archive.add("requests", S, 1, 1, "goto", '{"x_m": 3.0, "y_m": 1.0}')
        archive.add("reports", 2 * S, 1, 1, 1, "ACCEPTED", 0, "", "[]")
        archive.add("reports", 3 * S, 1, 1, 2, "COMPLETED", 0, "0.05 m from the goal", "[]")
        archive.add("requests", 4 * S, 2, 1, "stop", "{}")
        archive.add("reports", 5 * S, 2, 1, 1, "ACCEPTED", 0, "waits until 900.0 s, now 5.0 s", "[]")
    return tmp_path


def told(capsys, *argv):
    code = run(list(argv))
    streams = capsys.readouterr()
    assert "Traceback" not in streams.err + streams.out
    return code, streams.out.splitlines(), streams.err


def test_events_are_listed_by_severity_name_and_number(flown, capsys):
    code, lines, _ = told(capsys, "events")
    assert code == 0
    assert lines == [
        "2001-09-09 01:46:41.0  info      MODE: STANDBY -> AUTONOMOUS  (onboard 1.00 s)",
        "2001-09-09 01:46:42.0  warning   FAULT: SLIP_HIGH  (onboard 2.00 s)",
    ]
    assert len(told(capsys, "events", "--severity", "warning")[1]) == 1
    (line,) = told(capsys, "events", "--last", "1", "--json")[1]
    assert json.loads(line)["name"] == "FAULT"
    assert told(capsys, "events", "--severity", "loud")[0] == 64


def test_events_that_came_after_a_silence_tell_when_each_happened(flown, capsys):
    with Archive(flown / "archive.db", utc_ns=UTC_NS + 500 * S) as archive:
        archive.add("items", S, 502 * S, "mode", 1, 1)  # the quickest: zero of the boot is 1 s earlier
        for n in range(3):
            archive.add("events", 5 * S, (100 + n) * S, 10 + n, "info", "LOOK", "", 1)
        archive.add("events", 5 * S, 7 * S, 1, "info", "MODE", "", 2)  # of a boot whose clock is not known
    lines = told(capsys, "events", "--last", "4")[1]
    assert all(line.startswith("2001-09-09 01:55:05.0") for line in lines)
    assert lines[1].endswith("(onboard 101.00 s, 2001-09-09 01:48:20.0)") and lines[3].endswith("(onboard 7.00 s)")
    trees = [json.loads(line) for line in told(capsys, "events", "--last", "4", "--json")[1]]
    assert [tree["happened_utc_ns"] for tree in trees] == [UTC_NS + n * S for n in (99, 100, 101)] + [None]
    shown = told(capsys, "archive", "show", "events", "--last", "2")[1]
    assert shown[0].endswith("(onboard 102.00 s, 2001-09-09 01:48:21.0)")


def test_requests_show_each_chain_and_what_still_waits(flown, capsys):
    _, lines, _ = told(capsys, "requests")
    assert "goto 3 1  accepted > completed: 0.05 m from the goal" in lines[0]
    _, lines, _ = told(capsys, "requests", "--open")
    assert len(lines) == 1 and "stop" in lines[0] and "waits until 900.0 s" in lines[0]
    tree = json.loads(told(capsys, "requests", "--last", "1", "--json")[1][0])
    assert (tree["state"], tree["reports"][0]["state"]) == ("ACCEPTED", "ACCEPTED")


def test_requests_tell_who_asked_where_that_is_known(flown, capsys):
    with Archive(flown / "archive.db", utc_ns=UTC_NS) as archive:
        archive.add("requests", 6 * S, 3, 1, "stop", "{}", b"", "gateway 127.0.0.1:14555 system 255, unsigned")
    lines = told(capsys, "requests")[1]
    assert lines[2].endswith("(by gateway 127.0.0.1:14555 system 255, unsigned)") and "(by" not in lines[0]
    trees = [json.loads(line) for line in told(capsys, "requests", "--json")[1]]
    assert [tree["asked_by"] for tree in trees] == ["", "", "gateway 127.0.0.1:14555 system 255, unsigned"]
    assert told(capsys, "archive", "export", "--table", "requests", "--out", "flown")[0] == 0
    head, *_, last = (flown / "flown" / "requests.csv").read_text().splitlines()
    assert head.endswith(",asked_by") and last.endswith('"gateway 127.0.0.1:14555 system 255, unsigned"')


def test_figures_of_the_link_come_from_the_archive(flown, capsys):
    code, lines, _ = told(capsys, "link", "--since", "2001-09-09")
    assert code == 0 and any("lost             2 datagrams, 16.7 %" in line for line in lines)
    tree = json.loads(told(capsys, "link", "--archive", "archive.db", "--json")[1][0])
    assert (tree["heard"], tree["lost"], tree["sent"], tree["refused"]) == (10, 2, 1, {"tag": 1})
    assert tree["down_bytes_ps"] == pytest.approx(10 * (32 + 56 + 28) / 9)


def test_an_item_is_plotted_or_given_as_numbers(flown, capsys):
    assert told(capsys, "plot", "voltage_v", "--out", "v.png")[0] == 0
    assert (flown / "v.png").read_bytes().startswith(b"\x89PNG")
    tree = json.loads(told(capsys, "plot", "voltage_v", "--json")[1][0])
    assert tree["values"][:2] == [28, 27.9] and tree["utc_ns"][0] == UTC_NS
    code, _, err = told(capsys, "plot", "voltage")
    assert code == 64 and "did you mean `voltage_v`" in err
    assert told(capsys, "plot", "x_m")[0] == 66
    assert told(capsys, "plot", "voltage_v", "--out", "none/v.png")[0] == 73


def test_a_mode_is_plotted_with_its_names(flown, monkeypatch, capsys):
    with Archive(flown / "archive.db", utc_ns=UTC_NS) as archive:
        for n in range(60):
            archive.add("items", n * S, n * S, "mode", 1 + (n > 20), 2)
            archive.add("items", n * S, n * S, "phase", n // 12, 2)
    made = []
    monkeypatch.setattr("pictures.items.items", lambda *given: made.append(items_picture(*given)) or made[0])
    assert told(capsys, "plot", "mode", "phase", "voltage_v", "--out", "m.png")[0] == 0
    assert [tick.get_text() for tick in made[0].axes[0].get_yticklabels()] == [Mode(1).name, Mode(2).name]


def test_the_archives_own_verbs(flown, capsys):
    code, lines, _ = told(capsys, "archive", "info")
    assert code == 0 and f"version {VERSION}" in lines[0] and any(line.split()[:2] == ["items", "10"] for line in lines)
    assert json.loads(told(capsys, "archive", "info", "--json")[1][0])["rows"]["events"] == 2
    assert len(told(capsys, "archive", "show", "items", "--name", "voltage_v", "--last", "3")[1]) == 3
    assert told(capsys, "archive", "show", "item")[0] == 64
    assert any("datagrams  2 missing, 5 to 6" in line for line in told(capsys, "archive", "gaps")[1])
    assert told(capsys, "archive", "export", "--out", "flown", "--format", "mcap")[1] == ["flown/archive.mcap"]
    assert told(capsys, "archive", "export", "--out", "flown", "--format", "xls")[0] == 64
    assert told(capsys, "archive", "export", "--out", "archive.db")[0] == 73


def test_pruning_asks_and_where_nobody_can_answer_needs_yes(flown, capsys, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    code, _, err = told(capsys, "archive", "prune", "--older", "1d")
    assert code == 64 and "needs --yes" in err
    assert told(capsys, "archive", "prune")[0] == 64
    code, lines, _ = told(capsys, "archive", "prune", "--older", "1d", "--yes")
    assert code == 0 and "removed 12 datagrams, 10 items, 2 events" in lines[0]
    assert len(told(capsys, "requests")[1]) == 2


@pytest.mark.parametrize(("answer", "code"), [("y\n", 66), ("\n", 1), ("no\n", 1)])
def test_a_question_before_something_is_lost_is_answered_by_y_alone(tmp_path, monkeypatch, capsys, answer, code):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", Terminal(answer))
    assert told(capsys, "reboot")[0] == code  # 66: it went on, to the station file that is not there


def test_calibrate_says_that_it_is_not_on_board(capsys):
    code, _, err = told(capsys, "calibrate")
    assert code == 64 and "`onboard calibrate`" in err


@pytest.mark.parametrize(
    "argv",
    [
        ["events"],
        ["requests"],
        ["archive", "info"],
        ["plot", "x_m"],
        ["link", "--since", "1h"],
    ],
    ids=lambda argv: argv[0],
)
def test_without_an_archive_each_says_so_in_one_line(tmp_path, monkeypatch, capsys, argv):
    monkeypatch.chdir(tmp_path)
    assert told(capsys, *argv)[0] == 66
    (tmp_path / "ground.toml").write_text("bench_seed = 7\n")
    code, _, err = told(capsys, *argv)
    assert code == 66 and "names no archive" in err and err.count("\n") == 1
    (tmp_path / "ground.toml").write_text("bench_seed = 7\narchive = 'a.db'\n")
    code, _, err = told(capsys, *argv)
    assert code == 66 and "no archive there" in err


@pytest.mark.parametrize(
    ("text", "ns"), [("2001-09-09T01:46:40", UTC_NS), ("2001-09-09T03:46:40+02:00", UTC_NS), ("1970-01-02", 86_400 * S)]
)
def test_a_time_is_utc_unless_it_says_otherwise(text, ns):
    assert when.utc_ns(text) == ns


@pytest.mark.parametrize("text", ["soon", "5x", "", "2001-13-01"])
def test_what_is_no_time_is_refused_with_what_is(text):
    with pytest.raises(ValueError, match="is no time; write UTC like"):
        when.utc_ns(text)


ROWS = st.lists(st.integers(0, 60), max_size=80)


@given(ROWS)
def test_lost_and_heard_make_up_the_span_of_counters_whatever_the_order(counters):
    rows = [DatagramRow(n * S, "down", "ok", 100, counter, 1) for n, counter in enumerate(counters)]
    found = figures(rows)
    assert found.heard == len(set(counters))
    if counters:
        assert found.heard + found.lost == max(counters) - min(counters) + 1
        assert found.late <= found.heard - 1


def test_what_went_by_while_no_station_was_open_is_no_loss():
    runs = {1: range(0, 10), 2: range(1010, 1020), 3: range(1015, 1030, 2)}  # 2 and 3 are open together
    rows = [
        DatagramRow(counter * S, "down", "ok", 100, counter, 1, run) for run, heard in runs.items() for counter in heard
    ]
    found = figures(sorted(rows))
    assert (found.heard, found.lost, found.apart, found.apart_s) == (25, 5, 1000, 1001.0)
    assert (found.span_s, found.silent_s) == (28.0, 2.0)
    assert found.loss_ratio == 5 / 30 and found.down_bytes_ps == pytest.approx(25 * 128 / 28)


def test_gaps_between_runs_of_a_station_are_named_so(flown, capsys):
    with Archive(flown / "archive.db", utc_ns=UTC_NS + 500 * S) as archive:
        for n in range(3):
            archive.add("datagrams", n * S, "down", "ok", b"x", 500 + n, 1)
            archive.add("events", n * S, 500 * S, 40 + 2 * n, "info", "LOOK", "", 1)
    lines = told(capsys, "archive", "gaps")[1]
    assert lines[0].endswith("datagrams  2 missing, 5 to 6, boot 1")
    assert lines[1].endswith("datagrams  488 not heard: no station was open, 12 to 499, boot 1")
    assert lines[2].endswith("events     37 not heard: no station was open, 3 to 39, boot 1")
    assert lines[3].endswith("events     1 missing, 41 to 41, boot 1")
    assert any(
        line.startswith("no station open  491.0 s, 488 datagrams")
        for line in told(capsys, "link", "--since", "2001-09-09")[1]
    )


def test_no_datagrams_have_no_rates():
    assert figures([])[:6] == (0.0, 0, 0, None, 0, None)


def test_in_a_terminal_a_transfer_is_a_bar_and_what_is_told_goes_above_it():
    shown, plain = io.StringIO(), []
    bars = Bars(plain.append, 5.0, Console(file=shown, force_terminal=True, width=100))
    bars.news([Progress(0, "ldem", 1, 10)])
    bars.said("hello", 0)
    bars.news([Progress(1, "ldem", 7, 10)])
    bars.news([ProductHeard(2, Product(1, "ldem", "ldem-2", b"x"))])
    bars.close()
    bars.said("after", 0)
    assert "of 10 chunks" in shown.getvalue() and "hello" in shown.getvalue()
    assert not any("transfer" in line for line in plain)
    assert any("after" in line for line in plain)
