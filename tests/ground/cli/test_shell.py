"""`ground shell`: the verbs of the command line on one open session, from a pipe and from a terminal."""

import asyncio
import os
import sqlite3
import threading

import pytest
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput

from ground.archive.store import Archive
from ground.cli.operations.operate import Teller
from ground.cli.shell.shell import OperatorShell, completions
from ground.cli.shell.terminal import Live, from_pipe, in_terminal, opened, piped
from ground.station.settings import StationSettings
from ground.station.station import StationError
from protocol.tables import commands
from tests.ground.virtual_station import VirtualClock, VirtualStation


class World:
    """A shell on a station in virtual time. said: what the teller printed; verbs, saved: what was asked of others."""

    def __init__(self, contact_s=0.0, **station):
        self.said, self.verbs, self.saved = [], [], []
        self.station = VirtualStation(**station)
        self.shell = OperatorShell(lambda words: self.verbs.append(words) or 0)
        self.live = Live(
            self.station,
            VirtualClock(),
            Teller(self.said.append, False, 5.0),
            self.shell,
            lambda session, name, path: self.saved.append((name, str(path))),
            contact_s,
        )

    def pipe(self, *lines):
        return from_pipe(self.live, iter(lines))

    @property
    def executed(self):
        return self.station.rover.executed

    def state(self, number):
        request_id = self.shell.asked[number]
        return self.live.session.requester.requests[request_id].state.name


def test_lines_of_a_pipe_wait_for_each_other_and_their_outcome_is_the_exit_code(capsys):
    world = World(drive_s=2.0)
    assert world.pipe("goto 12 3", "goto 1 1 --heading 90", "stop", "# nothing", "") == 0
    assert world.executed == ["goto", "goto", "stop"]
    assert [world.state(n) for n in range(3)] == ["COMPLETED"] * 3  # the stop came after both, it cancelled none
    assert "> goto 12 3" in capsys.readouterr().out


def test_a_failed_command_is_exit_code_1_and_the_next_line_is_still_done():
    world = World()
    world.station.rover.fails = True
    assert world.pipe("goto 1 1", "status") == 1
    assert world.executed == ["goto", "status"]


def test_get_waits_for_the_product_and_writes_the_file_that_is_named():
    world = World()
    assert world.pipe("get ldem --out map.npz", "status") == 0
    assert world.saved == [("ldem", "map.npz")]
    assert world.executed == ["get", "status"]
    assert any("product   ldem" in line for line in world.said)


@pytest.mark.parametrize(
    ("line", "part"),
    [
        ("goto 12", "goto: `y_m` is missing"),
        ("gogo 1 2", ""),
        ("goto 1 2 --loud", "`--loud` is not known here"),
        ("goto 1 2 --start soon", "--start should be seconds"),
        ("goto 1 2 --start inf", "--start should be seconds"),
        ("goto 1 2 --expires 1e19", "--expires should be seconds"),
        ("goto 1 2 --start -5", "--start should be seconds"),
        ("goto 1 2 --start", "--start needs a value"),
        ("watch", "needs a terminal of its own"),
        ("say 'this", "No closing quotation"),
        ("map fly", "unknown map command"),
    ],
)
def test_a_mistake_is_one_line_and_ends_nothing(capsys, line, part):
    world = World()
    code = world.pipe(line, "stop")
    said = [row for row in capsys.readouterr().out.splitlines() if row.startswith("ground: ")]
    assert world.executed == ["stop"]
    if part:
        assert code == 64 and len(said) == 1 and part in said[0]
    else:
        assert world.verbs == [["gogo", "1", "2"]]  # the command line knows what was probably meant


@pytest.mark.parametrize("line", ["map clear", "reboot", "fence clear", "sequence clear survey"])
def test_what_loses_something_needs_yes(capsys, line):
    world = World()
    assert world.pipe(line) == 64
    assert "add --yes to do it" in capsys.readouterr().out
    assert world.executed == []


def test_one_fence_is_cleared_without_a_question():
    world = World()
    assert world.pipe("fence clear pit", "map clear --yes") == 0
    assert world.executed == ["fence_clear", "map_clear"]


def test_what_needs_no_link_goes_to_the_command_line():
    world = World()
    world.pipe("archive info", "ground events --last 3", "preview goto 1 2", "link", "goto --help")
    assert world.verbs == [
        ["archive", "info"],
        ["events", "--last", "3"],
        ["preview", "goto", "1", "2"],
        ["link"],
        ["goto", "--help"],
    ]
    assert world.executed == []


