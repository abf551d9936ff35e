"""Monitors of the rover's own computer: ticks left out, late orders, and the load figures of the machine.

    TICK_LATE           5 ticks or more left out within one second: work that can wait is shed
    CONTROL_LATE        the wheels' orders are sent over 50 ms late: the wheels stand for one second
    COMPUTER_STRAINED   processor, memory or temperature over a limit in three readings, about one a second

Left-out ticks show in the tick numbers, which replay and lock-step have too. The lateness of a tick is measured.
"""

from __future__ import annotations

from collections import deque

from onboard.config import Computer
from onboard.core.faults.retry_limit import Spells
from onboard.records import Inputs, Machine
from protocol.conventions import TICK_NS

COMPUTER_ROWS = ("TICK_LATE", "CONTROL_LATE", "COMPUTER_STRAINED")
LEFT_OUT, WINDOW_NS = 5, 1_000_000_000
LATE_NS, STAND_NS = 50_000_000, 1_000_000_000
LOOKS = 3
MB = 1 << 20


class ComputerWatch:
    """Watch of the computer; call `update` each tick.

    found: row -> finding, in words.
    machine: newest load figures; None before the first.
    """

    def __init__(self) -> None:
        self.found: dict[str, str] = {}
        self.machine: Machine | None = None
        self._tick: int | None = None
        self._left_out: deque[tuple[int, int]] = deque()  # (now_ns, ticks) within the last second
        self._stands_until_ns = 0
        self._looks = 0
        self._spells = _chances()

    @property
    def used_up(self) -> frozenset[str]:
        """Rows whose retry limit is used up."""
        return frozenset(name for name, spells in self._spells.items() if spells.used_up)

    def update(self, inputs: Inputs, limits: Computer) -> None:
        """Process one tick."""
        left_out = 0 if self._tick is None else inputs.tick - self._tick - 1
        self._tick = inputs.tick
        self._late(left_out, inputs.now_ns)
        self._control(left_out * TICK_NS + inputs.timing.late_ns, inputs.now_ns)
        if inputs.machine is not None:
            self.machine = inputs.machine
            self._look(inputs.machine, limits)
        for name, spells in self._spells.items():
            spells.note(name in self.found, inputs.now_ns)

    def forget(self, name: str) -> None:
        """Drop the finding of a row and reset its retry limit."""
        if name in COMPUTER_ROWS:
            self.found.pop(name, None)
        if name in self._spells:
            self._spells[name] = _chances()[name]

    def _late(self, left_out: int, now_ns: int) -> None:
        if left_out:
            self._left_out.append((now_ns, left_out))
        while self._left_out and self._left_out[0][0] <= now_ns - WINDOW_NS:
            self._left_out.popleft()
        count = sum(ticks for _, ticks in self._left_out)
        self._set("TICK_LATE", f"{count} of 100" if count >= LEFT_OUT else "")

    def _control(self, late_ns: int, now_ns: int) -> None:
        if late_ns > LATE_NS:
            self._stands_until_ns = now_ns + STAND_NS
            self._set("CONTROL_LATE", f"{late_ns / 1e6:.0f} ms")
        elif now_ns >= self._stands_until_ns:
            self._set("CONTROL_LATE", "")

    def _look(self, machine: Machine, limits: Computer) -> None:
        past = strained(machine, limits)
        self._looks = self._looks + 1 if past else 0
        self._set("COMPUTER_STRAINED", past if self._looks >= LOOKS else "")

    def _set(self, name: str, text: str) -> None:
        if text:
            self.found[name] = text
        else:
            self.found.pop(name, None)

    def digest_items(self) -> tuple[float, ...]:
        """Values of this state that go into the state digest."""
        spells = (item for row in self._spells.values() for item in row.digest_items())
        counts = (len(self._left_out), self._stands_until_ns, self._looks, len(self.found))
        return (*counts, *spells, *(self.machine or ()))


def strained(machine: Machine, limits: Computer) -> str:
    """Return the figures over their limit, in words; '' if none is. A figure that is not known (NaN) is never over."""
    free_mb = machine.free_memory_bytes / MB
    rows = (
        (machine.cpu_ratio > limits.cpu_ratio, f"{100 * machine.cpu_ratio:.0f} % of the processor at work"),
        (machine.rss_bytes > limits.rss_bytes, f"{machine.rss_bytes / MB:.0f} MB of memory taken"),
        (machine.free_memory_bytes < limits.free_memory_bytes, f"{free_mb:.0f} MB of memory free"),
        (machine.temperature_c > limits.temperature_c, f"{machine.temperature_c:.0f} degrees Celsius"),
    )
    return ", ".join(text for past, text in rows if past)


def _chances() -> dict[str, Spells]:
    """Return new retry limits: ticks left out for a minute, or a fourth late order within a minute, use them up."""
    minute_ns = 60_000_000_000
    return {
        "TICK_LATE": Spells(most=10, within_ns=10 * minute_ns, longest_ns=minute_ns),
        "CONTROL_LATE": Spells(most=3, within_ns=minute_ns, longest_ns=5_000_000_000),
    }
