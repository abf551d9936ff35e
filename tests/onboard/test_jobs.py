"""A job's result is taken at exactly its tick; what is no longer wanted is dropped."""

from onboard.core.jobs import JobBook
from onboard.drivers.workers import Workers
from onboard.records import JobDone


def test_in_lock_step_a_result_comes_at_its_due_tick_and_no_earlier():
    book, workers = JobBook(), Workers(wait=True)
    book.submit("square", lambda x: x * x, (7,), due_tick=5)
    workers.start(book.outgoing())
    taken = {tick: book.take(workers.collect(tick), tick) for tick in range(1, 8)}
    workers.close()
    assert taken[5] == {"square": 49}
    assert not any(result for tick, result in taken.items() if tick != 5)
    assert book.late_ticks == 0
    assert book.running == ()


def test_a_job_is_overdue_from_the_tick_after_its_own_until_it_is_taken_or_forgotten():
    book = JobBook()
    book.submit("plan", max, (1, 2), 110)
    (request,) = book.outgoing()
    assert [book.overdue_ticks(tick) for tick in (109, 110, 111, 140)] == [0, 0, 1, 30]
    book.take((JobDone(request.job_id, 2),), 140)
    assert book.overdue_ticks(141) == 0
    book.submit("plan", max, (1, 2), 110)
    book.forget({"plan"})
    assert book.overdue_ticks(150) == 0


def test_a_late_result_is_counted_in_ticks():
    book = JobBook()
    book.submit("plan", lambda: None, (), due_tick=10)
    (request,) = book.outgoing()
    assert book.take((JobDone(request.job_id, "path"),), 13) == {"plan": "path"}
    assert book.late_ticks == 3


def test_a_forgotten_job_gives_nothing_and_its_name_is_free_again():
    book = JobBook()
    book.submit("plan", lambda: None, (), due_tick=10)
    (first,) = book.outgoing()
    book.forget({"plan"})
    book.submit("plan", lambda: None, (), due_tick=20)
    (second,) = book.outgoing()
    assert book.take((JobDone(first.job_id, "old"),), 10) == {}
    assert book.take((JobDone(second.job_id, "new"),), 20) == {"plan": "new"}
