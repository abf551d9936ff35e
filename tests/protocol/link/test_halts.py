"""A command sent before a stop and received after it moves nothing, in any order of delivery, by any path."""

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.link.datagrams import DatagramKind, Sealer
from protocol.link.transactions import Code, Executor, RequestState, decode_report
from protocol.tables import commands
from protocol.tables.commands import HALTING, TABLE, Telecommand
from protocol.tables.modes import Mode
from tests.protocol.link.test_security import KEYS, Ground, Rover, S

GOTO = {"x_m": 1.0, "y_m": 2.0}
FREES = ("goto", "resume", "reset", "scan", "turn", "drive", "mission", "return", "sequence_run")
GIVEN = {"goto": GOTO, "turn": {"heading_rad": 1.0}, "mission": {"goals_m": (1.0, 2.0)},
         "drive": {"vx_mps": 0.1, "vy_mps": 0.0, "yaw_radps": 0.0, "duration_s": 1.0, "distance_m": 1.0},
         "sequence_run": {"sequence": "a"}}  # fmt: skip


def asked(request_id, name, issued_ns=0, start_ns=0):
    return commands.encode(Telecommand(request_id, issued_ns, 0, name, GIVEN.get(name, {}), start_ns))


def said(rover, now_ns=0):
    return {report.request_id: report for report in map(decode_report, rover.send(now_ns))}


def mode_for(name):
    return commands.command(name).modes[0]


def test_these_commands_let_the_rover_move_and_no_others():
    assert sorted(row.name for row in TABLE if row.frees) == sorted(FREES)


@pytest.mark.parametrize("name", FREES)
@pytest.mark.parametrize("halt", HALTING)
def test_what_was_asked_before_a_halt_is_cancelled_with_the_reason_and_asked_anew_is_done(name, halt):
    rover = Executor()
    assert rover.receive(1, asked(8, halt), S, Mode.AUTONOMOUS).name == halt
    assert rover.receive(1, asked(7, name), S, mode_for(name)) is None
    report = said(rover, S)[7]
    assert (report.state, report.code) == (RequestState.CANCELLED, Code.OVERTAKEN)
    typed = commands.command(halt).typed
    assert report.text == f"asked before the {typed} of request 8; ask again if it is still wanted"
    assert rover.receive(1, asked(9, name), S, mode_for(name)).name == name


def test_what_lets_nothing_move_is_done_however_late_it_comes():
    rover = Executor()
    rover.receive(1, asked(8, "stop"), S, Mode.STANDBY)
    assert [rover.receive(1, asked(n, name), S, Mode.STANDBY).name for n, name in ((6, "status"), (7, "safe"))] == [
        "status",
        "safe",
    ]


def test_a_request_that_waits_for_its_time_and_comes_after_the_stop_does_not_begin_to_wait():
    rover = Executor()
    rover.receive(1, asked(8, "stop"), S, Mode.STANDBY)
    assert rover.receive(1, asked(7, "goto", start_ns=9 * S), S, Mode.STANDBY) is None
    assert rover.held == 0 and said(rover, S)[7].code == Code.OVERTAKEN


def test_a_stop_at_a_time_counts_from_when_that_has_come():
    rover = Executor()
    assert rover.receive(1, asked(5, "stop", start_ns=9 * S), S, Mode.STANDBY) is None
    assert rover.receive(1, asked(3, "goto"), 2 * S, Mode.STANDBY).name == "goto"
    assert [order.name for order in rover.due(9 * S, Mode.AUTONOMOUS)] == ["stop"]
    assert rover.receive(1, asked(4, "goto"), 9 * S, Mode.STANDBY) is None
    assert rover.receive(1, asked(6, "goto"), 9 * S, Mode.STANDBY).name == "goto"


def test_an_older_stop_that_comes_late_stops_and_takes_nothing_from_what_the_newer_one_says():
    rover = Executor()
    rover.receive(1, asked(8, "safe"), S, Mode.STANDBY)
    assert rover.receive(1, asked(4, "stop"), S, Mode.STANDBY).name == "stop"
    assert rover.receive(1, asked(6, "goto"), S, Mode.STANDBY) is None


