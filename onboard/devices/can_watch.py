"""Monitor of the bus traffic: an id that babbles, too many bad frames, a node present twice or with another DBC.

Leaky buckets judge the rates. Each event adds one; the level falls at a steady rate. A bucket is over its limit from
the time when more than `size` is in it until it is empty. So a rate above the leak is detected after size / (rate -
leak), and a single burst up to `size` is ignored. The level is limited to twice the size: after the events end, the
bucket is empty within 2 size / leak.

    babble      frames of one id                      leak twice its highest rate, at least 50/s      size 20
    overloaded  frames of all ids                     leak 80 % of the bus                            size 150
    corrupt     bad, jumped, from the future          leak 20/s, over for 0.1 s                       size 5
    rotten      bad, jumped                           leak 200/s                                      size 20
    twins       frames in another one's order         leak 1/s                                        size 3

The 0.1 s give time to detect babble first if an id babbles bad frames.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from protocol.can.guard import FrameLike, Guard
from protocol.generated.can_codec import DBC_VERSION, TABLE

NS = 1_000_000_000
FASTEST_HZ = {0x1C0: 200.0}  # TILT_FEEDBACK while the axis sweeps; all others keep the cycle time of the DBC
SLOWEST_LEAK_HZ, BABBLE_SIZE = 50.0, 20
FRAMES_PER_S = 500_000 / 135  # on a full bus
LOAD_RATIO, LOAD_SIZE = 0.8, 150
TWIN_LEAK_HZ, TWIN_SIZE = 1.0, 3
CORRUPT_FOR_NS = 100_000_000


class Bucket:
    """One leaky bucket."""

    __slots__ = ("_leak_hz", "_over", "_size", "_then_ns", "level")

    def __init__(self, leak_hz: float, size: int, now_ns: int = 0) -> None:
        self._leak_hz, self._size = leak_hz, size
        self.level, self._then_ns, self._over = 0.0, now_ns, False

    def add(self, events: int, now_ns: int) -> bool:
        """Add events, then leak for the time since the last call, so that a late call does not look like a burst."""
        leaked = (now_ns - self._then_ns) * self._leak_hz / NS
        self._then_ns = now_ns
        self.level = min(max(0.0, self.level + events - leaked), 2.0 * self._size)
        self._over = self.level > self._size or (self._over and self.level > 0.0)
        return self._over


class CanWatch:
    """Traffic monitor; call `rates`, then `checks`, once a tick.

    babbling: ids to ignore.
    overloaded, corrupt, rotten: rates over their limits.
    twins: names of nodes that are present twice.
    foreign: nodes with another DBC, name -> version.
    """

    def __init__(self) -> None:
        self.babbling: frozenset[int] = frozenset()
        self.overloaded = self.corrupt = self.rotten = False
        self.twins: tuple[str, ...] = ()
        self.foreign: dict[str, int] = {}
        self._levels: dict[int, float] = {}
        self._then_ns = 0
        self._load = Bucket(LOAD_RATIO * FRAMES_PER_S, LOAD_SIZE)
        self._few, self._many = Bucket(20.0, 5), Bucket(200.0, 20)
        self._twins: dict[str, Bucket] = {}
        self._twin_counts: Counter[str] = Counter()
        self._bad = self._twin_total = self._copies = 0
        self._clean_ns = self._from_future = 0

    def rates(self, frames: Sequence[FrameLike], now_ns: int) -> None:
        """Count all frames of the tick, known or not, before they are used."""
        counts: dict[int, int] = {}
        for can_id, _, _ in frames:
            counts[can_id] = counts.get(can_id, 0) + 1
        self.overloaded = self._load.add(len(frames), now_ns)
        spent_s, self._then_ns = (now_ns - self._then_ns) / NS, now_ns
        levels: dict[int, float] = {}
        babbling = []
        for can_id in self._levels.keys() | counts.keys():
            leaked = spent_s * LEAKS_HZ.get(can_id, SLOWEST_LEAK_HZ)
            level = self._levels.get(can_id, 0.0) + counts.get(can_id, 0) - leaked
            if level > 0.0:
                levels[can_id] = min(level, 2.0 * BABBLE_SIZE)
                if level > BABBLE_SIZE or can_id in self.babbling:
                    babbling.append(can_id)
        self._levels, self.babbling = levels, frozenset(babbling)

    def checks(self, guard: Guard, from_future: int, now_ns: int) -> None:
        """Judge the guard's counts; from_future: frames stamped later than now, since the start."""
        bad = guard.bad + guard.gaps
        if not self._few.add(bad + from_future - self._bad - self._from_future, now_ns):
            self._clean_ns = now_ns
        self.corrupt = now_ns - self._clean_ns >= CORRUPT_FOR_NS
        self.rotten = self._many.add(bad - self._bad, now_ns)
        self._bad, self._from_future = bad, from_future
        if guard.twins + self._copies != self._twin_total or self._twins:
            self._twin_total = guard.twins + self._copies
            self._find_twins(guard, now_ns)

    def copy_of_us(self) -> None:
        """Count a good frame that only this computer may send: a second computer is on the bus."""
        self._copies += 1

    def heartbeat(self, node: str, dbc_version: int) -> None:
        """Record the DBC version that a node reports."""
        if dbc_version == DBC_VERSION:
            self.foreign.pop(node, None)
        else:
            self.foreign[node] = dbc_version

    def digest_items(self) -> tuple[float | int, ...]:
        """Values of this state that go into the state digest."""
        return (
            *sorted(self.babbling),
            int(self.overloaded),
            self._few.level,
            self._load.level,
            len(self.twins),
            *self.foreign.values(),
        )

    def _find_twins(self, guard: Guard, now_ns: int) -> None:
        counts: Counter[str] = Counter({"COMPUTER": self._copies})
        for can_id, row in TABLE.items():
            counts[row.sender] += guard.counts(can_id).twin
        fresh = counts - self._twin_counts
        for node in fresh:
            self._twins.setdefault(node, Bucket(TWIN_LEAK_HZ, TWIN_SIZE, now_ns))
        self.twins = tuple(sorted(node for node, bucket in self._twins.items() if bucket.add(fresh[node], now_ns)))
        self._twins = {node: bucket for node, bucket in self._twins.items() if bucket.level > 0.0}
        self._twin_counts = counts


def _leak_hz(can_id: int, cycle_ns: int) -> float:
    """Highest rate of an id that is not babble, frames/s: twice the rate that the DBC allows, at least 50."""
    return max(2.0 * FASTEST_HZ.get(can_id, NS / cycle_ns if cycle_ns else 0.0), SLOWEST_LEAK_HZ)


LEAKS_HZ = {can_id: _leak_hz(can_id, row.cycle_ns) for can_id, row in TABLE.items()}
