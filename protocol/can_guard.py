"""End-to-end protection of CAN frames: alive counter and CRC-8 of what is sent, checks and counts of what is received.

    byte    0 .. 5        6                         7
          [ signals ][ counter | signals ][ CRC-8 over id and bytes 0 to 6 ]
                       bits 7-4   3-0

A frame that fails a check is dropped and counted; nothing of it reaches whoever asked.

Two nodes with one id interleave two counters: a frame that follows not the last one but the one before it, as

    5 12 6 13 7 14      every frame but the first two follows the last but one

is accepted and counted as `twin`, not as lost, if the one before it was out of order too. Plain loss does not look so:
of three frames in a row the middle ones of two gaps would have to be 14 apart.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from protocol import WireError
from protocol.can_codec import TABLE
from protocol.can_crc import crc8 as crc8
from protocol.can_crc import sound

LATE_CYCLES = 2.5  # an interval of more cycle times than this is counted late
_NEVER = -1

FrameLike = tuple[int, bytes, int]  # can id, data, stamp in ns: onboard.records.Frame is one


class Counts(NamedTuple):
    """What the receiver saw of one id: `accepted`, among them `late` and `twin`; `lost` never came."""

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
        """Frames that came and were dropped."""
        return self.repeated + self.crc + self.out_of_range + self.length


class Sender:
    """The alive counters of what one node sends."""

    def __init__(self) -> None:
        self._next: dict[int, int] = {}

    def encode(self, can_id: int, *values: Any) -> bytes:
        """The next frame of this id. Raises KeyError for an id that is not in the DBC, ValueError out of range."""
        counter = self._next.get(can_id, 0)
        self._next[can_id] = (counter + 1) & 15
        data: bytes = TABLE[can_id].encode(*values, counter)
        return data


class _Watch:
    """Books of one id."""

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
        """The next frame is the first: no counter to follow, no interval to keep."""
        self.counter = self.twin_counter = self.twin_accepted = self.stamp_ns = _NEVER


class Guard:
    """Checks every frame of the bus for one receiver and keeps the counts.

    `bad`: frames of known ids that were dropped; `lost`: those that never came; `unknown`: ids that are not in the DBC;
    `twins`: those that another node than the last sender seems to have sent; `gaps`: jumps of a counter, however far.
    """

    def __init__(self) -> None:
        self._watches = {can_id: _Watch(can_id) for can_id in TABLE}
        self.unknown = self.bad = self.lost = self.gaps = self.twins = 0

    def rearm(self) -> None:
        """After a break of the bus: what came before says nothing of what comes next. The counts stay."""
        for watch in self._watches.values():
            watch.arm()

    def accept(self, frame: FrameLike) -> bool:
        """Whether the frame is good; counted either way."""
        return self.receive(frame) is not None

    def receive(self, frame: FrameLike) -> Any | None:
        """The decoded values of a good frame (a record of can_codec), None for a bad one; counted either way."""
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
        """Books a counter that is not the next one; whether its frame is good all the same."""
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
        """The counts of one id of the DBC."""
        w = self._watches[can_id]
        return Counts(w.accepted, w.late, w.lost, w.repeated, w.crc, w.out_of_range, w.length, w.twin)

    def total(self) -> Counts:
        """The sums over all ids; walks them, so not for each tick."""
        return Counts(*map(sum, zip(*(self.counts(can_id) for can_id in self._watches), strict=True)))


class Every:
    """The releases of a cyclic frame, on the grid first_ns + k * period_ns."""

    __slots__ = ("_due_ns", "_period_ns")

    def __init__(self, period_ns: int, first_ns: int = 0) -> None:
        self._period_ns, self._due_ns = period_ns, first_ns

    def due(self, now_ns: int) -> bool:
        """Whether it is time. After a missed release or `now` the grid begins again at this one."""
        if now_ns < self._due_ns:
            return False
        self._due_ns += self._period_ns
        if self._due_ns <= now_ns:
            self._due_ns = now_ns + self._period_ns
        return True

    def now(self) -> None:
        """The next question is answered with yes."""
        self._due_ns = -self._period_ns