# -- of another station --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("issued_ns", "done"), [(12 * S, False), (14 * S, True), (0, True)])
def test_what_another_station_asked_before_the_stop_came_is_not_done_where_its_time_is_known(issued_ns, done):
    rover = Executor()
    rover.receive(2, asked(900, "stop"), 13 * S, Mode.AUTONOMOUS)
    order = rover.receive(1, asked(7, "goto", issued_ns), 15 * S, Mode.STANDBY)
    assert (order is not None) == done
    if not done:
        text = "asked at 12.0 s, the stop of station 2 came at 13.0 s; ask again if it is still wanted"
        assert said(rover, 15 * S)[7].text == text


def test_request_ids_of_another_station_say_nothing():
    rover = Executor()
    rover.receive(2, asked(900, "stop"), 13 * S, Mode.STANDBY)
    assert rover.receive(1, asked(7, "goto", 20 * S), 20 * S, Mode.STANDBY).name == "goto"


# -- over a restart, and in any order -------------------------------------------------------------------------------


def test_a_restart_of_the_rover_forgets_no_stop(tmp_path):
    rover, ground = Rover(tmp_path / "state"), Ground()
    older = ground.payload("goto", **GOTO)
    assert rover.does(ground.stop()) == ["stop"]
    rover.restart()
    ground.sealer.boot_id = rover.boot_id
    assert rover.does(ground.sealer.seal(DatagramKind.TELECOMMAND, older)) == []
    assert said_by(rover) == ["asked before a stop before the restart, request 3; ask again if it is still wanted"]
    assert rover.does(ground.goto()) == ["goto"]


def test_the_request_of_a_stop_is_kept_with_its_key_so_a_new_key_begins_anew(tmp_path):
    rover, ground = Rover(tmp_path / "state"), Ground()
    assert rover.does(ground.stop()) == ["stop"] and rover.memory.halted == {}
    rover.restart()
    assert rover.memory.halted == {1: 2} and rover.memory.marks == {1: 0}


def said_by(rover):
    return list(
        {decode_report(payload).text for kind, payload in rover.core.send(2 * S) if kind == DatagramKind.REPORT}
    )


HISTORY = st.lists(st.sampled_from([*HALTING, "goto", "resume", "goto", "status"]), min_size=2, max_size=6)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(HISTORY, st.randoms(use_true_random=False), st.integers(0, 2))
def test_in_every_order_nothing_older_than_a_halt_is_done_after_it_and_what_is_newer_is(names, chance, more):
    """Datagrams as a station seals them, each once or more often, in any order, through the rover's gate and core."""
    rover, sealer = LooseRover(), Sealer(KEYS.command.key(1), 1, 5)
    way = []
    for request_id, name in enumerate(names, 1):
        payload = asked(request_id, name)
        for _ in range(1 + more):
            way.append(sealer.seal_halt(payload) if name in HALTING else sealer.seal(DatagramKind.TELECOMMAND, payload))
    chance.shuffle(way)
    done = [order for datagram in way for order in rover.orders(datagram)]
    halted = 0
    for request_id, name in done:
        assert name not in FREES or request_id > halted
        halted = max(halted, request_id if name in HALTING else 0)
    last = max((n for n, name in enumerate(names, 1) if name in HALTING), default=0)
    assert {n for n, name in enumerate(names, 1) if n > last} <= {request_id for request_id, _ in done}


def test_all_orders_of_a_goto_a_stop_and_a_resume_leave_the_rover_where_the_newest_says():
    sealer = Sealer(KEYS.command.key(1), 1, 5)
    names = ("goto", "resume", "safe", "goto")
    sealed = [
        sealer.seal_halt(asked(n, name)) if name in HALTING else sealer.seal(DatagramKind.TELECOMMAND, asked(n, name))
        for n, name in enumerate(names, 1)
    ]
    for order in itertools.permutations(range(4)):
        rover = LooseRover()
        done = [request_id for n in order for request_id, _ in rover.orders(sealed[n])]
        after = done[done.index(3) + 1 :]
        assert after in ([], [4])


class LooseRover(Rover):
    """Without a disk. Every mode allows everything here: what is looked at is the order."""

    def __init__(self):
        super().__init__("")

    def orders(self, datagram):
        found = []
        for message in self.gate.receive(datagram, S):
            if message.accepted:
                self.core.mode = mode_for(commands.decode(message.payload).name)
            found += self.core.receive([message], S)
        return [(order.request_id & 0xFFFFFFFF, order.name) for order in found]
