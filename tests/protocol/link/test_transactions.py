"""Telecommands over a lossy, slow link, in virtual time."""

import itertools

import numpy as np
import pytest

from protocol import WireError
from protocol.link.transactions import (
    Code,
    Executor,
    Order,
    Report,
    Requester,
    RequestState,
    decode_report,
    encode_report,
)
from protocol.tables import commands
from protocol.tables.modes import Mode

MS = 1_000_000
S = 1000 * MS


class Air:
    """Both directions of a link: each payload is lost with `loss` or arrives `one_way_ns` later."""

    def __init__(self, loss: float, one_way_ns: int, seed: int = 1) -> None:
        self.loss, self.one_way_ns, self.generator = loss, one_way_ns, np.random.default_rng(seed)
        self.way: list[tuple[int, str, bytes]] = []

    def put(self, now_ns: int, to: str, payloads: list[bytes]) -> None:
        for payload in payloads:
            if self.generator.random() >= self.loss:
                self.way.append((now_ns + self.one_way_ns, to, payload))

    def take(self, now_ns: int, to: str) -> list[bytes]:
        due = [p for at, who, p in self.way if who == to and at <= now_ns]
        self.way = [row for row in self.way if row[1] != to or row[0] > now_ns]
        return due


def run(air, ground, rover, until_ns, orders, *, act=None, start_ns=0, step_ns=100 * MS):
    for now_ns in range(start_ns, until_ns, step_ns):
        for payload in air.take(now_ns, "rover"):
            order = rover.receive(1, payload, now_ns, Mode.STANDBY)
            if order is not None:
                orders.append(order)
                rover.report(order.request_id, RequestState.COMPLETED, now_ns, "done", (float(len(orders)),))
        air.put(now_ns, "ground", rover.send(now_ns))
        for payload in air.take(now_ns, "ground"):
            ground.receive(payload, now_ns)
        if act:
            act(now_ns)
        air.put(now_ns, "rover", ground.send(now_ns))


def test_10000_commands_at_30_percent_loss_and_2600_ms_round_trip_are_each_executed_exactly_once_and_known_to_be_done():
    air, rover, orders = Air(0.3, 1300 * MS), Executor(), []
    ground = Requester(1, rtt_ns=2600 * MS, remembered=10_000)
    waiting = iter(range(10_000))

    def act(now_ns):
        for n in itertools.islice(waiting, 5):
            ground.request("goto", {"x_m": float(n), "y_m": 0.0}, now_ns)

    run(air, ground, rover, 330 * S, orders, act=act)
    assert sorted(o.arguments["x_m"] for o in orders) == [float(n) for n in range(10_000)]
    assert {r.state for r in ground.requests.values()} == {RequestState.COMPLETED}
    waits = sorted(r.history[0][0] - r.made_ns for r in ground.requests.values())
    assert waits[9_500] <= 3 * 2600 * MS
    assert waits[9_990] <= 6 * 2600 * MS


def test_without_loss_a_command_is_sent_until_its_report_arrives_and_no_more():
    air, rover, orders = Air(0.0, 1000 * MS), Executor(), []
    ground = Requester(1, rtt_ns=2 * S)
    ground.request("stop", {}, 0)
    run(air, ground, rover, 20 * S, orders)
    request = ground.requests[1]
    assert [o.name for o in orders] == ["stop"]
    assert request.sent == 2  # at 0 and 1 s; the report is heard at 2 s
    assert request.report is not None and request.report.data == (1.0,)


def test_a_request_that_arrives_after_its_expiry_is_reported_expired_and_never_executed():
    air, rover, orders = Air(1.0, 300 * MS), Executor(), []
    ground = Requester(1, rtt_ns=600 * MS)
    ground.request("goto", {"x_m": 1, "y_m": 2}, 0, expiry_ns=30 * S)
    run(air, ground, rover, 60 * S, orders)
    air.loss = 0.0
    run(air, ground, rover, 70 * S, orders, start_ns=60 * S)
    assert orders == []
    assert ground.requests[1].state is RequestState.EXPIRED


