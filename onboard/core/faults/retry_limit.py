"""Retry limit of a self-clearing fault: how often it recurred and how long it lasted."""

from __future__ import annotations

from collections import deque


class Spells:
    """Retry limit; call `note` each tick.

    used_up: the fault began more than `most` times within `within_ns`, or it has lasted for over `longest_ns`.
    """

    def __init__(self, most: int, within_ns: int, longest_ns: int) -> None:
        self._most, self._within_ns, self._longest_ns = most, within_ns, longest_ns
        self._begun_ns: deque[int] = deque(maxlen=most + 1)
        self._holds = self.used_up = False

    def note(self, holds: bool, now_ns: int) -> None:
        """Process one tick. holds: the fault is active."""
        if holds and not self._holds:
            self._begun_ns.append(now_ns)
        self._holds = holds
        often = len(self._begun_ns) > self._most and now_ns - self._begun_ns[0] <= self._within_ns
        self.used_up = often or (holds and now_ns - self._begun_ns[-1] > self._longest_ns)

    def digest_items(self) -> tuple[int, ...]:
        """Values of this state that go into the state digest."""
        return (self._holds, self.used_up, len(self._begun_ns), sum(self._begun_ns))
