"""Kernel timer that fires at an absolute time (timerfd): a descriptor to wait on together with the ports.

Why: the timeout of `select` counts from the call, and the kernel may add its slack (50 us by default) to merge
wake-ups. A timerfd takes the instant itself and has no slack. Python has it only from 3.13 on.
"""

from __future__ import annotations

import ctypes
import os
import time

_ABSTIME = 1  # TFD_TIMER_ABSTIME
_FLAGS = os.O_CLOEXEC | os.O_NONBLOCK  # TFD_CLOEXEC, TFD_NONBLOCK


class _Itimerspec(ctypes.Structure):
    _fields_ = (("interval_s", ctypes.c_long), ("interval_ns", ctypes.c_long),
                ("value_s", ctypes.c_long), ("value_ns", ctypes.c_long))  # fmt: skip


class Alarm:
    """Timer whose descriptor is readable from the time of the last `set` on. Raises OSError if there is no timerfd."""

    def __init__(self) -> None:
        self._libc = ctypes.CDLL(None, use_errno=True)
        if not hasattr(self._libc, "timerfd_create"):
            raise OSError("this system has no timerfd")
        self._fd: int = self._libc.timerfd_create(time.CLOCK_MONOTONIC, _FLAGS)
        if self._fd < 0:
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))

    def fileno(self) -> int:
        """Descriptor for select."""
        return self._fd

    def set(self, at_ns: int) -> None:
        """Fire when time.monotonic_ns() reaches this."""
        seconds, nanoseconds = divmod(at_ns, 1_000_000_000)
        wanted = _Itimerspec(0, 0, seconds, nanoseconds)
        self._libc.timerfd_settime(self._fd, _ABSTIME, ctypes.byref(wanted), None)

    def close(self) -> None:
        """Close the descriptor."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1
