"""Ctrl-C ends a campaign in order, a second one at once."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.missions.parallel import fly_all

pytestmark = pytest.mark.tool

ENDLESS = """
import signal, sys
from types import SimpleNamespace
from tests.missions.parallel import fly_all

signal.signal(signal.SIGINT, signal.default_int_handler)  # who runs the tests in the background may ignore it

def fly(run, seed):
    print("begun", flush=True)
    signal.pause()

try:
    list(fly_all(fly, [SimpleNamespace(seeds=(1, 2, 3))], 1))
except KeyboardInterrupt:
    sys.exit(130)
"""


def test_a_second_ctrl_c_ends_a_mission_that_would_never_end():
    with subprocess.Popen(
        [sys.executable, "-c", ENDLESS],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[2],
    ) as campaign:
        try:
            assert campaign.stdout.readline() == "begun\n"
            campaign.send_signal(signal.SIGINT)
            assert campaign.stderr.readline() == "finishing the missions in flight; Ctrl-C again ends at once\n"
            campaign.send_signal(signal.SIGINT)
            rest, said = campaign.communicate(timeout=60)
        finally:
            campaign.kill()
    assert (campaign.returncode, rest, said) == (130, "", "")


def process(run, seed):
    return os.getpid(), seed


def test_a_worker_is_renewed_after_as_many_missions_as_asked():
    found = list(fly_all(process, [SimpleNamespace(seeds=(1, 2, 3))], 1, 1))
    assert sorted(seed for _, seed in found) == [1, 2, 3]
    assert len({pid for pid, _ in found}) == 3 and os.getpid() not in {pid for pid, _ in found}
