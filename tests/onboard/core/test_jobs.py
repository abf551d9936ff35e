"""A job's result is taken at exactly its tick; what is no longer wanted is dropped."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from pkgutil import resolve_name
from threading import Event

import pytest

from onboard.core.jobs import GIVE_UP_TICKS, JOBS, Job, JobBook, Late
from onboard.core.modes.product_orders import PRODUCT_JOBS
from onboard.drivers.platform.workers import Inline, JobError, Workers
from onboard.records import JobDone


def test_in_lock_step_a_result_comes_at_its_due_tick_and_no_earlier():
    book, workers = JobBook({"factorial": Job("math:factorial", Late.WAIT)}), Workers(wait=True)
    book.submit("factorial", (5,), due_tick=5)
    workers.start(book.outgoing())
    taken = {tick: book.take(workers.collect(tick), tick) for tick in range(1, 8)}
    workers.close()
    assert taken[5] == {"factorial": 120}
    assert not any(result for tick, result in taken.items() if tick != 5)
    assert book.late_ticks == 0
    assert book.running == ()


def test_a_job_is_overdue_from_the_tick_after_its_own_until_it_is_taken_or_forgotten():
    book = JobBook()
    book.submit("plan", (), 110)
    (request,) = book.outgoing()
    assert [book.overdue_ticks(tick) for tick in (109, 110, 111, 140)] == [0, 0, 1, 30]
    book.take((JobDone(request.job_id, 2),), 140)
    assert book.overdue_ticks(141) == 0
    book.submit("plan", (), 110)
    book.forget({"plan"})
    assert book.overdue_ticks(150) == 0


def test_a_late_result_is_counted_in_ticks():
    book = JobBook()
    book.submit("plan", (), due_tick=10)
    (request,) = book.outgoing()
    assert book.take((JobDone(request.job_id, "path"),), 13) == {"plan": "path"}
    assert book.late_ticks == 3


def test_a_forgotten_job_gives_nothing_and_its_name_is_free_again():
    book = JobBook()
    book.submit("plan", (), due_tick=10)
    (first,) = book.outgoing()
    book.forget({"plan"})
    book.submit("plan", (), due_tick=20)
    (second,) = book.outgoing()
    assert book.take((JobDone(first.job_id, "old"),), 10) == {}
    assert book.take((JobDone(second.job_id, "new"),), 20) == {"plan": "new"}


def test_every_job_is_a_function_that_exists():
    assert all(callable(resolve_name(job.function)) for job in JOBS.values())


def test_a_job_is_run_where_it_was_sent_and_gives_the_same_in_a_replay():
    book, workers, inline = JobBook({"factorial": Job("math:factorial", Late.WAIT)}), Workers(wait=True), Inline()
    book.submit("factorial", (5,), due_tick=1)
    requests = book.outgoing()
    workers.start(requests)
    inline.start(requests)
    flown = workers.collect(1)
    workers.close()
    assert flown == inline.take((requests[0].job_id,)) == (JobDone(requests[0].job_id, 120),)


def test_what_cannot_be_loaded_raises_where_it_is_needed_and_not_before():
    book, workers = JobBook({"plan": Job("onboard.nowhere:plan", Late.WAIT)}), Workers(wait=True)
    workers.preload(["onboard.nowhere:plan"]).result()
    book.submit("plan", (), due_tick=1)
    workers.start(book.outgoing())
    with pytest.raises(JobError, match=r"ModuleNotFoundError: No module named 'onboard.nowhere'"):
        workers.collect(1)
    workers.close()


def test_what_is_loaded_early_is_loaded_in_the_worker_and_before_its_result():
    script = (
        "import sys; from onboard.drivers.platform.workers import Workers; w = Workers(wait=True); "
        "assert 'fractions' not in sys.modules; w.preload(['fractions:Fraction']).result(); w.close(); "
        "assert 'fractions' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


def test_the_flight_program_starts_without_the_libraries_that_only_jobs_and_the_filter_use():
    script = "import sys, onboard.app; print(*{name.partition('.')[0] for name in sys.modules})"
    loaded = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True).stdout.split()
    assert not {"scipy", "filterpy", "small_gicp"} & set(loaded)


PLAIN = {"plan": Job("math:factorial", Late.WAIT), "guard": Job("math:factorial", Late.HOLD)}


def test_lateness_is_counted_by_job_and_may_be_asked_for_by_policy():
    book = JobBook(PLAIN)
    book.submit("plan", (), due_tick=10)
    book.submit("guard", (), due_tick=15)
    first, second = book.outgoing()
    assert [book.overdue_ticks(20), book.overdue_ticks(20, Late.WAIT), book.overdue_ticks(20, Late.HOLD)] == [10, 10, 5]
    book.take((JobDone(first.job_id, 1), JobDone(second.job_id, 1)), 15, (7_000_000, 3_000_000))
    plan, guard = book.kept["plan"], book.kept["guard"]
    assert (plan.done, plan.late, plan.worst_late_ticks, plan.worst_ns) == (1, 1, 5, 7_000_000)
    assert (guard.done, guard.late, guard.worst_late_ticks, guard.worst_ns) == (1, 0, 0, 3_000_000)
    assert book.late_count == 1


def test_waiting_ends_a_minute_after_the_due_tick_and_a_hung_job_is_cancelled_and_counted_as_late():
    book = JobBook(PLAIN)
    book.submit("plan", (), due_tick=10)
    (request,) = book.outgoing()
    assert book.give_up(10 + GIVE_UP_TICKS) == ()
    assert book.give_up(11 + GIVE_UP_TICKS) == ("plan",)
    assert book.cancelled() == (request.job_id,)
    assert (book.running, book.cancelled(), book.late_count) == ((), (), 1)


def test_a_job_forgotten_before_it_was_sent_is_never_sent_and_needs_no_cancelling():
    book = JobBook(PLAIN)
    book.submit("plan", (), due_tick=10)
    book.forget({"plan"})
    assert (book.outgoing(), book.cancelled()) == ((), ())


@pytest.mark.parametrize("lockstep", [True, False])
def test_a_cancelled_job_that_waits_for_the_thread_never_begins(lockstep):
    gate, ran = Event(), []
    book, workers = JobBook({"first": Job("", Late.WAIT), "second": Job("", Late.WAIT)}), Workers(wait=lockstep)
    workers.preload([])  # the thread is there
    workers._pool.submit(gate.wait)
    book.submit("second", (ran.append, (1,)), due_tick=1)
    (request,) = book.outgoing()
    workers.start([replace(request, function="functools:reduce", arguments=(ran.append, (1, 2)))])
    book.forget({"second"})
    workers.start((), book.cancelled())
    gate.set()
    workers.close()
    assert (workers.collect(1), ran) == ((), [])


def test_a_replay_does_not_run_what_was_cancelled():
    book, inline = JobBook(PLAIN), Inline()
    book.submit("plan", (5,), due_tick=10)
    inline.start(book.outgoing())
    book.forget({"plan"})
    inline.start((), book.cancelled())
    assert inline.due(20) == ()


def test_on_the_wall_clock_a_job_is_measured_and_in_lock_step_it_is_not():
    for lockstep in (True, False):
        book, workers = JobBook(PLAIN), Workers(wait=lockstep)
        book.submit("plan", (5,), due_tick=1)
        workers.start(book.outgoing())
        workers.thread_id()  # it answers when the job is done
        assert [done.value for done in workers.collect(1)] == [120]
        assert [took_ns > 0 for took_ns in workers.took_ns] == ([] if lockstep else [True])
        workers.close()


def test_what_the_drive_guard_judges_holds_the_rover_while_it_is_late_and_nothing_waits_for_a_product():
    assert [name for name, job in JOBS.items() if job.late is Late.HOLD] == ["guard_listen"]
    assert [name for name, job in JOBS.items() if job.late is Late.GO_ON] == ["predict", *PRODUCT_JOBS]


def test_every_kernel_that_a_job_calls_releases_the_lock():
    """The binding of scans' blocks is the tick's own and keeps it: 3 us."""
    folder = Path(__file__).parents[3] / "onboard" / "kernels"
    sources = {path.name: path.read_text() for path in folder.glob("bind_*.hpp")}
    assert len(sources) >= 8
    assert [name for name, text in sources.items() if "gil_scoped_release" not in text] == ["bind_scip_blocks.hpp"]


def test_what_the_shell_adds_to_a_job_comes_before_what_the_core_gives():
    book, own = JobBook({"power": Job("math:pow", Late.GO_ON)}), {"math:pow": (2.0,)}
    workers, inline = Workers(wait=True), Inline(own)
    workers.own.update(own)
    book.submit("power", (10.0,), due_tick=1)
    requests = book.outgoing()
    workers.start(requests)
    inline.start(requests)
    taken = workers.collect(1), inline.take(inline.due(1))
    assert [[done.value for done in one] for one in taken] == [[1024.0], [1024.0]]
    workers.close()
