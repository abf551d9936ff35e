"""Tests of the soak's judge: it finds growth and nothing else; its process figures are the system's."""

import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.soak.lockstep import SETTLED, Sampler, Soaked
from tests.soak.taken import Taken, child, growth, taken
from tests.soak.wall import Sat

pytestmark = pytest.mark.tool

FLAT = [Taken(float(k), 200_000_000 + (-1) ** k * 900_000, 20, 8) for k in range(10)]


def test_what_is_flat_holds():
    assert growth(FLAT) == []


@pytest.mark.parametrize(("change", "words"), [
    ({"rss_bytes": 203_000_000}, "resident memory is not flat: 199.1 to 203.0 MB"),
    ({"descriptors": 21}, "descriptors grow from 20 to 21"), ({"threads": 9}, "threads grow from 8 to 9"),
])  # fmt: skip
def test_each_kind_of_growth_is_found(change, words):
    assert growth([*FLAT, FLAT[-1]._replace(**change)]) == [words]


def test_without_samples_nothing_is_promised():
    assert growth(FLAT[:1]) and growth([])


def test_growth_before_the_map_and_the_modules_are_there_is_none():
    early = [Taken(0.0, 120_000_000, 15, 4)] * (SETTLED - 1)
    sound = Soaked((*early, *FLAT), (), 12, 360_000, 0, 3600.0, 900.0, "")
    assert sound.faults(12, 3600.0) == []
    late = Soaked((*FLAT[:SETTLED], *early), (), 12, 360_000, 0, 3600.0, 900.0, "")
    assert late.faults(12, 3600.0)


def test_a_missed_mission_a_tick_left_out_and_a_short_record_break_the_promise():
    told = Soaked(tuple(FLAT), (), 9, 359_000, 2, 3600.0, 900.0, "onboard died").faults(10, 3600.0)
    assert told[0] == "onboard died" and len(told) == 4


def test_on_the_wall_clock_ticks_left_out_are_counted_and_a_bad_end_is_a_fault():
    assert Sat(tuple(FLAT), 6000, 40, 512, 0).faults() == []
    assert Sat(tuple(FLAT), 6000, 0, 512, -11).faults() == ["the daemon ended with -11"]


def test_descriptors_and_threads_are_those_of_the_process():
    before = taken(os.getpid(), 0.0)
    done = threading.Event()
    waiting = threading.Thread(target=done.wait)
    waiting.start()
    pipe = os.pipe()
    after = taken(os.getpid(), 1.0)
    done.set()
    waiting.join()
    for end in pipe:
        os.close(end)
    assert (after.threads - before.threads, after.descriptors - before.descriptors) == (1, 2)
    assert 10_000_000 < after.rss_bytes < 10_000_000_000


@contextmanager
def waiting_child(*words: str) -> Iterator[subprocess.Popen[bytes]]:
    """Start a child with these words and wait until it runs: before that it may have no command line."""
    code = "print(flush=True); input()"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", code, *words], **pipes) as started:
        started.stdout.readline()
        yield started
        started.communicate(b"\n")


def test_a_child_is_found_by_its_words():
    assert child(("soak", "here")) is None
    with waiting_child("soak", "here") as started:
        assert child(("soak", "here")) == started.pid


def test_a_sample_is_the_last_one_before_its_mark():
    with waiting_child("onboard", "run"):
        told = []
        sampler = Sampler([10.0, 20.0], told.append)
        for now_s in (1.0, 9.0, 10.5, 19.0, 21.0, 30.0):
            sampler(type("At", (), {"now_s": now_s})(), 0.0)
    assert [sample.at_s for sample in sampler.kept] == [9.0, 19.0] == [sample.at_s for sample in told]