def test_a_locked_archive_delays_no_start_is_told_and_is_written_when_it_can_be(tmp_path):
    path = tmp_path / "archive.db"
    settings = StationSettings(bench_seed=7, archive=str(path))
    with Archive(path, 1):
        pass
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("begin immediate")
    with opened(settings, 10**18) as archive:
        assert archive.trouble.startswith(f"{path}: locked by another program")
        world = World()
        world.station.trouble = archive.trouble
        world.pipe("status")
        assert sum("rows wait in memory, events stay with the rover" in line for line in world.said) == 1
        other.execute("rollback")
        archive.add("items", 1, 1, "mode", 4)
        for _ in range(50):
            archive.commit()
        world.station.trouble = archive.trouble
        world.pipe("status")
        assert sum(line.endswith("archived again") for line in world.said) == 1
    other.close()


def test_quit_says_what_is_still_open(capsys):
    world = World(drive_s=50.0)
    for _ in range(100):
        world.live.turn()
    world.live.line("goto 5 5")
    assert world.live.line("quit") == ["1 requests are open; NOT sent: goto"]
    assert world.shell.ended


def test_a_rover_that_is_silent_or_a_link_that_closes_ends_it_in_one_line():
    with pytest.raises(StationError, match="nothing heard of the rover within 20 s"):
        World(contact_s=20.0, silent=((0.0, 1e9),)).pipe("status")
    with pytest.raises(StationError, match="the link's carrier has closed"):
        World(closed_s=3.0, drive_s=100.0).pipe("goto 1 1")


def test_in_a_terminal_a_stop_is_typed_while_a_goto_runs_and_history_is_kept(tmp_path):
    world, history = World(drive_s=1000.0), tmp_path / "state" / "shell-history"
    world.live._clock = VirtualClock(limit_s=10_000.0)

    async def type_it():
        with create_pipe_input() as keys:
            shell = asyncio.create_task(in_terminal(world.live, history, input=keys, output=DummyOutput()))
            keys.send_text("goto 12 3\n")
            await until(lambda: world.executed == ["goto"])
            keys.send_text("stop\n")
            await until(lambda: world.shell.settled(world.live.session))
            keys.send_text("quit\n")
            return await shell

    async def until(true):
        while not true():
            await asyncio.sleep(0)

    assert asyncio.run(asyncio.wait_for(type_it(), 60.0)) == 0
    assert world.executed == ["goto", "stop"]
    assert [world.state(n) for n in range(2)] == ["CANCELLED", "COMPLETED"]
    assert history.stat().st_mode & 0o777 == 0o600
    typed = [line[1:] for line in history.read_text().splitlines() if line.startswith("+")]
    assert typed == ["goto 12 3", "stop", "quit"]


def test_lines_come_out_of_a_pipe_as_they_went_in_however_they_are_cut():
    read, write = os.pipe()
    words = "goto 1 2\nsché\n\nlast"

    def send():
        for byte in words.encode():
            os.write(write, bytes([byte]))
        os.close(write)

    sender = threading.Thread(target=send)
    sender.start()
    assert [line for line in piped(read) if line is not None] == words.split("\n")
    sender.join()
    os.close(read)


def test_completion_knows_every_command_its_choices_parameters_and_items():
    tree = completions()
    for row in commands.TABLE:
        family, _, verb = row.typed.partition(" ")
        assert family in tree and (not verb or verb in tree[family])
    assert "ldem" in tree["get"] and "COMMAND_LOST" in tree["faults"]["mask"]
    assert "motion.cruise_mps" in tree["param"]["set"] and "voltage_v" in tree["plot"]


@pytest.mark.parametrize("typed", ["goto 1", "para\t", ""])
def test_in_a_terminal_ctrl_c_clears_the_line_and_ends_nothing(monkeypatch, typed):
    world, told = World(), []
    monkeypatch.setattr("ground.cli.shell.terminal._print", told.extend)
    world.live._clock = VirtualClock(limit_s=10_000.0)

    async def type_it():
        with create_pipe_input() as keys:
            shell = asyncio.create_task(in_terminal(world.live, None, input=keys, output=DummyOutput()))
            keys.send_text(typed + "\x03")
            while not told:
                await asyncio.sleep(0)
            keys.send_text("stop\n")
            while world.executed != ["stop"]:
                await asyncio.sleep(0)
            keys.send_text("quit\n")
            return await shell

    assert asyncio.run(asyncio.wait_for(type_it(), 20.0)) == 0
    assert told[0] == "Ctrl-D or `quit` ends; `stop` stops the rover"
