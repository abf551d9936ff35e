"""`onboard jitter`: what is measured, what of it is told, and how it ends early."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from onboard.__main__ import app
from onboard.bringup.jitter import reference
from onboard.bringup.jitter.command import ALL, figures, lines
from onboard.bringup.jitter.job import request
from onboard.bringup.jitter.measure import WARM_TICKS, Bed, JitterFigures
from onboard.bringup.jitter.reference import ReferenceError, of_cyclictest
from onboard.config import Config, Realtime
from onboard.native import _wakes
from onboard.planning.cycle import plan
from tests.onboard.drivers.test_realtime import HandClock

HISTOGRAM = """# /dev/cpu_dma_latency set to 0us
# Histogram
000000 000000
000006 000004
000007 000002
000012 000001
# Total: 000000007
# Min Latencies: 00006
# Avg Latencies: 00007
# Max Latencies: 31337
# Histogram Overflows: 00002
# Histogram Overflow at cycle number:
# Thread 0: 3 5
"""


def test_the_loop_measures_each_tick_after_the_warm_ones_to_the_nanosecond():
    late_ns = [500_000] * WARM_TICKS + [50_000, 60_000, 70_000, 3_000_000, 80_000]
    bed = Bed(Config(), HandClock(late_ns), lambda _: None, job=False)
    bed._clock.idle = bed._clock.sleep
    measured = bed.measure(5)
    bed.close()
    assert measured.late_us.tolist() == [50.0, 60.0, 70.0, 3000.0, 80.0]
    assert (measured.slipped_ticks, measured.jobs, measured.grants) == (0, 0, ())
    assert (measured.tick_us > 0).all()


@pytest.mark.tool
def test_a_planner_is_at_work_beside_the_loop_all_the_time():
    bed = Bed(Config(), HandClock([0] * 1000), lambda _: None, job=True)
    bed._clock.idle = lambda left_s: (bed._clock.sleep(left_s), bed._workers.thread_id())  # the job is done by then
    measured = bed.measure(3)
    bed.close()
    assert measured.jobs == WARM_TICKS + 3 and measured.job_worst_ms > 0  # one for each tick


def test_the_planners_job_is_a_stop_that_has_somewhere_to_go():
    asked = request(Config())
    decision = plan(asked).decision
    assert decision.kind == "drive" and decision.path.length_m > 1.0
    assert np.count_nonzero(asked.ldem.n) > 7000


def test_stopped_early_it_gives_what_it_has():
    clock = HandClock([0] * 1000)
    bed = Bed(Config(), clock, lambda ratio: setattr(clock, "stopping", ratio > 0.4), job=False)
    clock.idle = clock.sleep
    assert len(bed.measure(200).late_us) == 100
    bed.close()


def test_cyclictests_histogram_is_read_and_what_lies_beyond_counts_as_its_maximum():
    assert sorted(of_cyclictest(HISTOGRAM)) == [6] * 4 + [7] * 2 + [12] + [31337] * 2
    with pytest.raises(ReferenceError, match="no histogram"):
        of_cyclictest("# Total: 0\n")


def test_cyclictest_is_asked_for_the_same_interval_count_and_policy(monkeypatch):
    asked = []
    popen = reference.subprocess.Popen
    monkeypatch.setattr(reference.shutil, "which", lambda _: "/bin/cyclictest")

    def start(words, **more):
        asked.append(words)
        return popen("true", **more)

    monkeypatch.setattr(reference.subprocess, "Popen", start)
    for priority in (0, 50):
        reference.start(10_000_000, 3000, priority).stop()
    assert all({"--interval=10000", "--loops=3000", "--threads=1"} <= set(words) for words in asked)
    assert "--policy=other" in asked[0] and {"--policy=fifo", "--prio=50"} <= set(asked[1])


def test_the_bare_loop_wakes_as_often_as_asked_and_never_early():
    late_ns = np.full(20, -1, np.int64)
    _wakes.wake_into(10_000, late_ns)
    assert (late_ns >= 0).all()


def measured(late_us, grants=()):
    late_us = np.array(late_us, float)
    return JitterFigures(late_us, np.full(len(late_us), 500.0), 2, 7, 33.0, grants)


def test_the_figures_are_the_shares_of_what_was_measured():
    told = figures(measured(np.arange(1, 1001)), np.full(10, 50.0), "bare loop")
    assert told["late_us"] == {"p50": 500.5, "p99": 990.01, "p999": 999.0, "max": 1000.0}
    assert told["done_us"]["max"] == 1500.0 and told["reference"]["late_us"]["p50"] == 50.0
    assert sum(told["histogram"]["ours"]) == 1000 and sum(told["histogram"]["reference"]) == 10
    assert json.loads(json.dumps(told)) == told


def test_for_people_ours_stands_beside_the_reference_with_the_ratio_and_the_package():
    page = "\n".join(lines(figures(measured([100.0] * 10), np.full(10, 50.0), "bare loop")))
    assert "10 ticks of 10 ms, 2 left out; 7 planner jobs beside, the longest 33 ms" in page
    assert "ours / bare loop           2.00     2.00     2.00     2.00" in page
    assert "package rt-tests" in page and "onboard jitter --real-time" in page
    other = "\n".join(lines(figures(measured([100.0] * 10), np.full(10, 50.0), "cyclictest")))
    assert "rt-tests" not in other


def test_a_run_that_was_stopped_at_once_has_no_figures_and_says_so():
    assert lines(figures(measured([]), None, "bare loop")) == ["nothing was measured yet"]


def test_the_command_measures_and_writes_json():
    result = CliRunner().invoke(app, ["jitter", "--seconds", "1", "--json", "--no-job"])
    told = json.loads(result.stdout)
    assert result.exit_code == 0 and told["ticks"] == 100 and told["jobs"] == 0
    assert told["reference"]["wakes"] == 100


def test_a_reference_that_cannot_run_is_one_line(monkeypatch):
    def broken(*_):
        raise ReferenceError("the bare loop does not start: it is not built")

    monkeypatch.setattr(reference, "start", broken)
    result = CliRunner().invoke(app, ["jitter", "--seconds", "1"])
    assert result.exit_code == 69 and result.stderr == "onboard: the bare loop does not start: it is not built\n"


def test_all_options_but_the_core_are_what_the_flag_asks_for():
    off = Realtime()
    assert [name for name in Realtime.__dataclass_fields__ if getattr(ALL, name) == getattr(off, name)] == ["cpu"]
