"""What the operating system is asked for, and what is told of the answer."""

import gc
import os
import select
import sys
import time

import pytest

from onboard.config import Realtime
from onboard.drivers.platform import realtime
from onboard.drivers.platform.alarm import Alarm
from onboard.drivers.platform.clock import WallClock, wait_for
from onboard.drivers.platform.garbage_collection import SlackCollector
from onboard.drivers.platform.realtime import Grant, RealTime, words

JOB_THREAD = 4711


@pytest.fixture
def system(monkeypatch):
    """An operating system that grants everything and keeps what it was asked."""
    asked = []
    monkeypatch.setattr(os, "sched_setscheduler", lambda *words: asked.append(("policy", words[0], words[1])))
    monkeypatch.setattr(os, "sched_setaffinity", lambda thread, cores: asked.append(("cores", thread, set(cores))))
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1, 2})
    monkeypatch.setattr(sys, "setswitchinterval", lambda _: None)
    return asked


def granted(wanted):
    made = RealTime(wanted, JOB_THREAD)
    made.close()
    return made.grants


def test_off_is_the_default_and_asks_for_nothing(system):
    assert granted(Realtime()) == ()
    assert system == []
    assert words(()) == []


def test_fifo_is_for_the_tick_and_the_job_thread_and_not_for_children_and_is_given_back(system):
    (grant,) = granted(Realtime(fifo_priority=50))
    fifo = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
    assert grant.granted and "SCHED_FIFO 50, jobs 1" in grant.text
    assert system == [
        ("policy", 0, fifo),
        ("policy", JOB_THREAD, fifo),
        ("policy", 0, os.SCHED_OTHER),
        ("policy", JOB_THREAD, os.SCHED_OTHER),
    ]


def test_a_refused_priority_says_why_and_what_to_do_and_the_program_goes_on(system, monkeypatch):
    def refuse(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    (grant,) = granted(Realtime(fifo_priority=50))
    assert not grant.granted
    assert "Operation not permitted" in grant.text and "LimitRTPRIO=50" in grant.text and "rtprio 50" in grant.text
    assert words((grant,))[0].startswith("real time: fifo_priority NOT granted: ")


def test_memory_that_could_be_refused_later_is_not_locked(system, monkeypatch):
    monkeypatch.setattr(realtime.resource, "getrlimit", lambda _: (8 << 20, 8 << 20))
    monkeypatch.setattr(realtime, "_has_capability", lambda _: False)
    (grant,) = granted(Realtime(lock_memory=True))
    assert not grant.granted and "8192 KiB" in grant.text and "LimitMEMLOCK=infinity" in grant.text


def test_the_tick_has_its_core_and_every_other_thread_the_others(system, monkeypatch):
    monkeypatch.setattr(os, "listdir", lambda _: ["7", "8", "9"])
    monkeypatch.setattr(realtime.threading, "get_native_id", lambda: 7)
    (grant,) = granted(Realtime(cpu=2))
    assert grant == Grant("cpu", True, "core 2, other threads on 0, 1")
    assert system[:-1] == [("cores", 0, {2}), ("cores", 8, {0, 1}), ("cores", 9, {0, 1})]
    assert system[-1] == ("cores", 0, {0, 1, 2})  # given back


def test_a_core_that_is_not_there_is_refused_with_those_that_are(system):
    (grant,) = granted(Realtime(cpu=5))
    assert not grant.granted and "one of 0, 1, 2" in grant.text and system == []


def test_every_option_of_the_configuration_can_be_asked_for():
    assert set(RealTime.OPTIONS) == set(Realtime.__dataclass_fields__)


def test_an_alarm_set_to_a_time_that_has_passed_is_heard_at_once_and_one_far_ahead_is_not():
    alarm = Alarm()
    alarm.set(time.monotonic_ns() + 3600 * 10**9)
    assert select.select([alarm], [], [], 0)[0] == []
    alarm.set(1)
    assert select.select([alarm], [], [], 3600)[0] == [alarm]
    alarm.set(time.monotonic_ns() + 3600 * 10**9)
    assert select.select([alarm], [], [], 0)[0] == []
    alarm.close()


def test_the_alarm_ends_a_wait_that_hears_nothing_and_is_no_news_of_the_port():
    quiet, loud = os.pipe()
    alarm = Alarm()
    alarm.set(1)
    assert not wait_for(quiet, 3600.0, alarm.fileno())
    assert not wait_for(-1, 3600.0, alarm.fileno())
    os.write(loud, b"x")
    assert wait_for(quiet, 3600.0, alarm.fileno())
    alarm.close()
    os.close(quiet)
    os.close(loud)


class HandClock(WallClock):
    """Time by hand: a wait ends `late_ns` after the deadline."""

    def __init__(self, late_ns):
        super().__init__()
        self.time_ns, self.wakes = 0, iter(late_ns)
        self.idle = self.sleep

    def now_ns(self):
        return self.time_ns

    def sleep(self, left_s):
        self.time_ns += round(left_s * 1e9) + next(self.wakes)


def test_the_clock_tells_how_late_each_tick_began_and_what_is_left_of_it():
    clock = HandClock([0, 150_000, 30_000])
    assert [(clock.wait().number, clock.late_ns) for _ in range(3)] == [(1, 0), (2, 150_000), (3, 30_000)]
    clock.time_ns += 4_000_000
    assert clock.left_ns == 6_000_000 - 30_000
    clock.time_ns += 21_000_000  # two deadlines pass
    assert (clock.wait().number, clock.slipped_ticks, clock.late_ns) == (5, 1, 5_030_000)


def test_the_alarm_is_set_to_each_deadline_and_the_limit_comes_after_it():
    clock, limits, set_to = HandClock([0, 0]), [], []
    clock.alarm = type("Bell", (), {"set": lambda _, at_ns: set_to.append(at_ns - clock._start_ns)})()
    clock.idle = lambda left_s: (limits.append(left_s), setattr(clock, "time_ns", set_to[-1]))
    assert [clock.wait().number for _ in range(2)] == [1, 2]
    assert set_to == [10_000_000, 20_000_000]
    assert all(limit_s > 0.010 for limit_s in limits)


@pytest.fixture
def collector():
    gc.collect()
    gc.freeze()
    made = SlackCollector(clock_ns=iter(range(0, 10**12, 10_000)).__next__)
    yield made
    made.close()
    gc.unfreeze()


def test_garbage_is_left_alone_in_a_tick_and_collected_where_time_is_left(collector):
    assert not gc.isenabled()
    kept = [[] for _ in range(2000)]
    collector.spend(left_ns=100_000)
    assert collector.counts == [0, 0, 0] and len(kept) == 2000
    collector.spend(left_ns=5_000_000)
    assert sum(collector.counts) == 1
    collector.close()
    assert gc.isenabled()


def test_a_collection_that_took_long_needs_twice_that_from_then_on():
    times = iter([0, 3_000_000])
    collector = SlackCollector(clock_ns=lambda: next(times))
    try:
        gc.collect()
        first = [[] for _ in range(2000)]
        collector.spend(left_ns=5_000_000)
        second = [[] for _ in range(2000)]
        collector.spend(left_ns=5_000_000)
        assert collector.counts == [1, 0, 0] and len(first) == len(second)
    finally:
        collector.close()
