"""The daemon under its manager: ready, alive, stopping, levels for the journal, and an end that is told and clean."""

import os
import signal
import socket
import subprocess
import sys
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from mcap.reader import make_reader

from onboard import app
from onboard.drivers.platform.service_manager import BEATS, EVERY_NS, Service
from onboard.drivers.platform.stopwatch import NullStopwatch
from onboard.drivers.platform.workers import JobError, Workers
from onboard.journal import Level, say, to_journal
from onboard.records import Inputs, JobRequest
from protocol.barrier import Tick
from protocol.conventions import TICK_NS
from protocol.generated.can_codec import WheelMode
from tests.onboard.app.test_wall_clock import alone, command
from tests.onboard.core_bench import CoreBench

pytestmark = pytest.mark.tool

ROOT = Path(__file__).parents[3]
EX_SOFTWARE = 70
SECOND = 1_000_000_000
LIMIT_S = 30.0  # for what must come
# a flight program of which one part is made sick from outside; told by `hung` and `sick` below
SICK = """
import sys
from dataclasses import replace
import onboard.app as app
from onboard.records import JobRequest
whole = app.tick
def tick(rover, inputs, mark):
    outputs = whole(rover, inputs, mark)
    {what}
    return outputs
app.tick = tick
from onboard.__main__ import main
sys.argv = ["onboard", *sys.argv[1:]]
main()
"""
HANGS = SICK.format(what="""while inputs.tick >= 50: pass""")
BREAKS = SICK.format(what="""assert inputs.tick < 50, "the core has\\nfailed" """)
JOB_RAISES = SICK.format(
    what="""job = JobRequest(1, "plan", "math:factorial", (-1,), 51)
    outputs = replace(outputs, jobs=(job,) if inputs.tick == 50 else ())"""
)


class Manager:
    """systemd's end of the notify socket: `heard` is one datagram as a dict."""

    def __init__(self, address):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(address.replace("@", "\0", 1))
        self.socket.settimeout(LIMIT_S)

    def heard(self):
        return dict(line.split("=", 1) for line in self.socket.recv(4096).decode().splitlines())

    def until(self, key):
        while key not in (words := self.heard()):
            pass
        return words


@pytest.fixture(params=["path", "abstract"])
def manager(request, tmp_path):
    made = Manager(str(tmp_path / "notify") if request.param == "path" else f"@el-dorado-test-{os.getpid()}")
    made.address = made.socket.getsockname()
    if isinstance(made.address, bytes):
        made.address = "@" + made.address[1:].decode()
    yield made
    made.socket.close()


# -- the words -------------------------------------------------------------------------------------------------


def test_the_first_tick_makes_the_service_ready_and_later_ones_tell_once_a_second(manager):
    service = Service({"NOTIFY_SOCKET": manager.address})
    for now_ns in range(0, 2 * EVERY_NS + 1, 10_000_000):
        service.beat(now_ns, lambda at=now_ns: f"at {at}")
    service.tell("STOPPING=1")
    service.close()
    assert [manager.heard() for _ in range(4)] == [
        {"READY": "1", "STATUS": "at 0"},
        {"STATUS": "at 1000000000"},
        {"STATUS": "at 2000000000"},
        {"STOPPING": "1"},
    ]


