"""STOP under each flood, on the wall clock, with real sockets. `python -m tests.floods` reports the times.

Floods of carrier A under which a new station does not always get through are left out (docs/real-time.md).
"""

import subprocess
import sys
from contextlib import ExitStack

import pytest

from tests.floods.__main__ import line
from tests.floods.besieged import ROOT, Siege

MEMORY_MB = 20.0
NAMED = {
    "scanner": {"LIDAR_GARBLED"},
    "bus": {"CAN_BABBLE", "CAN_BUS_OFF"},
    "disk": {"DISK_FULL"},
    "quota": {"DISK_FULL"},
}  # one of them at least
REFUSED = {"datagrams": 1000, "hellos": 1000, "huge": 1000}


@pytest.mark.campaign
@pytest.mark.parametrize("kind", ["scanner", "bus", "datagrams", "hellos", "huge", "disk", "quota"])
def test_stop_is_confirmed_while_something_floods_memory_is_flat_and_the_record_replays(tmp_path, kind):
    record = tmp_path / "onboard.mcap"
    with ExitStack() as stack:
        try:
            siege = stack.enter_context(Siege(tmp_path, kind))
        except PermissionError as error:
            pytest.skip(str(error))
        row = siege.besiege(tries=3)  # raises if a stop is not confirmed
        siege.keep(record)
    print(line(row))
    words = [sys.executable, "-m", "onboard", "replay", str(record)]
    replay = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert replay.stdout.startswith("identical: "), replay.stdout + replay.stderr
    assert all(each.drove for each in row.tries)
    assert row.rss_after_mb - row.rss_before_mb < MEMORY_MB
    assert row.refused > REFUSED.get(kind, -1)
    assert kind not in NAMED or NAMED[kind] & {*row.faults}
