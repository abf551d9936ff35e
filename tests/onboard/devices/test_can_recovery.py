"""The judgement of the bus as a machine of its own: hypothesis walks it through everything that ports and nodes do."""

from itertools import pairwise

from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.devices.can_recovery import GRACE_NS, HEAL_NS, SILENT_NS, SLOW_NS, WAITS_NS, Bus, CanRecovery
from onboard.records import BusStatus, PortState

TICK_NS = 10_000_000
OPEN, ERROR, CLOSED = (BusStatus(state) for state in (PortState.OPEN, PortState.ERROR, PortState.CLOSED))


class Walk:
    """A bus and its time; `steps` of one kind. connects: times in ns at which it wanted to be opened."""

    def __init__(self):
        self.bus, self.now_ns, self.connects = CanRecovery(), 0, []

    def steps(self, count, status=OPEN, heard=True):
        for _ in range(count):
            self.now_ns += TICK_NS
            self.bus.step(status, heard, self.now_ns)
            if self.bus.wants_connect:
                self.connects.append(self.now_ns)
        return self.bus.state


def well():
    walk = Walk()
    assert walk.steps(1100) is Bus.WELL and not walk.connects
    return walk


def test_silence_in_the_first_second_is_no_loss_a_closed_port_is():
    assert Walk().steps(GRACE_NS // TICK_NS, heard=False) is Bus.WELL
    early = Walk()
    assert early.steps(1, CLOSED, heard=False) is Bus.LOST and early.connects == [TICK_NS]


def test_silence_of_forty_milliseconds_is_a_loss_of_thirty_is_none():
    walk = well()
    assert walk.steps(SILENT_NS // TICK_NS - 1, heard=False) is Bus.WELL
    assert walk.steps(1, heard=False) is Bus.LOST and walk.bus.words == "no frame of any node"


def test_a_heal_takes_a_tenth_of_a_second_of_frames():
    walk = well()
    walk.steps(3, ERROR, heard=False)
    assert walk.steps(1) is Bus.HEALING
    assert walk.steps(HEAL_NS // TICK_NS - 1) is Bus.HEALING
    assert walk.steps(1) is Bus.WELL


def test_the_tries_are_spaced_as_the_table_says_then_slow_and_for_ever():
    walk = well()
    lost_ns = walk.now_ns + TICK_NS
    walk.steps(4000, CLOSED, heard=False)
    assert walk.connects[0] == lost_ns
    gaps = [b - a for a, b in pairwise(walk.connects)]
    assert tuple(gaps[: len(WAITS_NS)]) == WAITS_NS
    assert set(gaps[len(WAITS_NS) :]) == {SLOW_NS}


def test_used_up_is_told_after_the_last_wait_and_not_before():
    walk = well()
    walk.steps(sum(WAITS_NS) // TICK_NS, CLOSED, heard=False)
    assert not walk.bus.used_up
    walk.steps(1, CLOSED, heard=False)
    assert walk.bus.used_up
    walk.steps(1)
    assert not walk.bus.used_up


def test_tries_are_given_back_after_ten_good_seconds_only():
    walk = well()
    for _ in range(3):
        walk.steps(1, CLOSED, heard=False)
        walk.steps(100)
    assert walk.bus.tries == 3
    walk.steps(1000)
    walk.steps(1, CLOSED, heard=False)
    assert walk.bus.tries == 1


def test_news_of_the_port_come_at_most_once_a_second():
    walk, told = well(), []
    for k in range(500):
        walk.steps(1, BusStatus(error=f"word {k}"))
        told += [walk.now_ns] if walk.bus.news else []
    assert len(told) == 5 and min(b - a for a, b in pairwise(told)) >= 1_000_000_000


@given(st.lists(st.tuples(st.sampled_from([OPEN, ERROR, CLOSED]), st.booleans(), st.integers(1, 60)), max_size=30))
@settings(max_examples=80, deadline=None, derandomize=True)
def test_it_never_asks_while_well_never_twice_within_a_wait_and_always_heals(course):
    walk = well()
    for status, heard, count in course:
        for _ in range(count):
            walk.steps(1, status, heard)
            assert not (walk.bus.wants_connect and walk.bus.state is Bus.WELL)
    assert all(b - a >= TICK_NS for a, b in pairwise(walk.connects))
    quick = [a for a in walk.connects if a >= walk.now_ns - 1_000_000_000]
    assert len(quick) <= 1 + sum(count for _, _, count in course)
    walk.steps(2 + HEAL_NS // TICK_NS)
    assert walk.bus.state is Bus.WELL
