"""Bare wake-up loop as a process: `python -m onboard.bringup.jitter.bare INTERVAL_NS COUNT PRIORITY` prints the delays.

It does the same as cyclictest, for machines without it: one thread, clock_nanosleep to absolute times, in C++, with the
least slack that the kernel allows. So it is a strict reference: no program that does more can wake earlier.
"""

from __future__ import annotations

import os
import sys

import numpy as np

from onboard.native import _wakes

if __name__ == "__main__":
    interval_ns, count, priority = map(int, sys.argv[1:])
    if priority:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
    late_ns = np.zeros(count, np.int64)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    _wakes.wake_into(interval_ns, late_ns)
    sys.stdout.write(" ".join(map(str, late_ns.tolist())) + "\n")
