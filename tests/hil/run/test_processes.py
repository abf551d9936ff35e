"""Children of a run: none is left behind, and one that dies says who it was and why."""

import os
import select
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from mcap.reader import make_reader

from hil.processes import ProcessDiedError, Processes, free_ports
from hil.run.run import run
from hil.scenarios.model import Scenario, load_scenario

SCENARIOS = Path(__file__).parents[3] / "hil" / "scenarios" / "data"


@pytest.fixture
def start(tmp_path, monkeypatch):
    """Starts a script as a child; returns when it says that it is there."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))

    def starter(processes, name, body):
        (tmp_path / f"{name}_child.py").write_text(body)
        processes.start(name, f"{name}_child", [])
        log = tmp_path / f"{name}.log"
        while "there" not in log.read_text() and processes._children[name].poll() is None:
            os.sched_yield()

    return starter


WAITS = "import signal\nprint('there', flush=True)\nsignal.pause()\n"
DEAF = "import signal\nsignal.signal(signal.SIGTERM, signal.SIG_IGN)\nprint('there', flush=True)\nsignal.pause()\n"


def gone(pid):
    return not Path(f"/proc/{pid}").exists()


@pytest.mark.parametrize("leaving", [None, RuntimeError, KeyboardInterrupt, SystemExit])
def test_no_child_is_left_however_the_block_is_left(tmp_path, start, leaving):
    processes = Processes(tmp_path)
    try:
        with processes:
            start(processes, "one", WAITS)
            start(processes, "two", WAITS)
            pids = [processes.pid("one"), processes.pid("two")]
            assert not any(map(gone, pids))
            if leaving is not None:
                raise leaving("left")
    except (RuntimeError, KeyboardInterrupt, SystemExit) as error:
        assert type(error) is leaving
    assert all(map(gone, pids))


def test_a_child_runs_under_another_python_with_this_environment(tmp_path, monkeypatch):
    monkeypatch.setenv("KEPT", "this")
    other = tmp_path / "python"
    other.write_text('#!/bin/sh\necho "$@" "$KEPT" "$ADDED"\n')
    other.chmod(0o755)
    with Processes(tmp_path) as processes:
        processes.start("rover", "onboard", ["run"], {"ADDED": "that"}, python=str(other))
        assert processes.wait(30.0) == {"rover": 0}
        processes.restart("rover")
        assert processes.wait(30.0) == {"rover": 0}
    assert (tmp_path / "rover.log").read_text() == "-P -m onboard run this that\n" * 2


PARENT = """
import sys, signal
from pathlib import Path
from hil.processes import Processes
with Processes(Path(sys.argv[1])) as processes:
    processes.start("orphan", "orphan_child", [])
    print(processes.pid("orphan"), flush=True)
    signal.pause()
