"""An operation whose rover falls silent, never answers or is cancelled; in virtual time, as the user meets it."""

import json

import pytest

from ground.__main__ import run
from ground.cli.operations.open_requests import left
from ground.link.rover_clock import FarClock
from ground.link.schedule import parse, utc_ns
from ground.link.session import Session
from protocol.link.datagrams import bench_keys
from protocol.link.versions import OURS
from tests.ground.toy_rover import ToyRover
from tests.ground.virtual_station import S, VirtualClock, VirtualStation

NEVER_S = 1e9
CARRIES_ON = "the rover carries on with what it was told (goto), `ground stop` ends it"


@pytest.fixture
def meet(tmp_path, monkeypatch, capsys):
    """Runs the command line against a virtual station: exit code, lines, the last words on stderr."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ground.toml").write_text("bench_seed = 7\n")

    def meet(station: VirtualStation, *argv: str, clock: VirtualClock | None = None) -> tuple[int, list[str], str]:
        used = clock or VirtualClock()
        monkeypatch.setattr("ground.cli.operations.operate.Station", lambda *_: station)
        monkeypatch.setattr("ground.cli.operations.operate.WallClock", lambda: used)
        monkeypatch.setattr("ground.cli.operations.operate.LockstepClock", lambda _: used)
        code = run(list(argv))
        streams = capsys.readouterr()
        assert "Traceback" not in streams.err
        return code, streams.out.splitlines(), streams.err

    return meet


def silences(lines: list[str]) -> list[str]:
    return [line.split("for ")[1] for line in lines if "no word from the rover" in line]


def test_a_blackout_of_60_s_is_told_each_15_s_and_ends_nothing(meet):
    code, lines, err = meet(VirtualStation(silent=((1.0, 61.0),)), "goto", "12", "3")
    assert (code, err) == (0, "")
    assert silences(lines) == ["15 s", "30 s", "45 s", "60 s"]
    assert any("link      no word from the rover for 15 s" in line for line in lines)


def test_after_a_word_of_the_rover_the_15_s_begin_anew(meet):
    station = VirtualStation(silent=((1.0, 20.0), (22.0, 39.0)), drive_s=45.0)
    code, lines, _ = meet(station, "goto", "12", "3")
    assert (code, silences(lines)) == (0, ["15 s", "15 s"])


def test_in_lock_step_a_silent_rover_is_told_by_bench_time_without_news_of_the_link(meet, tmp_path):
    (tmp_path / "s").write_text("wait 40\n")
    station, clock = VirtualStation(silent=((0.0, NEVER_S),)), VirtualClock(jumps=True, repeatable=True)
    code, lines, _ = meet(station, "script", "s", "--barrier", "tcp:127.0.0.1:1", clock=clock)
    assert (code, silences(lines)) == (0, ["15 s", "30 s"])


def test_in_lock_step_the_carrier_is_the_bench_s_business(meet, tmp_path):
    (tmp_path / "s").write_text("wait 40\n")
    code, _, _ = meet(
        VirtualStation(closed_s=1.0), "script", "s", "--barrier", "tcp:127.0.0.1:1", clock=VirtualClock(repeatable=True)
    )
    assert code == 0


def test_silence_in_json_is_an_object_of_its_own(meet):
    _, lines, _ = meet(VirtualStation(silent=((1.0, 18.0),)), "goto", "12", "3", "--json")
    told = [tree for tree in map(json.loads, lines) if tree["news"] == "silence"]
    assert [round(tree["silent_s"]) for tree in told] == [15]


def test_a_closed_carrier_ends_a_goto_with_69_after_5_s(meet):
    code, _, err = meet(
        VirtualStation(closed_s=10.0, drive_s=NEVER_S), "goto", "12", "3", clock=VirtualClock(limit_s=15.1)
    )
    assert code == 69
    assert err == f"ground: the link's carrier has closed; {CARRIES_ON}\n"


@pytest.mark.parametrize("argv", [["status"], ["goto", "12", "3"], ["get", "ldem"], ["stop"]])
def test_a_rover_that_never_answers_is_exit_code_69_after_20_s_and_names_make_sim(meet, argv):
    code, _, err = meet(VirtualStation(silent=((0.0, NEVER_S),)), *argv, clock=VirtualClock(limit_s=20.1))
    assert code == 69
    assert err == "ground: nothing heard of the rover within 20 s; `make sim` starts a rover to talk to\n"


def test_before_the_first_telemetry_the_status_line_says_that_it_waits_for_it(meet):
    station = VirtualStation()
    station.rover.tells = False
    station.rover.event(0, "BOOT", "the first word of the rover")
    _, lines, _ = meet(station, "goto", "12", "3", "--timeout", "12")
    told = [line for line in lines if "telemetry" in line]
    assert told
    assert all(line.endswith(" s  waiting for telemetry") for line in told)
    assert not any(" old)" in line for line in lines)


def test_with_telemetry_the_status_line_tells_mode_pose_and_age(meet):
    _, lines, _ = meet(VirtualStation(drive_s=12.0), "goto", "12", "3")
    assert not any("waiting for telemetry" in line for line in lines)
    assert any("AUTONOMOUS" in line and "x 10." in line and " s old)" in line for line in lines)


def test_a_cancelled_command_ends_with_its_reason_and_exit_code_1(meet, tmp_path):
    (tmp_path / "s").write_text("at 2: goto 12 3\nat 4: stop\n")
    code, _, err = meet(VirtualStation(drive_s=NEVER_S), "script", "s")
    assert (code, err) == (1, "ground: the command was cancelled: stopped by the operator\n")


def test_a_goto_replaces_the_one_that_runs(meet, tmp_path):
    (tmp_path / "s").write_text("at 2: goto 12 3\nat 4: goto 3 12\n")
    code, _, err = meet(VirtualStation(), "script", "s")
    assert (code, err) == (1, "ground: the command was cancelled: another goto came\n")


def test_a_failure_is_told_before_a_cancellation(meet, tmp_path):
    (tmp_path / "s").write_text("at 2: goto 12 3\nat 4: goto 3 12\n")
    station = VirtualStation()
    station.rover.fails = True
    assert meet(station, "script", "s")[::2] == (1, "ground: the rover reported a failure\n")


def test_a_goto_that_another_station_ends_is_cancelled_for_its_user(meet):
    station = VirtualStation(drive_s=NEVER_S)
    turn = station.turn

    def stopped_at_5_s(now):
        if now.now_ns == 5 * S:
            station.rover.cancel(now.now_ns, "stopped by the operator")
        return turn(now)

    station.turn = stopped_at_5_s
    code, _, err = meet(station, "goto", "12", "3")
    assert (code, err) == (1, "ground: the command was cancelled: stopped by the operator\n")


def test_a_command_that_is_not_finished_in_time_is_exit_code_75(meet):
    code, _, err = meet(VirtualStation(drive_s=NEVER_S), "goto", "12", "3", "--timeout", "10")
    assert (code, err) == (75, f"ground: not finished in time; {CARRIES_ON}\n")


@pytest.mark.parametrize(
    ("argv", "silent", "words"),
    [
        (["goto", "1", "1"], ((0.0, NEVER_S),), "NOT sent: goto"),
        (["goto", "1", "1", "--start", "2030-01-01T00:00:00Z"], ((0.0, NEVER_S),), "nothing was sent"),
        (["stop"], ((0.0, NEVER_S),), "sent and not confirmed yet: stop"),
        (["status"], ((0.2, NEVER_S),), "sent and nothing heard of it: status"),
        (
            ["goto", "1", "1"],
            ((0.2, NEVER_S),),
            "sent and nothing heard of it: goto; the rover may do it, `ground stop` ends it",
        ),
    ],
)
def test_what_is_not_finished_in_time_says_what_is_so(meet, argv, silent, words):
    station = VirtualStation(silent=silent, drive_s=NEVER_S)
    station.rover.receive = lambda *_: None  # nothing reaches it
    code, _, err = meet(station, *argv, "--timeout", "10")
    assert (code, err) == (75, f"ground: not finished in time; {words}\n")


def test_a_request_that_its_station_never_sent_is_told_so_after_its_end_too():
    session = Session(bench_keys(7), 1)
    session.request("goto", {"x_m": 1.0, "y_m": 1.0}, 0)
    assert left(session) == ["NOT sent: goto"]
    session.close(0)
    assert left(session) == ["NOT sent: goto"]


def test_a_rover_with_other_keys_is_told_as_what_it_is(meet):
    station = VirtualStation()
    station.rover = ToyRover(bench_keys(8))
    code, _, err = meet(station, "status", "--contact", "2")
    assert code == 69 and err.count("\n") == 1
    assert "the downlink key of this station is not the rover's" in err


def test_a_rover_of_another_version_is_refused_with_both_named_and_still_stopped(meet):
    station = VirtualStation()
    station.rover.versions = OURS._replace(dbc=0xABCD)
    code, lines, err = meet(station, "goto", "1", "2")
    named = f"not sent: dbc {OURS.dbc:08x} here, 0000abcd on the rover; only stop, safe, emergency-stop"
    assert (code, err) == (1, f"ground: {named}\n") and any("goto #1 failed" in line for line in lines)
    station = VirtualStation()
    station.rover.versions = OURS._replace(dbc=0xABCD)
    assert meet(station, "stop")[0] == 0 and station.rover.executed == ["stop"]


def test_outside_of_its_windows_a_station_says_when_it_goes_and_sends_nothing_till_then(meet, tmp_path):
    station = VirtualStation()
    station.session = Session(bench_keys(7), 1, schedule=parse("0 3\n40 60", "w"))
    (tmp_path / "s").write_text("at 10: goto 1 2\nwait goto\n")
    code, lines, err = meet(station, "script", "s")
    assert (code, err) == (0, "")
    told = [line for line in lines if " contact   " in line]
    assert told[0].endswith("no contact: what is asked goes in 37 s") and told[1].endswith("in contact, 20 s left")
    assert not any("link      no word" in line for line in lines)
    assert station.session.requester.requests[1].history[0][0] >= 40 * S


def test_a_start_in_utc_is_asked_in_onboard_time_and_nonsense_is_refused(meet):
    station = VirtualStation()
    zero = utc_ns("2026-11-22T12:00:00Z")
    meet(station, "goto", "1", "2", "--start", "2026-11-22T12:00:30Z", "--timeout", "5")
    asked = station.session.requester.requests[1].telecommand
    assert asked.start_ns == pytest.approx(30 * S + zero - station.session.utc_ns, abs=0.1 * S)
    code, _, err = meet(VirtualStation(), "goto", "1", "2", "--start", "noon")
    assert code == 64 and "should be seconds of onboard time or UTC like 2026-11-22T12:00:00Z" in err


def test_contacts_show_lists_the_windows_without_asking_the_rover(meet, tmp_path):
    (tmp_path / "w").write_text("600 1200\n4000 4600  # the second\n")
    (tmp_path / "ground.toml").write_text("bench_seed = 7\ncontacts = 'w'\n")
    code, lines, _ = meet(VirtualStation(), "contacts", "show")
    assert code == 0 and lines[:2] == ["600 s  1200 s  600 s  (onboard time)", "4000 s  4600 s  600 s  (onboard time)"]
    assert "onboard time, which is not known" in lines[2]
    (tmp_path / "w").write_text("600\n")
    code, _, err = meet(VirtualStation(), "contacts", "show")
    assert code == 78 and err.startswith("ground: contacts: w:1: `600` should be `BEGIN END`")


def test_an_unknown_round_trip_is_unknown_in_the_text_of_status(meet, monkeypatch):
    monkeypatch.setattr(FarClock, "measure", lambda self, answered_ns: None)
    _, lines, _ = meet(VirtualStation(), "status", "--all")
    rows = {line.split()[0]: " ".join(line.split()[1:]) for line in lines if line}
    assert rows["rtt_s"] == "unknown" and rows["clock"].endswith("its error unknown")


def test_who_has_no_more_time_for_a_lease_still_waits_in_line(meet):
    station = VirtualStation()
    station.rover.lease_of = 2
    code, _, err = meet(station, "lease", "ask", "--timeout", "5")
    assert code == 75 and err == "ground: still waiting behind station 2; it keeps its place\n"
    code, _, err = meet(VirtualStation(drive_s=60.0), "goto", "1", "1", "--timeout", "5")
    assert code == 75 and err == f"ground: not finished in time; {CARRIES_ON}\n"


def test_status_says_lease_versions_contact_and_clock(meet):
    code, lines, _ = meet(VirtualStation(), "status", "--all")
    rows = {line.split()[0]: " ".join(line.split()[1:]) for line in lines if line}
    assert code == 0 and rows["lease_station"] == "nobody" and rows["versions"] == "alike"
    assert rows["dbc_version"] == f"{OURS.dbc:08x}" and rows["contact"].startswith("no windows")
    assert "at most 0.0" in rows["clock"] and "its zero at 20" in rows["clock"]


def test_a_single_command_tells_the_round_trip(meet):
    station = VirtualStation()
    assert meet(station, "goto", "1", "1")[0] == 0
    assert station.session.kept.rtt_ns > 0
