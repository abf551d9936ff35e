"""One open CAN bus: the common part of every kind of bus, and the complete virtual one."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import can

from onboard.drivers.budget import Budget
from onboard.drivers.can.errors import FULL, GONE, kind_of, words_of
from onboard.records import BusTrouble, Frame, PortState
from onboard.records.status import BUS_WORDS
from protocol.visible import visible

FORGET_FRAMES = 20_000  # 5 s of a full bus
_MOST_WORDS = 200  # of python-can's error text, which may have a traceback and bytes of the other side
_LOOK_EVERY = 64  # frames of a read between two looks at the clock
_UNTIL_GOOD = (BusTrouble.PASSIVE, BusTrouble.WARNING)  # states of the controller: they last until it is active again


class NoCanError(OSError):
    """This machine has no CAN at all: no waiting cures that."""


class CanBus:
    """One open bus.

    received, sent: frames since it was opened.
    state: as seen by the last call.
    errors: error frames by BusTrouble.
    error: one line about a present error; empty if all is well.
    clock_ns: clock that ends a read when its time is used up.

    Error frames of the controller count in `received`, are not returned, and set `state`: ERROR at bus-off, OPEN again
    at a restart or with the next data frame. An interface that is down is ERROR too; one that is gone is CLOSED.
    """

    FRAMES_PER_S, BURST_FRAMES = 8_000, 4_000  # per read: twice a full bus of 500 kbit/s; the rest waits in the kernel

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus
        self._budget = Budget(self.FRAMES_PER_S, self.BURST_FRAMES)
        self.clock_ns: Callable[[], int] = time.monotonic_ns
        self.received = self.sent = 0
        self.errors = [0] * len(BusTrouble)
        self.state = PortState.OPEN
        self._words = {"port": "", "controller": "", "queue": ""}

    @property
    def error(self) -> str:
        """Present error, for people."""
        return "; ".join(word for word in self._words.values() if word)

    @property
    def error_frames(self) -> int:
        """Number of error frames of all kinds."""
        return sum(self.errors)

    def fileno(self) -> int:
        """Descriptor for poll(); -1 for a virtual bus."""
        return -1

    def read(self, stamp_ns: int) -> list[Frame]:
        """Return the frames available within the budget, stamped `stamp_ns`; never wait."""
        frames: list[Frame] = []
        most, taken = self._budget.grant(stamp_ns), 0
        end_ns = self.clock_ns() + self._budget.work_ns
        while taken < most and (message := self._receive()) is not None:
            taken += 1
            if self._counted(message):
                frames.append(Frame(message.arbitration_id, bytes(message.data), self._stamp_ns(message, stamp_ns)))
            if taken % _LOOK_EVERY == 0 and self.clock_ns() > end_ns:
                break
        self._budget.spend(taken)
        return frames

    def forget(self) -> None:
        """Drop the frames received so far, FORGET_FRAMES at most: a busy bus never runs empty."""
        for _ in range(FORGET_FRAMES):
            if (message := self._receive()) is None:
                return
            self._counted(message)

    def read_upto(self, total: int, stamps_us: Sequence[int], limit_s: float) -> list[Frame]:
        """Lock-step: wait until `total` frames were received since the opening; `stamps_us`: one for each new frame.

        Returns fewer if the bus closes (see `state`). Raises TimeoutError with both counts after `limit_s`,
        ValueError if the number of stamps differs from that of new frames.
        """
        if len(stamps_us) != max(0, total - self.received):
            raise ValueError(f"{len(stamps_us)} stamps for frames {self.received} to {total}")
        frames: list[Frame] = []
        deadline = time.monotonic() + limit_s
        for stamp_us in stamps_us:
            while (message := self._receive()) is None:
                left = deadline - time.monotonic()
                if self.state is PortState.CLOSED:
                    return frames
                if left <= 0:
                    raise TimeoutError(f"CAN: {self.received} of {total} frames came within {limit_s:g} s")
                self._wait(left)
            if self._counted(message):
                frames.append(Frame(message.arbitration_id, bytes(message.data), stamp_us * 1000))
        return frames

    def write(self, frames: Sequence[Frame]) -> int:
        """Send the frames that the bus takes at once, in order; return the number of those not taken. Never waits.

        Frames not taken are dropped: the next tick has newer orders. After the first refusal the rest of the tick's
        frames is not tried.
        """
        if self.state is PortState.CLOSED:
            return len(frames)
        for done, frame in enumerate(frames):
            try:
                self._bus.send(message_of(frame), timeout=0)
            except (can.CanError, OSError) as error:
                self._refused(error)
                return len(frames) - done
            self.sent += 1
        if frames:
            self._words["queue"] = ""
        return 0

    def close(self) -> None:
        """Close the bus; no effect if it is closed."""
        self.state = PortState.CLOSED
        self._bus.shutdown()

    def _receive(self) -> can.Message | None:
        """Return the next available message, else None; exceptions of the bus set the state."""
        if self.state is PortState.CLOSED:
            return None
        try:
            return self._bus.recv(0)
        except (can.CanError, OSError) as error:
            if errno_of(error) not in FULL:  # EAGAIN: another read was faster
                self._failed(error)
            return None

    def _refused(self, error: Exception) -> None:
        number = errno_of(error)
        if number in FULL or number is None:  # None: python-can found the socket's buffer full
            self._words["queue"] = words_of(FULL[0], "")
        else:
            self._failed(error)

    def _failed(self, error: Exception) -> None:
        number = errno_of(error)
        self.state = PortState.CLOSED if number in GONE else PortState.ERROR
        self._words["port"] = words_of(number, visible(str(error).partition("\n")[0])[:_MOST_WORDS])

    def _wait(self, limit_s: float) -> None:
        """Wait until a frame may have come."""
        time.sleep(min(limit_s, 0.0005))

    def _stamp_ns(self, _message: can.Message, stamp_ns: int) -> int:
        return stamp_ns

    def _counted(self, message: can.Message) -> bool:
        """Count a message; return whether it is a data frame of the rover's kind."""
        self.received += 1
        if message.is_error_frame:
            detail = message.data[1] if len(message.data) > 1 else message.arbitration_id >> 16 & 0xFF
            self._book(kind_of(message.arbitration_id, detail))
        elif self.state is PortState.ERROR:
            self._well()
        elif self._words["controller"] and not self._holds:
            self._words["controller"] = ""
        return not (message.is_error_frame or message.is_remote_frame or message.is_extended_id)

    @property
    def _holds(self) -> bool:
        return self._words["controller"] in [BUS_WORDS[kind] for kind in _UNTIL_GOOD]

    def _book(self, kind: BusTrouble) -> None:
        self.errors[kind] += 1
        if kind in (BusTrouble.ACTIVE, BusTrouble.RESTARTED):
            self._well()
        elif kind is BusTrouble.BUS_OFF:
            self.state = PortState.ERROR
            self._words["controller"] = BUS_WORDS[kind]
        elif not self._holds or kind in _UNTIL_GOOD:
            self._words["controller"] = BUS_WORDS[kind]

    def _well(self) -> None:
        self.state = PortState.OPEN
        self._words["port"] = self._words["controller"] = ""


def message_of(frame: Frame) -> can.Message:
    """Convert a frame to python-can's type."""
    return can.Message(arbitration_id=frame.can_id, data=frame.data, is_extended_id=False)


def errno_of(error: Exception) -> int | None:
    """Error number of the system, or None."""
    if isinstance(error, can.CanError):
        return error.error_code
    return error.errno if isinstance(error, OSError) else None