def test_the_outcome_is_learned_though_all_copies_of_its_report_were_lost():
    rover, ground = Executor(), Requester(1)
    ground.request("goto", {"x_m": 1, "y_m": 2}, 0)
    order = rover.receive(1, ground.send(0)[0], 0, Mode.STANDBY)
    assert order is not None
    for payload in rover.send(0):
        ground.receive(payload, 0)
    assert ground.requests[1].state is RequestState.ACCEPTED
    rover.report(order.request_id, RequestState.COMPLETED, 10 * S)
    assert len(rover.send(10 * S)) == 1 and len(rover.send(11 * S)) == 1  # both lost
    (asked,) = ground.send(20 * S)
    assert rover.receive(1, asked, 20 * S, Mode.STANDBY) is None
    for payload in rover.send(20 * S):
        ground.receive(payload, 20 * S)
    assert ground.requests[1].state is RequestState.COMPLETED
    assert ground.send(100 * S) == []


def test_a_late_report_does_not_overwrite_a_newer():
    ground = Requester(1)
    ground.request("stop", {}, 0)
    assert ground.receive(encode_report(Report(1, 1, 2, RequestState.COMPLETED)), 0) is not None
    assert ground.receive(encode_report(Report(1, 1, 1, RequestState.ACCEPTED)), 1) is None
    assert ground.requests[1].state is RequestState.COMPLETED


def test_the_oldest_requests_with_an_outcome_are_forgotten_and_no_open_one():
    ground = Requester(1, remembered=3)
    for _ in range(3):
        ground.request("stop", {}, 0)
    ground.receive(encode_report(Report(2, 1, 1, RequestState.COMPLETED)), 0)
    for _ in range(2):
        ground.request("stop", {}, 0)
    assert list(ground.requests) == [1, 3, 4, 5] and ground.open == 4


def test_reports_for_another_station_are_not_mine():
    ground = Requester(2)
    ground.request("stop", {}, 0)
    assert ground.receive(encode_report(Report(1, 1, 1, RequestState.COMPLETED)), 0) is None
    assert ground.requests[1].state is RequestState.REQUESTED


def test_two_stations_may_use_the_same_request_id():
    rover = Executor()
    one, two = Requester(1), Requester(2)
    one.request("stop", {}, 0)
    two.request("stop", {}, 0)
    a = rover.receive(1, one.send(0)[0], 0, Mode.STANDBY)
    b = rover.receive(2, two.send(0)[0], 0, Mode.STANDBY)
    assert a is not None and b is not None and a.request_id != b.request_id


def refused(payload: bytes, mode: Mode = Mode.STANDBY) -> Report:
    rover = Executor()
    assert rover.receive(1, payload, 0, mode) is None
    return decode_report(rover.send(0)[0])


def test_a_refused_command_says_what_would_be_allowed():
    goto = commands.encode(commands.Telecommand(1, 0, 0, "goto", {"x_m": 1.0, "y_m": 2.0}))
    report = refused(goto, Mode.SAFE)
    assert (report.state, report.code) == (RequestState.FAILED, Code.MODE)
    assert report.text.startswith("goto is refused in SAFE: it needs STANDBY, AUTONOMOUS; allowed now: resume")
    far = goto[:29] + np.array([2e4, 0.0, np.nan]).tobytes()
    report = refused(far)
    assert (report.code, report.text) == (Code.RANGE, "goto: `x_m` = 20000.0 should be -10000 to 10000 m")
    report = refused(goto[:20] + b"\xee")
    assert report.code == Code.UNKNOWN_COMMAND


def test_a_fault_that_the_table_does_not_have_is_refused_by_the_rover_too():
    mask = {"fault": "NODE_LOST", "lasting_s": 5.0}
    typed = commands.encode(commands.Telecommand(7, 0, 0, "faults_mask", mask))
    report = refused(typed.replace(b"NODE_LOST", b"NODE_LOOT"))
    assert (report.state, report.code) == (RequestState.FAILED, Code.RANGE)
    assert report.text == "faults_mask: unknown fault `NODE_LOOT`; did you mean `NODE_LOST`?"


