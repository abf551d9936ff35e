"""Where two runs differ first."""

from hypothesis import given
from hypothesis import strategies as st

from hil.world.trace import Trace, first_difference


def trace(sums):
    made = Trace(("bus", "plant"))
    for row in sums:
        made.add(row)
    return made


def test_equal_runs_do_not_differ_and_neither_does_one_that_is_only_longer():
    assert first_difference(trace([(1, 1), (2, 2)]), trace([(1, 1), (2, 2)])) is None
    assert first_difference(trace([(1, 1)]), trace([(1, 1), (2, 2)])) is None
    assert first_difference(trace([]), trace([(1, 1)])) is None


@given(st.integers(1, 200), st.integers(1, 200), st.sampled_from(["bus", "plant"]))
def test_the_first_tick_that_differs_is_found_with_its_channel(ticks, at, channel):
    at = min(at, ticks)
    plain = [(k, 1000 + k) for k in range(1, ticks + 1)]
    other = [(b + 5000, p) if channel == "bus" else (b, p + 5000) for b, p in plain]
    found = first_difference(trace(plain), trace(plain[: at - 1] + other[at - 1 :]))
    assert found == (at / 100, channel)
