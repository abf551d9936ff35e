"""End-to-end protection of CAN frames: alive counter and CRC-8 for sent frames, checks and counts for received ones.

    byte    0 .. 5        6                         7
          [ signals ][ counter | signals ][ CRC-8 over id and bytes 0 to 6 ]
                       bits 7-4   3-0

A frame that fails a check is dropped and counted; none of its values reach the caller.

Two nodes that send under one id interleave two counters. Each frame then follows the last frame but one:

    5 12 6 13 7 14      every frame but the first two follows the last but one

Such a frame is accepted and counted as `twin`, not as lost, if the frame before it was out of order too. Loss alone
does not produce this pattern: in three consecutive frames, the middle ones of two gaps would have to be 14 apart.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from protocol import WireError
from protocol.can.crc import crc8 as crc8
from protocol.can.crc import sound
from protocol.generated.can_codec import TABLE

LATE_CYCLES = 2.5  # an interval of more cycle times than this is counted late
_NEVER = -1

FrameLike = tuple[int, bytes, int]  # can id, data, stamp in ns: onboard.records.Frame is one


class Counts(NamedTuple):
    """Frame counts of one CAN id.

    accepted: good frames, including `late` and `twin`.
    late: accepted, more than LATE_CYCLES cycle times after the frame before.
    lost: frames missing by the alive counter.
    repeated: dropped, same counter as the frame before.
    crc: dropped, wrong checksum.
    out_of_range: dropped, a signal is outside its range.
    length: dropped, not 8 bytes long.
    twin: accepted, follows the last frame but one.
    """

    accepted: int = 0
    late: int = 0
    lost: int = 0
    repeated: int = 0
    crc: int = 0
    out_of_range: int = 0
    length: int = 0
    twin: int = 0

    @property
    def bad(self) -> int:
        """Number of frames that were received and dropped."""
        return self.repeated + self.crc + self.out_of_range + self.length


class Sender:
    """Encoder of one node's frames, with their alive counters."""

    def __init__(self) -> None:
        self._next: dict[int, int] = {}

    def encode(self, can_id: int, *values: Any) -> bytes:
        """Encode the next frame of this id. Raises KeyError for an id outside the DBC, ValueError out of range."""
        counter = self._next.get(can_id, 0)
        self._next[can_id] = (counter + 1) & 15
        data: bytes = TABLE[can_id].encode(*values, counter)
        return data


class _Watch:
    """Counters and last frame of one id."""

    __slots__ = (
        "accepted", "counter", "crc", "decode", "late", "length", "limit_ns", "lost", "out_of_range", "repeated",
        "seed", "stamp_ns", "twin", "twin_accepted", "twin_counter",
    )  # fmt: skip

    def __init__(self, can_id: int) -> None:
        row = TABLE[can_id]
        self.seed, self.decode = row.seed, row.decode
        self.limit_ns = 0 if row.event else int(LATE_CYCLES * row.cycle_ns)
        self.accepted = self.late = self.lost = self.repeated = self.crc = self.out_of_range = self.length = 0
        self.twin = 0
        self.arm()

    def arm(self) -> None:
        """Treat the next frame as the first: no expected counter, no interval check."""
        self.counter = self.twin_counter = self.twin_accepted = self.stamp_ns = _NEVER


class Guard:
    """Check of all received frames of a bus, for one receiver, with counts.

    bad: frames of known ids that were dropped.
    lost: frames missing by the alive counters.
    unknown: frames whose id is not in the DBC.
    twins: frames that another node than the last sender seems to have sent.
    gaps: jumps of a counter, each counted once whatever its size.
    """

    def __init__(self) -> None:
        self._watches = {can_id: _Watch(can_id) for can_id in TABLE}
        self.unknown = self.bad = self.lost = self.gaps = self.twins = 0

    def rearm(self) -> None:
        """Restart counter and interval checks of all ids after an interruption of the bus. The counts stay."""
        for watch in self._watches.values():
            watch.arm()

    def accept(self, frame: FrameLike) -> bool:
        """Check and count a frame; return True if it is good."""
        return self.receive(frame) is not None

    def receive(self, frame: FrameLike) -> Any | None:
        """Check and count a frame; return its decoded values (a record of can_codec), None for a bad frame."""
        can_id, data, stamp_ns = frame
        watch = self._watches.get(can_id)
        if watch is None:
            self.unknown += 1
            return None
        if len(data) != 8:
            watch.length += 1
            self.bad += 1
            return None
        if not sound(data, watch.seed):
            watch.crc += 1
            self.bad += 1
            return None
        counter = data[6] >> 4
        step = (counter - watch.counter) & 15
        if step != 1 and watch.counter >= 0 and not self._in_order(watch, counter, step):
            return None
        watch.counter = counter
        try:
            values = watch.decode(data)
        except WireError:
            watch.out_of_range += 1
            self.bad += 1
            return None
        if watch.limit_ns and watch.stamp_ns >= 0 and stamp_ns - watch.stamp_ns > watch.limit_ns:
            watch.late += 1
        watch.stamp_ns = stamp_ns
        watch.accepted += 1
        return values

    def _in_order(self, watch: _Watch, counter: int, step: int) -> bool:
        """Count a frame whose counter is not the next one; return True if the frame is good anyway."""
        at_once = watch.accepted == watch.twin_accepted  # the frame before was out of order as well
        if at_once and (counter - watch.twin_counter) & 15 == 1:
            watch.twin += 1
            self.twins += 1
        elif step == 0:
            watch.twin_counter, watch.twin_accepted = counter, watch.accepted
            watch.repeated += 1
            self.bad += 1
            return False
        else:
            watch.lost += step - 1
            self.lost += step - 1
            self.gaps += 1
        watch.twin_counter, watch.twin_accepted = watch.counter, watch.accepted + 1
        return True

    def counts(self, can_id: int) -> Counts:
        """Return the counts of one id of the DBC."""
        w = self._watches[can_id]
        return Counts(w.accepted, w.late, w.lost, w.repeated, w.crc, w.out_of_range, w.length, w.twin)

    def total(self) -> Counts:
        """Return the sums over all ids. This loops over all ids: do not call it every tick."""
        return Counts(*map(sum, zip(*(self.counts(can_id) for can_id in self._watches), strict=True)))


class Every:
    """Release times of a cyclic frame, on the grid first_ns + k * period_ns."""

    __slots__ = ("_due_ns", "_period_ns")

    def __init__(self, period_ns: int, first_ns: int = 0) -> None:
        self._period_ns, self._due_ns = period_ns, first_ns

    def due(self, now_ns: int) -> bool:
        """True if the frame is due. After a missed release, or after `now`, the grid restarts at this time."""
        if now_ns < self._due_ns:
            return False
        self._due_ns += self._period_ns
        if self._due_ns <= now_ns:
            self._due_ns = now_ns + self._period_ns
        return True

    def now(self) -> None:
        """Make the next call of `due` return True."""
        self._due_ns = -self._period_ns
