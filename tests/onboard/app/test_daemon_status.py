"""`onboard status`: who asks is told at once, nobody can hold the daemon up, and what is missing is said plainly."""

import json
import math
import os
import signal
import socket
import threading
from contextlib import suppress
from pathlib import Path

import pytest
from click.testing import CliRunner

from onboard.__main__ import app
from onboard.drivers import status_port
from onboard.drivers.platform.realtime import Grant
from onboard.drivers.status_port import LEAST_NS, StatusError, StatusPort, ask, place_of
from onboard.records import Machine
from onboard.status import command
from onboard.status.command import lines
from onboard.status.report import ShellStatus, report
from tests.onboard.app.test_wall_clock import alone, started
from tests.onboard.core.test_pace import step_measured
from tests.onboard.core_bench import CoreBench

REPORT = b'{"mode": "STANDBY"}\n'
GRANTS = (Grant("cpu", True, "core 1"), Grant("fifo_priority", False, "Operation not permitted"))
SHELL = ShellStatus("wall", 42, 3_725_500_000_000, GRANTS, "run.mcap", 2_500_000)


@pytest.fixture
def port(tmp_path):
    made = StatusPort(tmp_path / "s")
    yield made
    made.close()


def asked(port, now_ns=0):
    """What a caller is told who asks while the daemon ticks on."""
    answers = []
    caller = threading.Thread(target=lambda: answers.append(ask([port.path], 60.0)))
    caller.start()
    while not port.serve(lambda: REPORT, now_ns):
        pass
    caller.join()
    return answers[0]


def test_a_caller_is_told_the_report_of_the_tick_in_which_it_is_served(port):
    assert asked(port) == REPORT


def test_while_nobody_asks_no_report_is_made(port):
    assert not port.serve(lambda: pytest.fail("no report was asked for"), 0)


def test_callers_in_a_loop_are_answered_at_most_every_fifth_tick(port):
    lines_in = [socket.socket(socket.AF_UNIX) for _ in range(3)]
    for line in lines_in:
        line.connect(str(port.path))
    served = [now_ns for now_ns in range(0, 4 * LEAST_NS, 10_000_000) if port.serve(lambda: REPORT, now_ns)]
    assert served == [0, LEAST_NS, 2 * LEAST_NS]
    for line in lines_in:
        line.close()


def test_a_caller_that_never_reads_and_one_that_has_gone_hold_nothing_up(port):
    deaf, gone = socket.socket(socket.AF_UNIX), socket.socket(socket.AF_UNIX)
    for line in (deaf, gone):
        line.connect(str(port.path))
    gone.close()
    huge = bytes(50_000_000)
    assert port.serve(lambda: huge, 0) and port.serve(lambda: huge, LEAST_NS)
    assert not port.serve(lambda: huge, 2 * LEAST_NS)
    deaf.close()


def test_an_answer_that_was_cut_off_is_not_taken_for_a_report(port):
    with pytest.raises(StatusError, match="cut off"):
        threading.Thread(target=serve_once, args=(port, b'{"mode": "ST')).start()
        ask([port.path], 60.0)


def serve_once(port, answer):
    while not port.serve(lambda: answer, 0):
        pass


def test_an_answer_that_never_ends_is_not_kept(tmp_path):
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "s"))
        server.listen()
        sent = []

        def flood():
            caller, _ = server.accept()
            with caller, suppress(OSError):
                while len(sent) < 1000:  # 65 MB
                    sent.append(caller.sendall(bytes(65_536)))

        flooding = threading.Thread(target=flood)
        flooding.start()
        with pytest.raises(StatusError, match="cut off"):
            ask([tmp_path / "s"], 60.0)
        flooding.join()
    assert len(sent) < 100


@pytest.mark.parametrize("words", [(), ("--json",)])
def test_what_another_program_answers_draws_nothing_on_the_terminal(monkeypatch, words):
    told = report(CoreBench().rover, SHELL) | {"mode": "STANDBY\x1b[2J\n\x9b", "faults": ["\x1b]0;x\x07"]}
    monkeypatch.setattr(command, "ask", lambda _: json.dumps(told, ensure_ascii=False).encode() + b"\n")
    done = CliRunner().invoke(app, ["status", *words])
    assert done.exit_code == 0 and "STANDBY" in done.output
    assert all(c.isprintable() or c == "\n" for c in done.output)


@pytest.mark.parametrize("answer", [b"{}\n", b"[]\n", b"no\n", b"[" * 100_000 + b"\n", b"\xff\n"])
def test_what_is_no_report_is_one_line(monkeypatch, answer):
    monkeypatch.setattr(command, "ask", lambda _: answer)
    done = CliRunner().invoke(app, ["status"])
    assert done.exit_code == 69 and "no daemon of this version" in done.output and done.output.count("\n") == 1


def test_no_daemon_is_said_with_the_places_that_were_looked_at(tmp_path):
    with pytest.raises(StatusError, match=r"no daemon runs here: there is no .*/a or .*/b"):
        ask([tmp_path / "a", tmp_path / "b"])


def leave_behind(path):
    """The socket of a daemon that was killed."""
    line = socket.socket(socket.AF_UNIX)
    line.bind(str(path))
    line.close()


def test_a_socket_left_by_a_killed_daemon_is_no_daemon_and_is_replaced_by_the_next(tmp_path):
    path = tmp_path / "s"
    leave_behind(path)
    with pytest.raises(StatusError, match="was left by one that has gone"):
        ask([path])
    port = StatusPort(path)
    assert asked(port) == REPORT
    port.close()
    assert not path.exists()


