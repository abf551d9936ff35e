"""Rate groups run at their ticks, and what is counted of them is what was measured."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.config import Config
from onboard.core.rover import Rover
from onboard.core.schedule import GROUPS, Group, Scheduler
from onboard.core.tick import tick
from onboard.core.tick_timing import BINS, Pace, lateness_bin, quantile_us
from onboard.drivers.platform.stopwatch import NullStopwatch, Stopwatch
from onboard.records import Health, Inputs, Timing
from protocol.conventions import TICK_NS
from tests.onboard.core_bench import CoreBench

MS = 1_000_000


def measured(**groups):
    """group_ns with these groups' milliseconds."""
    return tuple(round(groups.get(row.name, 0) * MS) for row in GROUPS)


def test_the_table_has_each_group_once_in_the_order_of_the_tick():
    assert [row.group for row in GROUPS] == list(Group)
    assert all(0 <= row.offset_ticks < row.every_ticks for row in GROUPS)


def test_the_budgets_of_the_busiest_tick_fit_in_it():
    """Offsets count: housekeeping is never in a tick of the wheels."""
    busiest = max(
        sum(row.budget_ns for row in GROUPS if (tick - row.offset_ticks) % row.every_ticks == 0) for tick in range(100)
    )
    assert busiest <= TICK_NS


@pytest.mark.parametrize("row", GROUPS, ids=lambda row: row.name)
def test_a_group_runs_at_its_rate_and_offset_while_no_tick_is_left_out(row):
    scheduler = Scheduler()
    ran = [tick for tick in range(1, 301) if scheduler.due(row.group, tick)]
    assert ran == [tick for tick in range(1, 301) if (tick - row.offset_ticks) % row.every_ticks == 0]
    assert scheduler.slips[row.group] == 0


@given(st.lists(st.integers(1, 120), min_size=1, max_size=60))
@settings(deadline=None, derandomize=True)
def test_after_ticks_left_out_a_group_runs_once_at_the_next_and_that_is_a_slip(steps):
    row, scheduler, before, slips = GROUPS[Group.HOUSEKEEPING], Scheduler(), 0, 0
    for step in steps:
        tick_now = before + step
        passed = [t for t in range(before + 1, tick_now + 1) if t % row.every_ticks == row.offset_ticks]
        assert scheduler.due(Group.HOUSEKEEPING, tick_now) == bool(passed)
        slips += bool(passed) and passed[-1] != tick_now
        before = tick_now
    assert scheduler.slips[Group.HOUSEKEEPING] == slips


def test_a_slip_is_charged_to_what_took_longest_and_to_the_job_beside_it():
    pace = Pace()
    pace.update(Timing(2 * MS, measured()), Health(), ())
    pace.update(Timing(0, measured(record=15, read=1)), Health(16 * MS, 1), ("plan",))
    pace.update(Timing(13 * MS, measured()), Health(0, 1), ("plan",))
    pace.update(Timing(0, measured(executive=2)), Health(2 * MS, 3), ())
    assert dict(pace.slips) == {("record", "plan"): 1, ("wake-up", ""): 2}
    assert pace.slip_worst_ns == {("record", "plan"): 18 * MS, ("wake-up", ""): 15 * MS}
    assert pace.slipped_ticks == 3


def test_the_worst_of_each_group_is_kept_and_runs_over_the_budget_are_counted():
    pace = Pace()
    for wheels in (0.2, 0.7, 0.4, 0.9):
        pace.update(Timing(0, measured(wheels=wheels)), Health(), ())
    assert pace.worst_ns[Group.WHEELS] == 0.9 * MS
    assert pace.over_budget == [2 if row.group is Group.WHEELS else 0 for row in GROUPS]


def test_lateness_is_counted_by_powers_of_two_and_a_share_is_read_from_above():
    assert [lateness_bin(us * 1000) for us in (0, 1, 2, 3, 4, 1000, 10**6)] == [0, 1, 2, 2, 3, 10, BINS - 1]
    pace = Pace()
    for late_us in [50] * 98 + [900, 3000]:
        pace.update(Timing(late_us * 1000, measured()), Health(), ())
    assert sum(pace.lateness) == 100
    assert [quantile_us(pace.lateness, share) for share in (0.5, 0.98, 0.99, 1.0)] == [64, 64, 1024, 4096]
    assert quantile_us([0] * BINS, 0.5) == 0


def test_the_recent_worst_begins_anew_when_it_was_told():
    pace = Pace()
    pace.update(Timing(3 * MS, measured()), Health(7 * MS), ())
    assert (pace.recent_late_ns, pace.recent_tick_ns) == (3 * MS, 7 * MS)
    pace.rest()
    pace.update(Timing(1 * MS, measured()), Health(2 * MS), ())
    assert (pace.recent_late_ns, pace.recent_tick_ns) == (1 * MS, 2 * MS)
    assert (pace.late_worst_ns, pace.tick_worst_ns) == (3 * MS, 7 * MS)


def test_the_stopwatch_gives_each_group_its_time_and_all_of_it_to_some_group():
    times = iter([100, 130, 150, 190, 200])
    watch = Stopwatch(lambda: next(times))
    assert watch.timing(5, ()) == Timing(5, (), ())
    watch.begin()
    watch.mark(Group.RECEIVE)
    watch.mark(Group.WHEELS)
    watch.mark(Group.RECORD)
    watch.end()
    assert {group.name: ns for group, ns in zip(Group, watch.group_ns) if ns} == {
        "READ": 30,
        "RECEIVE": 20,
        "WHEELS": 40,
        "RECORD": 10,
    }
    assert watch.tick_ns == 100


def test_in_lock_step_nothing_is_measured():
    watch = NullStopwatch(lambda: pytest.fail("no clock may be read"))
    watch.begin()
    watch.mark(Group.SEND)
    watch.end()
    assert watch.timing(3, (4,)) == Timing()


def test_a_tick_marks_its_groups_in_the_order_of_the_table():
    marked = []
    tick(Rover(Config(), None), Inputs(1, TICK_NS), marked.append)
    assert marked == [group for group in Group if Group.READ < group < Group.WRITE]


def test_what_was_measured_changes_no_order_of_the_rover_and_is_told_to_the_ground():
    plain, slow = CoreBench(), CoreBench()
    frames = [(plain.step().can_frames, step_measured(slow).can_frames) for _ in range(120)]
    assert all(a == b for a, b in frames)
    assert slow.rover.pace.slipped_ticks == 119 and sum(slow.rover.pace.slips.values()) == 119
    assert plain.rover.pace.slipped_ticks == 0


def step_measured(rover):
    """A tick whose predecessor took 12 ms."""
    rover.health = Health(12 * MS, rover.tick)
    rover.timing = Timing(1 * MS, measured(executive=12))
    return rover.step()