"""


def test_no_child_is_left_by_a_bench_that_is_killed(tmp_path):
    (tmp_path / "orphan_child.py").write_text(WAITS)
    paths = os.pathsep.join([str(tmp_path), str(Path(__file__).parents[3])])
    with subprocess.Popen(
        [sys.executable, "-c", PARENT, str(tmp_path)], stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": paths}
    ) as parent:
        pid = int(parent.stdout.readline())
        end = os.pidfd_open(pid)
        parent.kill()
    ended, _, _ = select.select([end], [], [], 30.0)
    os.close(end)
    assert ended


def test_a_child_that_ignores_sigterm_is_killed(tmp_path, start):
    with Processes(tmp_path, grace_s=0.1) as processes:
        start(processes, "deaf", DEAF)
        pid = processes.pid("deaf")
    assert gone(pid)


def test_no_child_is_left_when_ctrl_c_comes_again_while_the_first_is_obeyed(tmp_path, start, monkeypatch):
    processes = Processes(tmp_path, grace_s=60.0)
    with pytest.raises(KeyboardInterrupt, match="again"), processes:
        for name in ("one", "two"):
            start(processes, name, DEAF)
        pids = [processes.pid("one"), processes.pid("two")]
        interrupt = iter([KeyboardInterrupt("again")])
        wait = processes._children["one"].wait

        def waiting(timeout=None):
            for error in interrupt:
                raise error
            return wait(timeout)

        monkeypatch.setattr(processes._children["one"], "wait", waiting)
        raise KeyboardInterrupt("first")
    assert all(map(gone, pids))


def test_a_child_that_dies_is_reported_with_name_code_and_last_lines(tmp_path, start):
    with Processes(tmp_path) as processes:
        start(processes, "fine", WAITS)
        start(processes, "ill", "import sys\nprint('there')\nprint('no such port', file=sys.stderr)\nsys.exit(69)\n")
        processes.settle(20.0)
        with pytest.raises(ProcessDiedError) as died:
            processes.check()
    told = str(died.value)
    assert told.startswith("ill ended with exit code 69:")
    assert "no such port" in told


def test_a_child_ended_by_a_signal_is_reported_with_its_name(tmp_path, start):
    with Processes(tmp_path) as processes:
        start(processes, "one", WAITS)
        os.kill(processes.pid("one"), signal.SIGKILL)
        processes.settle(20.0)
        with pytest.raises(ProcessDiedError, match="one ended with signal SIGKILL"):
            processes.check()


def test_a_child_killed_as_a_fault_is_expected(tmp_path, start):
    with Processes(tmp_path) as processes:
        start(processes, "one", WAITS)
        processes.kill("one")
        processes.check()
        assert processes.killed("one")
        assert processes.wait(5.0) == {"one": -signal.SIGKILL}


def children():
    """pid -> command line of the living children of this process."""
    found = {}
    for task in Path("/proc/self/task").iterdir():
        for pid in (task / "children").read_text().split():
            words = Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
            found[int(pid)] = b" ".join(words[1:]).decode()
    return found


@pytest.mark.mission
@pytest.mark.parametrize("interrupted", [False, True])
def test_a_link_killed_in_mid_run_ends_it_with_an_error_that_names_it(tmp_path, interrupted):
    scenario = replace(load_scenario(SCENARIOS / "lidar_unplugged.toml"), faults=(), end_s=30.0)
    before, killed = set(children()), []

    def progress(now, wall_s):
        if killed or now.now_s < 1.0:  # the first states are in the record
            return
        if interrupted:
            killed.append(0)
            raise KeyboardInterrupt
        link = [pid for pid, words in children().items() if words.startswith("-m hil link") and pid not in before]
        killed.extend(link)
        os.kill(link[0], signal.SIGKILL)

    if interrupted:
        with pytest.raises(KeyboardInterrupt):
            run(scenario, tmp_path, progress)
        with (tmp_path / "truth.mcap").open("rb") as file:
            assert make_reader(file).get_summary().statistics.message_count > 0  # closed in order
    else:
        result = run(scenario, tmp_path, progress)
        assert result.error.startswith("link ended with signal SIGKILL"), result.error
    assert killed
    assert set(children()) <= before


@pytest.mark.mission
def test_a_script_that_has_ended_is_not_missed_while_the_rover_is_slow(tmp_path):
    scenario = Scenario(terrain="flat", link="lan", script="at 1.0: stop\n", end_s=60.0)
    before, halted = set(children()), []

    def progress(now, wall_s):
        own = {words.split()[1]: pid for pid, words in children().items() if pid not in before and "-m " in words}
        if "ground" not in own and "onboard" in own and not halted:
            halted.append(own["onboard"])
            os.kill(halted[0], signal.SIGSTOP)
            threading.Timer(2.0, os.kill, (halted[0], signal.SIGCONT)).start()  # longer than the bench waits unasking

    result = run(scenario, tmp_path, progress)
    assert halted and result.error == ""


def test_free_ports_are_different_and_below_those_of_outgoing_connections():
    ports = free_ports(3)
    assert len(set(ports)) == 3
    assert all(20_000 <= port < 32_000 for port in ports)