def test_an_id_used_again_for_something_else_is_refused_and_so_is_one_that_was_forgotten():
    rover = Executor(capacity=3)
    for n in range(1, 6):
        payload = commands.encode(commands.Telecommand(n, 0, 0, "status", {}))
        assert isinstance(rover.receive(1, payload, 0, Mode.STANDBY), Order)
    rover.send(10 * S)
    other = commands.encode(commands.Telecommand(5, 0, 0, "scan", {}))
    assert rover.receive(1, other, 11 * S, Mode.STANDBY) is None
    old = commands.encode(commands.Telecommand(1, 0, 0, "status", {}))
    assert rover.receive(1, old, 11 * S, Mode.STANDBY) is None
    assert {decode_report(p).code for p in rover.send(12 * S)} == {Code.REUSED_ID, Code.FORGOTTEN_ID}


@pytest.mark.parametrize("request_id", [1, 5])
@pytest.mark.parametrize("name", commands.HALTING)
def test_what_halts_is_obeyed_once_under_an_id_that_was_used_or_forgotten(name, request_id):
    rover = Executor(capacity=3)
    for n in range(1, 6):
        rover.receive(1, commands.encode(commands.Telecommand(n, 0, 0, "status", {})), 0, Mode.STANDBY)
    halt = commands.encode(commands.Telecommand(request_id, 0, 0, name, {}))
    order = rover.receive(1, halt, 11 * S, Mode.AUTONOMOUS)
    assert order is not None and order.name == name
    rover.report(order.request_id, RequestState.COMPLETED, 12 * S, "done")
    assert rover.receive(1, halt, 13 * S, Mode.STANDBY) is None
    assert decode_report(rover.send(14 * S)[0])[:4:3] == (request_id, RequestState.COMPLETED)


def test_only_the_newest_report_of_a_request_waits_and_two_copies_of_it_are_sent():
    rover = Executor()
    rover.receive(1, commands.encode(commands.Telecommand(1, 0, 0, "stop", {})), 0, Mode.STANDBY)
    rover.report(1 << 32 | 1, RequestState.STARTED, 0)
    rover.report(1 << 32 | 1, RequestState.COMPLETED, 0, "é" * 200)
    states = [decode_report(p) for t in (0, 200 * MS, 400 * MS) for p in rover.send(t)]
    assert [r.state for r in states] == [RequestState.COMPLETED] * 2
    assert states[0].text == "é" * 53 + "…"


@pytest.mark.parametrize("payload", [b"", b"\1", bytes(8), bytes([1, 0, 0, 0, 1, 1, 99, 0, 0])])
def test_malformed_reports_are_wire_errors(payload):
    with pytest.raises(WireError):
        decode_report(payload)


# -- start times -----------------------------------------------------------------------------------------------


def ask(rover, request_id, name, now_ns, *, expiry_ns=0, start_ns=0, **arguments):
    sent = commands.Telecommand(request_id, 0, expiry_ns, name, arguments, start_ns)
    return rover.receive(1, commands.encode(sent), now_ns, Mode.STANDBY)


def last(rover, now_ns):
    return [decode_report(payload) for payload in rover.send(now_ns)][-1]


def test_a_request_with_a_start_time_waits_for_it_and_begins_in_the_mode_of_that_time():
    rover = Executor()
    assert ask(rover, 1, "goto", 1 * S, start_ns=9 * S, x_m=1.0, y_m=2.0) is None
    assert ask(rover, 2, "scan", 1 * S, start_ns=5 * S) is None
    assert last(rover, 1 * S)[3:6] == (RequestState.ACCEPTED, 0, "waits until 5.0 s, now 1.0 s")
    assert rover.due(5 * S - 1, Mode.STANDBY) == []
    assert rover.waits == ["scan at 5.0 s (1#2)", "goto at 9.0 s (1#1)"]
    assert [order.name for order in rover.due(5 * S, Mode.STANDBY)] == ["scan"]
    assert rover.due(9 * S, Mode.SAFE) == []
    assert last(rover, 9 * S).code == Code.MODE
    assert rover.held == 0


