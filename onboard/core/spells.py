"""When a recovery that ends by itself has had its chances: how often a thing began of late, and how long it lasts."""

from __future__ import annotations

from collections import deque


class Spells:
    """`note` each tick whether it holds.

    used_up: it began more than `most` times in the last `within_ns`, or it lasts for over `longest_ns`.
    """

    def __init__(self, most: int, within_ns: int, longest_ns: int) -> None:
        self._most, self._within_ns, self._longest_ns = most, within_ns, longest_ns
        self._begun_ns: deque[int] = deque(maxlen=most + 1)
        self._holds = self.used_up = False

    def note(self, holds: bool, now_ns: int) -> None:
        """One tick."""
        if holds and not self._holds:
            self._begun_ns.append(now_ns)
        self._holds = holds
        often = len(self._begun_ns) > self._most and now_ns - self._begun_ns[0] <= self._within_ns
        self.used_up = often or (holds and now_ns - self._begun_ns[-1] > self._longest_ns)

    def digest_items(self) -> tuple[int, ...]:
        """What of this state enters the digest of the core's state."""
        return (self._holds, self.used_up, len(self._begun_ns), sum(self._begun_ns))
