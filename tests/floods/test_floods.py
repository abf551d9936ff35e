"""STOP under each flood, on the wall clock, with real sockets. The times are reported by `python -m tests.floods`."""

import subprocess
import sys

import pytest

from tests.floods.__main__ import line
from tests.floods.besieged import ROOT, Siege

MEMORY_MB = 20.0
NAMED = {"scanner": {"LIDAR_GARBLED"}, "bus": {"CAN_BABBLE", "CAN_BUS_OFF"}}  # one of them at least


@pytest.mark.campaign
@pytest.mark.parametrize("kind", ["scanner", "bus", "datagrams"])
def test_stop_is_confirmed_while_something_floods_memory_is_flat_and_the_record_replays(tmp_path, kind):
    with Siege(tmp_path) as siege:
        row = siege.besiege(kind, tries=3)  # raises where a stop is not confirmed
    print(line(row))
    words = [sys.executable, "-m", "onboard", "replay", str(tmp_path / "onboard.mcap")]
    replay = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert replay.stdout.startswith("identical: "), replay.stdout + replay.stderr
    assert all(each.drove for each in row.tries)
    assert row.rss_after_mb - row.rss_before_mb < MEMORY_MB
    assert row.refused > 1000 if kind == "datagrams" else NAMED[kind] & {*row.faults}
