"""Laws of requests and objects under any mix of loss, copies, delay, disorder and restarts of either side."""

import itertools
import math

from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.link import bulk
from protocol.link.transactions import Code, Executor, Report, Requester, RequestState, encode_report
from protocol.tables import commands
from protocol.tables.commands import HALTING
from protocol.tables.modes import Mode

S = 1_000_000_000
MS = 1_000_000


def deliveries(payloads):
    """All orders in which each payload comes never, once or twice."""
    for counts in itertools.product(range(3), repeat=len(payloads)):
        bag = [n for n, count in enumerate(counts) for _ in range(count)]
        yield from set(itertools.permutations(bag))


def test_no_permutation_of_lost_repeated_late_acks_of_two_commands_confirms_the_wrong_one():
    """Two gotos at once, one arrives and one fails; each of their four reports is heard never, once or twice."""
    said = {
        1: (Report(1, 1, 1, RequestState.ACCEPTED), Report(1, 1, 2, RequestState.COMPLETED, 0, "first")),
        2: (Report(2, 1, 1, RequestState.ACCEPTED), Report(2, 1, 2, RequestState.FAILED, 0, "second")),
    }
    reports = [*said[1], *said[2]]
    payloads, tried = [encode_report(report) for report in reports], 0
    for order in deliveries(payloads):
        ground = Requester(1)
        for n in (1.0, 2.0):
            ground.request("goto", {"x_m": n, "y_m": 0.0}, 0)
        for n in order:
            ground.receive(payloads[n], 0)
        for request_id, (accepted, final) in said.items():
            mine = [reports[n] for n in order if reports[n].request_id == request_id]
            expected = final.state if final in mine else accepted.state if mine else RequestState.REQUESTED
            request = ground.requests[request_id]
            assert request.state == expected
            assert [report for _, report in request.history if report not in (accepted, final)] == []
            assert len(request.history) == len(set(report.serial for _, report in request.history))
        assert ground.open == 2 - sum(final in [reports[n] for n in order] for _, final in said.values())
        tried += 1
    bags = itertools.product(range(3), repeat=4)
    assert tried == sum(math.factorial(sum(bag)) // math.prod(map(math.factorial, bag)) for bag in bags) == 7365


FATES = st.lists(st.tuples(st.integers(0, 3), st.integers(0, 40)), min_size=1, max_size=8)


class Rough:
    """A way on which the n-th payload has fate n: lost, or as many copies, each so many steps late."""

    def __init__(self, fates) -> None:
        self._fates, self._n, self.way = fates, 0, []

    def put(self, step: int, payloads) -> None:
        for payload in payloads:
            copies, late = self._fates[self._n % len(self._fates)]
            self._n += 1
            self.way += [(step + 1 + late * (k + 1) % 41, payload) for k in range(copies)]

    def take(self, step: int):
        due = [payload for at, payload in self.way if at <= step]
        self.way = [row for row in self.way if row[0] > step]
        return due


def told_truly(request, done, rover_off):
    """Whether a request's outcome is what became of it. done: boot, request id and name of each order."""
    request_id, ids = request.telecommand.request_id, {row[1] for row in done}
    if request.state == RequestState.COMPLETED:
        return request_id in ids and request.report.text == str(request_id)
    if request.state == RequestState.FAILED:
        return request.report.code == Code.RESTARTED and rover_off
    if request.state == RequestState.CANCELLED:  # a stop that was asked for later was there before it
        stops = [row[1] for row in done if row[2] == "stop"]
        return request.report.code == Code.OVERTAKEN and max(stops) > request_id not in ids
    return True


@settings(max_examples=120, deadline=None, derandomize=True)
@given(FATES, FATES, st.sets(st.integers(5, 150), max_size=2), st.sets(st.integers(5, 150), max_size=2))
def test_every_request_is_executed_at_most_once_and_its_outcome_is_true(up_fates, down_fates, rover_off, ground_off):
    """Ground restarts forget requests but not their ids; rover restarts forget everything, as the new boot id tells.

    What was sealed for an earlier boot is not opened any more, so nothing on the way outlives a restart of the rover.
    """
    up, down = Rough([*up_fates, (1, 0)]), Rough([*down_fates, (1, 0)])
    rover, ground, done, requests, boot = Executor(), Requester(1), [], [], 1
    for step in range(1500):
        now_ns = step * 100 * MS
        if step in ground_off:
            ground = Requester(1, first_id=ground.next_id + 8)
        if step in rover_off:
            rover, up.way, down.way, boot = Executor(), [], [], boot + 1
            ground.rover_booted(boot, now_ns)
        if step % 10 == 0 and step < 150:
            name, n = ("stop", 0.0) if step % 40 == 30 else ("goto", float(len(requests)))
            request_id = ground.request(name, {} if name == "stop" else {"x_m": n, "y_m": 0.0}, now_ns)
            requests.append(ground.requests[request_id])
        for payload in up.take(step):
            order = rover.receive(1, payload, now_ns, Mode.STANDBY)
            if order is not None:
                done.append((boot, order.request_id & 0xFFFFFFFF, order.name))
                rover.report(order.request_id, RequestState.COMPLETED, now_ns, str(order.request_id & 0xFFFFFFFF))
        down.put(step, rover.send(now_ns))
        for payload in down.take(step):
            ground.receive(payload, now_ns)
        up.put(step, ground.send(now_ns))
    moved = [request_id for _, request_id, name in done if name not in HALTING]
    assert len(moved) == len(set(moved))
    assert len(done) == len({row[:2] for row in done})
    for request in requests:
        assert told_truly(request, done, rover_off)
    assert not ground.open
    if not rover_off and not ground_off:
        completed = [request.state for request in requests].count(RequestState.COMPLETED)
        assert completed == len(done) >= 3 and {r.state for r in requests} <= {
            RequestState.COMPLETED,
            RequestState.CANCELLED,
        }


def test_a_request_that_was_under_way_when_the_rover_restarted_ends_with_that_and_a_stop_is_asked_of_the_new_one():
    ground = Requester(1)
    goto, stop, later = (
        ground.request(name, given, 0)
        for name, given in (("goto", {"x_m": 1.0, "y_m": 0.0}), ("stop", {}), ("scan", {}))
    )
    ground.requests[later].next_ns = 9 * S
    assert len(ground.send(0)) == 2
    ground.receive(encode_report(Report(goto, 1, 1, RequestState.STARTED)), S)
    ground.rover_booted(7, 2 * S)
    assert ground.requests[goto].report[3:6] == (
        RequestState.FAILED,
        Code.RESTARTED,
        "the rover restarted (boot 7) before its outcome was heard; until then: started",
    )
    asked = [commands.decode(payload).name for payload in ground.send(20 * S)]
    assert asked == ["stop", "scan"]
    assert ground.requests[stop].state is RequestState.REQUESTED


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    FATES,
    FATES,
    st.integers(1, 3000),
    st.sets(st.integers(5, 120), max_size=2),
    st.sets(st.integers(5, 120), max_size=2),
    st.integers(0, 99),
)
def test_an_object_arrives_as_it_was_whoever_restarts(up_fates, down_fates, size, sender_off, receiver_off, seed):
    data = bytes((seed * 7 + k * k * 31 + (k >> 8)) & 0xFF for k in range(size))
    up, down = Rough([*up_fates, (1, 0)]), Rough([*down_fates, (1, 0)])
    sender, receiver, products = bulk.Sender(200), bulk.Receiver(200), []
    sender.offer("a", data, "raw", 0)
    for step in range(12_000):
        now_ns = step * 100 * MS
        if step in sender_off and not products:  # whoever asked for it asks again
            sender = bulk.Sender(200)
            sender.offer("a", data, "raw", now_ns)
        if step in receiver_off:
            receiver = bulk.Receiver(200)
        for payload in up.take(step):
            sender.receive(payload, now_ns)
        down.put(step, sender.send(now_ns, 800))
        for payload in down.take(step):
            product = receiver.receive(payload, now_ns)
            products += [product] if product else []
        up.put(step, receiver.send(now_ns))
        if products and not sender.busy and step > 121:
            break
    assert {p.data for p in products} == {data} and {p.name for p in products} == {"a"}
    assert not sender.busy and receiver.damaged == 0
    assert len(products) <= 1 + len(receiver_off)