def test_what_waits_is_cancelled_by_a_word_and_expires_like_any_other():
    rover = Executor()
    ask(rover, 1, "goto", 0, start_ns=9 * S, expiry_ns=10 * S, x_m=1.0, y_m=2.0)
    assert rover.due(11 * S, Mode.STANDBY) == [] and last(rover, 11 * S).state is RequestState.EXPIRED
    ask(rover, 2, "scan", 11 * S, start_ns=20 * S)
    rover.cancel_waiting(12 * S, "stop: operator")
    assert last(rover, 12 * S)[3:6] == (RequestState.CANCELLED, 0, "stop: operator")
    assert rover.due(30 * S, Mode.STANDBY) == []


def test_a_request_that_would_expire_before_it_may_start_is_refused_and_so_is_the_33rd_that_waits():
    rover = Executor()
    ask(rover, 1, "scan", 0, start_ns=9 * S, expiry_ns=8 * S)
    assert last(rover, 0).code == Code.RANGE
    for n in range(2, 35):
        ask(rover, n, "scan", 0, start_ns=9 * S)
    assert rover.held == 32 and last(rover, 0).code == Code.TOO_MANY


def test_a_reboot_is_known_to_be_done_by_the_new_boot_and_is_not_asked_again():
    ground = Requester(1)
    ground.request("reboot", {}, 0)
    ground.request("stop", {}, 0)
    assert len(ground.send(0)) == 2
    (told,) = ground.rover_booted(7, 3 * S)
    assert (told.request_id, told.state, told.text) == (1, RequestState.COMPLETED, "started again, boot 7")
    assert ground.requests[1].state is RequestState.COMPLETED and ground.requests[2].state is RequestState.REQUESTED
    assert len(ground.send(60 * S)) == 1


def test_a_stop_is_repeated_sooner_than_what_moves_where_the_line_carries_it():
    ground = Requester(1)
    ground.halt_retry_ns = 50 * MS
    stop = ground.request("stop", {}, 0)
    drive = ground.request("goto", {"x_m": 1.0, "y_m": 0.0}, 0)
    for ms in range(1000):
        ground.send(ms * MS)
    assert [ground.requests[each].sent for each in (stop, drive)] == [20, 2]
    ground.rtt_ns = 2600 * MS  # a long way: half a round trip, as all else
    sent = ground.requests[stop].sent
    for ms in range(1000, 3000):
        ground.send(ms * MS)
    assert ground.requests[stop].sent == sent + 2


def answered(rover, questions, now_ns):
    """So many questions of station 4 asked and answered; then station 1 asks one, and station 2 stops the rover."""
    asked = [(4, n, "time") for n in range(questions)] + [(1, 5, "status"), (2, 7, "stop")]
    for station, request_id, name in asked:
        payload = commands.encode(commands.Telecommand(request_id, 0, 0, name, {}))
        rover.report(
            rover.receive(station, payload, now_ns, Mode.STANDBY).request_id, RequestState.COMPLETED, now_ns, name
        )


def test_the_report_of_a_stop_leaves_first_and_then_each_station_s_in_turn_however_many_questions_wait():
    rover = Executor()
    answered(rover, 1000, S)
    leaving = [decode_report(payload) for payload in rover.send(S, budget_bytes=500.0)]
    assert [report.station for report in leaving[:3]] == [2, 4, 1]
    assert leaving[0].text == "stop"


def test_of_a_station_that_asks_without_end_a_bounded_number_of_reports_waits_and_it_may_ask_again():
    rover = Executor()
    answered(rover, 3000, S)
    left = [decode_report(payload) for payload in rover.send(10 * S) if decode_report(payload).station == 4]
    assert {report.request_id for report in left} == set(range(3000 - 256, 3000))
    rover.receive(4, commands.encode(commands.Telecommand(0, 0, 0, "time", {})), 10 * S, Mode.STANDBY)
    assert decode_report(rover.send(10 * S)[0]).request_id == 0
    assert rover.send(11 * S) and not rover.send(11 * S) and not rover.waiting(11 * S)
