"""STOP under each flood, on the wall clock, with real sockets. The times are reported by `python -m tests.floods`."""

import pytest

from tests.floods.__main__ import line
from tests.floods.besieged import Siege

MEMORY_MB = 20.0
NAMED = {"scanner": {"LIDAR_GARBLED"}, "bus": {"CAN_BABBLE", "CAN_BUS_OFF"}}  # one of them at least


@pytest.mark.campaign
@pytest.mark.parametrize("kind", ["scanner", "bus", "datagrams"])
def test_stop_is_confirmed_while_something_floods_and_memory_is_flat(tmp_path, kind):
    with Siege(tmp_path) as siege:
        row = siege.besiege(kind, tries=3)  # raises where a stop is not confirmed
    print(line(row))
    assert all(each.drove for each in row.tries)
    assert row.rss_after_mb - row.rss_before_mb < MEMORY_MB
    assert row.refused > 1000 if kind == "datagrams" else NAMED[kind] & {*row.faults}