def test_a_living_daemons_socket_is_left_to_it(port):
    with pytest.raises(StatusError, match="another daemon answers there"):
        StatusPort(port.path)
    port.serve(lambda: REPORT, 0)  # the second's knock
    assert asked(port, LEAST_NS) == REPORT


def test_a_file_that_is_no_socket_is_left_alone(tmp_path):
    (tmp_path / "s").write_text("precious")
    with pytest.raises(StatusError, match="no socket"):
        StatusPort(tmp_path / "s")
    assert (tmp_path / "s").read_text() == "precious"


def test_a_path_too_long_for_a_socket_or_in_no_folder_is_named(tmp_path):
    with pytest.raises(StatusError, match="107 bytes"):
        StatusPort(tmp_path / ("s" * 108))
    with pytest.raises(StatusError, match="No such file"):
        StatusPort(tmp_path / "nowhere" / "s")


def test_a_daemon_that_closes_leaves_alone_what_another_has_put_in_its_place(port):
    port.path.unlink()
    leave_behind(port.path)
    port.close()
    assert port.path.exists()


def test_the_usual_place_is_the_first_that_may_be_written_and_lock_step_has_none(tmp_path, monkeypatch):
    monkeypatch.setattr(status_port, "usual_places", lambda: (Path("/nowhere/s"), tmp_path / "s", Path("/tmp/s")))
    assert place_of("auto", lockstep=False) == tmp_path / "s"
    assert place_of("auto", lockstep=True) is None and place_of("off", lockstep=False) is None
    assert place_of("/x/y", lockstep=True) == Path("/x/y")


def test_the_report_holds_the_state_of_the_rover_and_of_its_shell():
    rover = CoreBench()
    rover.settle()
    for _ in range(3):
        step_measured(rover)
    told = json.loads(json.dumps(report(rover.rover, SHELL)))
    assert (told["mode"], told["phase"], told["uptime_s"], told["pid"]) == ("STANDBY", "NONE", 3725.5, 42)
    assert told["record"] == {"path": "run.mcap", "bytes": 2_500_000}
    assert told["real_time"][1] == {"option": "fifo_priority", "granted": False, "text": "Operation not permitted"}
    worst = {row["name"]: row["worst_us"] for row in told["rate_groups"]}
    assert worst["executive"] == 12_000 and worst["wheels"] == 0
    assert told["ticks"]["slipped"] == 202 and told["ticks"]["slips"][0]["cause"] == "executive"
    assert told["ticks"]["late_below_us"] == {"p50": 1024, "p99": 1024, "p999": 1024}
    assert told["computer"] is None


def test_the_computer_s_health_is_in_the_report_and_on_the_page_and_what_it_does_not_say_is_left_out():
    rover = CoreBench()
    rover.machine = Machine(0.31, 0.2, 212e6, 1890e6, math.nan, 12.3e9)
    rover.step()
    told = json.loads(json.dumps(report(rover.rover, SHELL), allow_nan=False))
    assert told["computer"]["rss_bytes"] == 212e6 and told["computer"]["temperature_c"] is None
    line = next(line for line in lines(told) if line.startswith("computer"))
    assert line == (
        "computer  31 % of the processor at work, 0.2 cores for this program, 212 MB resident, "
        "1890 MB of memory free, 12.3 GB of disk free"
    )


def test_for_people_it_is_a_page_of_lines():
    rover = CoreBench()
    rover.settle()
    step_measured(rover)
    page = "\n".join(lines(report(rover.rover, SHELL)))
    for words in (
        "mode      STANDBY, phase NONE; faults: none",
        "1 h 2 min 6 s, wall clock, process 42",
        "run.mcap, 2.5 MB",
        "NOT granted: Operation not permitted",
        "executive       100 Hz   2000 us  12000 us       1       0",
        "by executive, 1",
        "jobs running: none",
    ):
        assert words in page, (words, page)


def test_in_lock_step_it_says_that_ticks_are_not_measured():
    page = lines(report(CoreBench().rover, ShellStatus("lockstep", 1, 0, (), "", 0)))
    assert "ticks are not measured on the lockstep clock" in page
    assert "real time nothing asked for ([realtime] in the configuration)" in page


def test_without_a_daemon_the_command_says_what_to_do_and_exits_69(tmp_path):
    result = CliRunner().invoke(app, ["status", "--socket", str(tmp_path / "s")])
    assert result.exit_code == 69 and result.stdout == ""
    assert "no daemon runs here" in result.stderr and "`onboard run` starts one" in result.stderr


def test_the_daemon_answers_and_says_what_it_was_granted_and_takes_its_socket_away(tmp_path):
    path = tmp_path / "s"
    settings = alone(tmp_path / "onboard.mcap") | {
        "status__socket": path,
        "realtime__absolute_sleep": "true",
        "realtime__collect_in_slack": "true",
    }
    with started("run", **settings) as program:
        said = [program.stderr.readline() for _ in range(3)]
        assert said[0].startswith("onboard: real time: absolute_sleep granted")
        assert said[1].startswith("onboard: real time: collect_in_slack granted")
        assert said[2].startswith("onboard: running: wall clock")
        told = json.loads(CliRunner().invoke(app, ["status", "--socket", str(path), "--json"]).stdout)
        assert told["pid"] == program.pid and told["clock"] == "wall"
        assert told["record"]["path"] == str(tmp_path / "onboard.mcap")
        assert [row["granted"] for row in told["real_time"]] == [True, True]
        assert os.stat(path).st_mode & 0o007 == 0  # not for everybody
        program.send_signal(signal.SIGTERM)
        program.communicate(timeout=60)
    assert program.returncode == 0 and not path.exists()
