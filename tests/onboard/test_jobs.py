"""A job's result is taken at exactly its tick; what is no longer wanted is dropped."""

import subprocess
import sys
from pkgutil import resolve_name

import pytest

from onboard.core.jobs import JOBS, Job, JobBook, Late
from onboard.drivers.workers import Inline, Workers
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
    with pytest.raises(ModuleNotFoundError):
        workers.collect(1)
    workers.close()


def test_what_is_loaded_early_is_loaded_in_the_worker_and_before_its_result():
    script = (
        "import sys; from onboard.drivers.workers import Workers; w = Workers(wait=True); "
        "assert 'fractions' not in sys.modules; w.preload(['fractions:Fraction']).result(); w.close(); "
        "assert 'fractions' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


def test_the_flight_program_starts_without_the_libraries_that_only_jobs_and_the_filter_use():
    script = "import sys, onboard.app; print(*{name.partition('.')[0] for name in sys.modules})"
    loaded = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True).stdout.split()
    assert not {"scipy", "filterpy", "small_gicp"} & set(loaded)
