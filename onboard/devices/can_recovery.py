"""Recovery of the CAN bus: whether it is lost, when to reopen it, when to give up.

    WELL -- closed, bus-off, down, or no frame of any node for 40 ms --> LOST
    LOST -- opened at once, then after 0.1, 0.2, 0.4, 0.8, 1.6 s; used up 0.5 s after the last; then every 10 s
    LOST -- the port is open and a frame comes --> HEALING
    HEALING -- frames for 0.1 s --> WELL          HEALING -- as above --> LOST, the tries go on counting

The tries are reset after the bus was well for 10 s: a bus that fails again and again ends in SAFE too. The caller
detects the nodes' frames. Silence in the first second is no loss.
"""

from __future__ import annotations

from enum import IntEnum

from onboard.records import BusStatus, PortState

SILENT_NS, HEAL_NS, GRACE_NS = 40_000_000, 100_000_000, 1_000_000_000
WAITS_NS = (100_000_000, 200_000_000, 400_000_000, 800_000_000, 1_600_000_000, 500_000_000)
SLOW_NS, REST_NS, NEWS_NS = 10_000_000_000, 10_000_000_000, 1_000_000_000


class Bus(IntEnum):
    """State of the bus."""

    WELL = 0
    LOST = 1
    HEALING = 2


class CanRecovery:
    """Recovery state machine; call `step` once a tick.

    tries: attempts to open in this loss.
    losses: since the start.
    status: newest status of the port.
    news: the port's error text when it has changed, at most once a second; else empty.
    """

    def __init__(self) -> None:
        self.state = Bus.WELL
        self.status = BusStatus()
        self.tries = self.losses = 0
        self._heard_ns = self._since_ns = self._next_ns = self._told_ns = 0
        self._connect = False
        self._told = self.news = ""

    def step(self, status: BusStatus, heard: bool, now_ns: int) -> bool:
        """Process one tick. heard: a good frame of any node came. Returns True in the tick in which frames return."""
        self.status, self._connect = status, False
        self._notice(status.error, now_ns)
        if heard:
            self._heard_ns = now_ns
        silent = now_ns - self._heard_ns >= SILENT_NS and now_ns > GRACE_NS
        if status.state is not PortState.OPEN or silent:
            self._lost(now_ns)
            return False
        back = self.state is Bus.LOST and heard
        if back:
            self.state, self._since_ns = Bus.HEALING, now_ns
        elif self.state is Bus.HEALING and now_ns - self._since_ns >= HEAL_NS:
            self.state, self._since_ns = Bus.WELL, now_ns
        elif self.state is Bus.LOST:
            self._try(now_ns)
        return back

    @property
    def wants_connect(self) -> bool:
        """True if this tick starts an attempt to open the bus."""
        return self._connect

    @property
    def used_up(self) -> bool:
        """True if the bus is still lost after the last quick try and the wait that follows it."""
        return self.tries > len(WAITS_NS) and self.state is Bus.LOST

    @property
    def words(self) -> str:
        """Error text, for people; '' if there is none."""
        return self.status.error or ("" if self.state is Bus.WELL else "no frame of any node")

    def digest_items(self) -> tuple[int, ...]:
        """Values of this state that go into the state digest."""
        return (int(self.state), self.tries, self.losses, self._next_ns)

    def _notice(self, words: str, now_ns: int) -> None:
        self.news = ""
        if words != self._told and now_ns - self._told_ns >= NEWS_NS:
            self._told, self._told_ns = words, now_ns
            self.news = words or "is well"

    def _lost(self, now_ns: int) -> None:
        if self.state is Bus.WELL:
            if now_ns - self._since_ns >= REST_NS:
                self.tries = 0
            self.losses += 1
            self._next_ns = now_ns
        self.state = Bus.LOST
        self._try(now_ns)

    def _try(self, now_ns: int) -> None:
        if now_ns < self._next_ns:
            return
        self._connect = True
        self.tries += 1
        self._next_ns = now_ns + (WAITS_NS[self.tries - 1] if self.tries <= len(WAITS_NS) else SLOW_NS)
