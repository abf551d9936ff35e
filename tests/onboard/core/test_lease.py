"""Who may command: every decision of the lease by itself, with its bounds to the nanosecond."""

from types import SimpleNamespace

import pytest

from onboard.core.modes.lease import Lease
from protocol.link.transactions import Order, RequestState
from protocol.tables.commands import RefusedError

S = 1_000_000_000


class Bed:
    """The lease of 120 s with stations that are heard when a test says so. reports: (station, state, text, data)."""

    def __init__(self):
        self.reports, self.now_ns, self.heard_ns = [], 1000 * S, {n: 1000 * S for n in (1, 2, 3)}
        self.lease = Lease(120.0, self)

    def permit(self, check):
        self.check = check

    def report(self, request_id, state, text="", data=()):
        self.reports.append((request_id >> 32, state, text, tuple(data)))

    def at(self, seconds, *heard):
        self.now_ns = round((1000 + seconds) * S)
        self.heard_ns.update(dict.fromkeys(heard, self.now_ns))
        self.lease.step(SimpleNamespace(now_ns=self.now_ns))

    def do(self, name, station):
        order, ctx = Order(station << 32 | 1, name, {}, station), SimpleNamespace(now_ns=self.now_ns)
        self.lease.check(order, ctx)
        if name in self.lease.orders:
            self.lease.orders[name](order, ctx)


@pytest.fixture
def bed():
    return Bed()


def test_a_command_takes_a_free_lease_and_a_question_or_a_stop_does_not(bed):
    for name in ("status", "stop", "safe", "emergency_stop", "lease_show"):
        bed.do(name, 2)
    assert bed.lease.holder == 0
    bed.do("goto", 2)
    assert bed.lease.holder == 2


def test_the_holder_commands_and_of_others_only_questions_and_stops_pass(bed):
    bed.do("goto", 1)
    bed.do("goto", 1)
    for name in ("status", "stop", "safe", "emergency_stop"):
        bed.do(name, 2)
    with pytest.raises(RefusedError, match="station 1 holds the lease"):
        bed.do("goto", 2)
    assert bed.lease.holder == 1


def test_the_rovers_own_orders_need_no_lease_and_take_none(bed):
    bed.do("goto", 0)
    assert bed.lease.holder == 0
    bed.do("goto", 1)
    bed.do("goto", 0)
    assert bed.lease.holder == 1


def test_a_holder_silent_for_exactly_the_lease_keeps_it_and_a_nanosecond_later_loses_it(bed):
    bed.do("goto", 1)
    bed.at(120.0)
    assert bed.lease.holder == 1
    bed.at(120.0 + 1e-6)
    assert bed.lease.holder == 0
    bed.do("goto", 2)
    assert bed.lease.holder == 2


def test_a_holder_that_is_heard_keeps_it_for_ever(bed):
    bed.do("goto", 1)
    for minute in range(100):
        bed.at(60.0 * minute, 1)
    assert bed.lease.holder == 1


def test_who_asks_a_free_lease_has_it_at_once_and_asking_again_says_so(bed):
    bed.do("lease_ask", 1)
    bed.do("lease_ask", 1)
    assert bed.lease.holder == 1
    assert bed.reports == [(1, RequestState.COMPLETED, "station 1 holds it", ())] * 2


def test_a_release_gives_it_to_who_waited_longest_and_then_to_the_next(bed):
    for station in (1, 2, 3):
        bed.do("lease_ask", station)
    assert bed.lease.holder == 1
    assert [row[1] for row in bed.reports[1:]] == [RequestState.STARTED, RequestState.STARTED]
    bed.do("lease_release", 1)
    assert bed.lease.holder == 2
    bed.do("lease_release", 2)
    assert bed.lease.holder == 3
    bed.do("lease_release", 3)
    assert bed.lease.holder == 0
    assert bed.reports[-1] == (3, RequestState.COMPLETED, "nobody holds it", ())


def test_asked_again_a_station_goes_to_the_end_of_the_line_and_others_stay_in_it(bed):
    for station in (1, 2, 3, 2):
        bed.do("lease_ask", station)
    assert (2, RequestState.CANCELLED, "asked for again", ()) in bed.reports
    assert (3, RequestState.CANCELLED, "asked for again", ()) not in bed.reports
    bed.do("lease_release", 1)
    assert bed.lease.holder == 3


def test_who_waits_may_leave_the_line_and_who_does_neither_is_refused(bed):
    for station in (1, 2, 3):
        bed.do("lease_ask", station)
    bed.do("lease_release", 3)
    assert bed.lease.holder == 1
    assert bed.reports[-2:] == [
        (3, RequestState.CANCELLED, "no longer asked for", ()),
        (3, RequestState.COMPLETED, "no longer asked for", ()),
    ]
    with pytest.raises(RefusedError, match="station 3 does not hold the lease"):
        bed.do("lease_release", 3)
    bed.do("lease_release", 1)
    assert bed.lease.holder == 2


@pytest.mark.parametrize(("silent_s", "holder"), [(120.0, 2), (120.0 + 1e-6, 3)])
def test_one_that_waits_and_has_fallen_silent_itself_is_passed_over(bed, silent_s, holder):
    for station in (1, 2, 3):
        bed.do("lease_ask", station)
    bed.at(silent_s, 1, 3)
    bed.do("lease_release", 1)
    assert bed.lease.holder == holder
    silent = (2, RequestState.FAILED, "not heard any more when its turn came", ())
    assert (silent in bed.reports) == (holder == 3)


def test_who_holds_it_and_who_waits_is_told_in_words_and_numbers(bed):
    bed.do("lease_show", 3)
    assert bed.reports[-1] == (3, RequestState.COMPLETED, "nobody holds it", (0,))
    bed.do("lease_ask", 1)
    bed.do("lease_ask", 2)
    bed.at(30.0)
    bed.do("lease_show", 3)
    assert bed.reports[-1] == (3, RequestState.COMPLETED, "station 1 holds it, heard 30 s ago; waiting: 2", (1, 2))