def test_the_watchdog_is_fed_several_times_within_the_managers_patience(manager):
    service = Service({"NOTIFY_SOCKET": manager.address, "WATCHDOG_USEC": "200000", "WATCHDOG_PID": str(os.getpid())})
    manager.socket.setblocking(False)
    fed_ns = []
    for now_ns in range(0, SECOND, 10_000_000):
        service.beat(now_ns, lambda: "")
        with suppress(BlockingIOError):
            assert manager.heard()["WATCHDOG"] == "1"
            fed_ns.append(now_ns)
    service.close()
    assert fed_ns == list(range(0, SECOND, 200_000_000 // BEATS))


@pytest.mark.parametrize("environment", [
    {"WATCHDOG_USEC": "200000", "WATCHDOG_PID": "1"}, {"WATCHDOG_USEC": "soon"}, {},
])  # fmt: skip
def test_a_watchdog_of_another_process_or_none_is_not_fed(environment):
    service = Service(environment)
    assert service.patience_ns == 0
    service.close()


def test_a_manager_that_has_gone_or_does_not_read_holds_nothing_up(manager):
    service = Service({"NOTIFY_SOCKET": manager.address})
    for _ in range(5000):  # more than a socket holds
        service.tell("STATUS=" + "x" * 1000)
    manager.socket.close()
    service.tell("STATUS=still here")
    service.close()


# -- the daemon with a manager -----------------------------------------------------------------------------------


@contextmanager
def started(script, manager=None, watchdog_us=0, **settings):
    """The flight program, whole (script empty) or sick, as a manager starts it."""
    words = command("run", **settings)
    if script:
        words[1:3] = ["-c", script]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    if manager:
        environment["NOTIFY_SOCKET"] = manager.address
    if watchdog_us:
        environment["WATCHDOG_USEC"] = str(watchdog_us)
    program = subprocess.Popen(
        words,
        cwd=ROOT,
        env=environment,
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    try:
        yield program
    finally:
        program.kill()
        program.communicate()


@pytest.mark.parametrize("manager", ["path"], indirect=True)
def test_the_daemon_tells_ready_alive_and_stopping_and_how_it_is(tmp_path, manager):
    with started("", manager, 400_000, **alone(tmp_path / "r.mcap")) as program:
        first = manager.heard()
        assert (first["READY"], first["WATCHDOG"]) == ("1", "1")
        assert first["STATUS"].startswith("STANDBY NONE at 0.00 0.00; faults: ")
        assert [manager.heard().get("READY") for _ in range(3)] == [None] * 3  # once
        program.send_signal(signal.SIGTERM)
        assert manager.until("STOPPING")["STATUS"].startswith("the rover stands")
        assert program.wait(LIMIT_S) == 0


@pytest.mark.parametrize("manager", ["abstract"], indirect=True)
def test_a_core_that_hangs_starves_the_watchdog_and_the_managers_signal_tells_where(tmp_path, manager):
    with started(HANGS, manager, 400_000, **alone(tmp_path / "r.mcap")) as program:
        assert manager.heard()["READY"] == "1"
        manager.socket.settimeout(1.0)  # longer than the manager's patience
        with pytest.raises(TimeoutError):
            while manager.heard()["WATCHDOG"] == "1":
                pass
        assert program.poll() is None  # it lives, it hangs
        program.send_signal(signal.SIGABRT)  # as systemd does then
        _, told = program.communicate(timeout=LIMIT_S)
    assert program.returncode == -signal.SIGABRT
    assert "Fatal Python error: Aborted" in told and "in tick" in told and "in _ticks" in told


# -- the end -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("script", "code", "words"), [
    (JOB_RAISES, EX_SOFTWARE, "onboard: the job plan has failed: ValueError: factorial() not defined for negative"),
    (BREAKS, 1, "AssertionError: the core has"),
])  # fmt: skip
def test_when_a_job_or_the_core_fails_the_rover_is_stopped_the_record_closed_and_the_reason_told(
    tmp_path, script, code, words
):
    with started(script, **alone(tmp_path / "r.mcap")) as program:
        _, told = program.communicate(timeout=LIMIT_S)
    assert program.returncode == code
    assert words in told.splitlines()[-1 if code == EX_SOFTWARE else slice(None)], told
    with (tmp_path / "r.mcap").open("rb") as record:
        assert make_reader(record).get_summary().statistics.message_count > 49  # closed in order


class Shell:
    """Ports, clock, workers, disk and books of a rover on the core's bench; what was written, and told at the end."""

    def __init__(self, flight):
        self.flight, self.written, self.told, self.watch = flight, [], [], NullStopwatch()
        self.late_ns, self.took_ns, self.keeper, self.link = 0, (), self, self
        self.recorder, self.status = self, Inputs(0, 0).record

    def wait(self):
        return Tick(self.flight.tick + 1, self.now_ns(), ())

    def now_ns(self):
        return (self.flight.tick + 1) * TICK_NS

    def read(self, now):
        return Inputs(now.number, now.now_ns)

    def write(self, outputs):
        self.written.append(outputs)

    def collect(self, *_):
        return ()

    def stopping(self):
        self.told.append("stopping")


def test_whatever_ends_the_ticks_the_last_word_is_standing_wheels_and_a_quiet_laser(monkeypatch):
    flight = CoreBench()
    flight.settle()
    flight.order("drive", vx_mps=0.1, vy_mps=0.0, yaw_radps=0.0, duration_s=30.0, distance_m=2.0)
    flight.run(5.0)
    shell = Shell(flight)

    def fails(*_):
        raise ZeroDivisionError("in the core")

    monkeypatch.setattr(app, "tick", fails)
    with pytest.raises(ZeroDivisionError):
        app.loop(flight.rover, shell, shell, (shell, shell), (shell, shell))
    assert min(flight.rates) > 0.5  # it was driving
    (last,) = shell.written
    flight._deliver(last, shell.now_ns())
    assert [flight.ordered[n].mode for n in (1, 2, 3, 4)] == [WheelMode.HOLD] * 4 and flight.rates == [0.0] * 4
    assert last.lidar_bytes == b"\nQT\n" and shell.told == ["stopping"]


def test_a_job_that_raised_is_named_with_its_reason_and_place():
    workers = Workers(wait=True)
    workers.start([JobRequest(1, "plan", "json:loads", ("{",), 1)])
    with pytest.raises(JobError, match=r"^the job plan has failed: JSONDecodeError: .* \(raw_decode, line \d+ of dec"):
        workers.collect(1)
    workers.close()


# -- the journal -------------------------------------------------------------------------------------------------


def test_under_the_journal_every_line_has_its_level_and_events_are_told_too(tmp_path):
    """Standard error is a file whose device and inode JOURNAL_STREAM names, as systemd does with its stream."""
    with (tmp_path / "journal").open("w+") as journal:
        at = os.fstat(journal.fileno())
        words = command("run", **alone(tmp_path / "r.mcap"), realtime__cpu=1023)
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "JOURNAL_STREAM": f"{at.st_dev}:{at.st_ino}"}
        manager = Manager(str(tmp_path / "notify"))
        environment["NOTIFY_SOCKET"] = str(tmp_path / "notify")
        program = subprocess.Popen(words, cwd=ROOT, env=environment, stderr=journal)
        try:
            while "CAN_BUS_OFF" not in manager.heard()["STATUS"]:
                pass
            program.send_signal(signal.SIGINT)
            assert program.wait(LIMIT_S) == 0
        finally:
            program.kill()
            manager.socket.close()
        journal.seek(0)
        lines = journal.read().splitlines()
    assert "<4>real time: cpu NOT granted: core 1023 is not this process's" in lines[0]
    assert lines[1].startswith("<5>running: wall clock, virtual:wall")
    assert any(line.startswith("<4>lidar: 127.0.0.1 refuses port") for line in lines)
    assert any(line.startswith("<4>FAULT: CAN_BUS_OFF") for line in lines)
    assert all(line[0] == "<" and line[1] in "23456" and line[2] == ">" for line in lines), lines


def test_a_complaint_of_the_command_line_is_an_error_in_the_journal(tmp_path):
    with (tmp_path / "journal").open("w+") as journal:
        at = os.fstat(journal.fileno())
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "JOURNAL_STREAM": f"{at.st_dev}:{at.st_ino}"}
        code = subprocess.run(command("run", can__uri="carrier pigeon"), cwd=ROOT, env=environment, stderr=journal)
        journal.seek(0)
        assert (code.returncode, journal.read()[:7]) == (78, "<3>can.")


def test_outside_the_journal_lines_bear_the_programs_name(capsys, monkeypatch):
    monkeypatch.setenv("JOURNAL_STREAM", "8:15")
    assert not to_journal()
    say("all is well", Level.ERROR)
    assert capsys.readouterr().err == "onboard: all is well\n"


def test_a_reader_of_the_lines_that_has_gone_ends_nothing(monkeypatch):
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as broken:
        monkeypatch.setattr(sys, "stderr", broken)
        say("nobody hears it")
        monkeypatch.undo()
        with pytest.raises(BrokenPipeError):
            broken.write("x" * 100_000)
        os.dup2(os.open(os.devnull, os.O_WRONLY), writer)  # for its close
