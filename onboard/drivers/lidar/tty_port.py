"""Port of a scanner on a tty: USB, or a serial line with a search for the bit rate."""

from __future__ import annotations

import errno
import fcntl
import os
import termios
import time
import tty

from onboard.drivers.lidar.baud_search import BaudSearch
from onboard.drivers.lidar.byte_port import LidarPort
from onboard.records import PortState

SPEEDS = {19_200: termios.B19200, 38_400: termios.B38400, 57_600: termios.B57600, 115_200: termios.B115200,
          500_000: termios.B500000}  # fmt: skip
"""Bit rates of SCIP that every tty knows."""
_PSEUDO = range(136, 144)  # major numbers of pseudo terminals (Linux, devices.txt): TIOCEXCL on them outlives us
_WHY = {
    errno.ENOENT: "is not there: is the sensor plugged in? Try: ls /dev/ttyACM* /dev/serial/by-id",
    errno.ENXIO: "is not there: is the sensor plugged in? Try: ls /dev/ttyACM* /dev/serial/by-id",
    errno.EACCES: "may not be opened: put this user into its group (sudo usermod -aG dialout $USER) and log in again",
    errno.EBUSY: "is in use by another program. Try: fuser -v",
    errno.EWOULDBLOCK: "is in use by another program. Try: fuser -v",
    errno.ENOTTY: "is no tty: the address names the wrong file",
    errno.EISDIR: "is a folder: the address names the wrong file",
}


class TtyPort(LidarPort):
    """Port on a tty. rate_bps: None for USB; on a serial line the sensor is searched, then set to this rate."""

    def __init__(self, address: str, path: str, rate_bps: int | None = None) -> None:
        super().__init__(address)
        self._path = path
        self._rate_bps = rate_bps
        self._search: BaudSearch | None = None

    def connect(self) -> None:
        """Make one attempt; on a serial line it goes on until the sensor has answered at a rate, or at none."""
        if self._fd >= 0:
            return
        try:
            self._fd = os.open(self._path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)  # among flock users; TIOCEXCL excludes all but root
            if os.major(os.fstat(self._fd).st_rdev) not in _PSEUDO:
                fcntl.ioctl(self._fd, termios.TIOCEXCL)
            tty.setraw(self._fd)
        except (OSError, termios.error) as error:
            number = int(error.args[0])
            self._fail(f"{self._path} {_WHY.get(number, f'cannot be opened: {os.strerror(number)}')}")
            return
        if self._rate_bps is None:
            self._opened()
            return
        self.state = PortState.CLOSED
        self._search = BaudSearch(self._rate_bps, tuple(SPEEDS))

    def _advance(self) -> None:
        if self._search is not None:
            self._look(self._search)
        super()._advance()

    def _look(self, search: BaudSearch) -> None:
        try:
            data = os.read(self._fd, 65536)
        except (BlockingIOError, InterruptedError):
            data = b""
        except OSError as error:
            self._fail(f"{self._path} is gone: {error.strerror}")
            return
        move = search.step(data, time.monotonic_ns())
        if move.rate_bps is not None:
            settings = termios.tcgetattr(self._fd)
            settings[4] = settings[5] = SPEEDS[move.rate_bps]
            termios.tcsetattr(self._fd, termios.TCSANOW, settings)
            termios.tcflush(self._fd, termios.TCIFLUSH)
        if move.data:
            os.write(self._fd, move.data)
        if search.done:
            self._search = None
            if search.found:
                self._opened()
            else:
                self._fail(f"no sensor answers on {self._path} at any bit rate: is it powered, is it a Hokuyo?")

    def _drop(self, state: PortState) -> None:
        self._search = None
        super()._drop(state)
