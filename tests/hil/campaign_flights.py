"""Flights that take no time, for tests of campaigns: rows made from a case's values alone."""

import os
import signal
import time
from pathlib import Path

from hil.campaign.plan import drawn

LOG = "EL_DORADO_TEST_FLIGHTS"  # folder: a file for each flight that began, and what a test puts there


def fly(plan, number):
    """A row like that of a flight, from the drawn values. Each flight that begins is noted."""
    values = drawn(plan, number)
    _note(number)
    lost = values.get("lidar.lost_ratio", 0.0)
    arrived = lost < 0.04
    return {
        **values, "case_number": number, "seed": plan.seed + number - 1,
        "outcome": "arrived" if arrived else "stopped",
        "reason": "" if arrived else f"goto: the scanner saw too little, {lost:.3f} lost",
        "reachable": True, "distance_to_goal_m": lost, "way_m": 10 + lost,
        "way_ratio": 1.0 + lost if arrived else None, "s_per_m": 20.0 + number if arrived else None,
        "max_error_sigmas": 1.0, "nees": 3.0, "max_position_error_m": 0.05, "sigma_m": 0.02, "position_error_m": 0.03,
        "bench_s": 200.0, "scans": 4, "contacts": 0, "faults_raised": 0, "max_tilt_deg": 4.0, "version": "test",
        "wall_s": time.perf_counter(), "peak_rss_mb": float(os.getpid()),
    }  # fmt: skip


def killed_once(plan, number):
    """Case 3 takes its process with it the first time."""
    first = number == 3 and not list(_folder().glob("3-*"))
    row = fly(plan, number)
    if first:
        os.kill(os.getpid(), signal.SIGKILL)
    return row


def always_killed(plan, number):
    """Case 2 takes its process with it every time."""
    if number == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return fly(plan, number)


def killed(plan, number):
    """Every case takes its process with it."""
    os.kill(os.getpid(), signal.SIGKILL)


def fails(plan, number):
    """Case 2 has a defect that its flight does not catch."""
    if number == 2:
        raise SystemExit("no such thing")
    return fly(plan, number)


def waits(plan, number):
    """Case 4 waits until its process is ended, unless the test has put a file `go` into the folder."""
    row = fly(plan, number)
    if number == 4 and not (_folder() / "go").exists():
        signal.pause()
    return row


def kills_its_worker(plan, number):
    """Case 3 takes its process and the worker that owns it with it the first time."""
    first = number == 3 and not list(_folder().glob("3-*"))
    row = fly(plan, number)
    if first:
        os.kill(os.getppid(), signal.SIGKILL)
        signal.pause()
    return row


def _folder():
    return Path(os.environ[LOG])


def _note(number):
    if LOG in os.environ:
        (_folder() / f"{number}-{os.getpid()}-{time.monotonic_ns()}").touch()
